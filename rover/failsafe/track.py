"""The rover's own track since the last place of a kind: the way back there, whatever is learned."""

BACK = {"N": "S", "E": "W", "S": "N", "W": "E"}
"""The move that undoes each move."""


class Track:
    """The moves since the last place of a kind, such as those with a signal, without loops.

    A move that was blocked led nowhere. Whatever place is met again, the way in between is left
    out, so the track is never longer than there are places. Before the first place of the kind
    there is none.
    """

    def __init__(self) -> None:
        self._places: list[str] = []
        self._moves: list[str] = []

    def lose(self) -> None:
        """The rover moved and does not know where to: the way back is not known any more."""
        self._places, self._moves = [], []

    def at(self, place: str, *, is_end: bool, move: str | None) -> None:
        """The rover stands at a place, after a move that ended there; `None` after none.

        Args:
            place: the Token of the place.
            is_end: whether it is of the kind that the track leads back to.
            move: the move.
        """
        if is_end:
            self._places, self._moves = [place], []
        elif place in self._places:
            kept = self._places.index(place)
            del self._places[kept + 1 :], self._moves[kept:]
        elif self._places and move is not None:
            self._places.append(place)
            self._moves.append(move)

    @property
    def back(self) -> str | None:
        """The move that leads back by one place; `None` at the end, or without a track."""
        return BACK[self._moves[-1]] if self._moves else None

    @property
    def length(self) -> int | None:
        """The number of moves back to the end; `None` without a track."""
        return len(self._moves) if self._places else None
