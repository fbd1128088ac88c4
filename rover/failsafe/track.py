"""The rover's own track since the radio last had a signal: the way back to it."""

BACK = {"N": "S", "E": "W", "S": "N", "W": "E"}
"""The move that undoes each move."""


class Track:
    """The moves since the last place with a signal, without loops.

    A move that was blocked led nowhere. Whatever place is met again, the way in between is left
    out, so the track is never longer than there are places.
    """

    def __init__(self) -> None:
        self._places: list[str] = []
        self._moves: list[str] = []

    def at(self, place: str, *, has_signal: bool, move: str | None) -> None:
        """The rover stands at a place, after a move that ended there; `None` after none."""
        if has_signal or not self._places:
            self._places, self._moves = [place], []
        elif place in self._places:
            kept = self._places.index(place)
            del self._places[kept + 1 :], self._moves[kept:]
        elif move is not None:
            self._places.append(place)
            self._moves.append(move)

    @property
    def back(self) -> str | None:
        """The move that leads back by one place; `None` at the end of the track."""
        return BACK[self._moves[-1]] if self._moves else None
