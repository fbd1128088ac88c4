"""The walk that teaches every move of a yard, as short as can be."""

from collections import Counter, deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

from farside.places import ACTIONS, Cell, Chart

_TRIES = 3
"""A move that was blocked so many times in a row is given up (project default)."""

_TURN = {"N": 0, "E": 1, "S": 2, "W": 3}


class Move(NamedTuple):
    """An action at a place."""

    cell: Cell
    action: str

    @property
    def to(self) -> Cell:
        """The place that it leads to."""
        return self.cell.beside(self.action)


_Wanted = Callable[[Move, int], bool]
"""Whether a move is looked for, where ways lead by moves that were blocked at most so often."""


class Lessons:
    """The moves that are still to be made, and which to make next.

    As every move has its reverse, there is a closed walk that makes each exactly once (Euler). It
    comes about by taking at every place any move that is left, except that the one towards the
    start is left for last (de Bruijn and van Aardenne-Ehrenfest; Smith and Tutte: BEST). Of the
    others the one that needs the least turning goes first. Where something has come between, the
    walk goes on with the nearest move that is left.

    Args:
        chart: the yard. Places in terrain shadow are left out, since no order arrives there.
        start: where the rover is.
        times: how often each move is to be made.

    Attributes:
        of: how many moves are to be made altogether.
        made: how many of these were made.
    """

    def __init__(self, chart: Chart, start: Cell, times: int) -> None:
        self._chart = chart
        self._home: dict[Cell, str] = {}
        self._left: dict[Move, int] = {}
        self._blocked: Counter[Move] = Counter()
        self._lay_out(start, times)
        self.of, self.made = sum(self._left.values()), 0

    def _lay_out(self, start: Cell, times: int) -> None:
        seen, frontier = {start}, deque([start])
        while frontier:
            cell = frontier.popleft()
            for move in self._moves(cell):
                self._left[move] = times
                if move.to not in seen:
                    seen.add(move.to)
                    frontier.append(move.to)
                    self._home[move.to] = _REVERSE[move.action]

    def _moves(self, cell: Cell) -> Iterator[Move]:
        """The moves from a place, none of them into the shadow."""
        for action, beside in self._chart.neighbours(cell):
            if beside not in self._chart.shadow:
                yield Move(cell, action)

    # --- what has become of a move -------------------------------------------------------------

    def note_made(self, move: Move) -> None:
        """A move was made."""
        self._blocked.pop(move, None)
        if self._left.get(move, 0) > 0:
            self._left[move] -= 1
            self.made += 1

    def note_blocked(self, move: Move) -> None:
        """A move was blocked."""
        self._blocked[move] += 1

    @property
    def left(self) -> list[Move]:
        """The moves that were not made often enough."""
        return [move for move, count in self._left.items() if count > 0]

    def knows(self, cell: Cell) -> bool:
        """Whether there is anything to teach at a place."""
        return any(move in self._left for move in self._moves(cell))

    # --- what to do next -----------------------------------------------------------------------

    def plan(self, cell: Cell, most: int, heading: str | None = None) -> list[Move]:
        """The next moves from a place, at most so many; none where nothing is left.

        Args:
            cell: the place.
            most: as many as are wanted.
            heading: the action of the move before.
        """
        planned: list[Move] = []
        ahead: Counter[Move] = Counter()

        def wanted(move: Move, _blocked: int) -> bool:
            return self._left.get(move, 0) > ahead[move]

        while len(planned) < most:
            way = self._way(cell, wanted, heading)
            if not way:
                break
            planned += way
            ahead.update(way)
            cell, heading = way[-1].to, way[-1].action
        return planned[:most]

    def way_to(self, cell: Cell, target: Cell) -> list[Move]:
        """The moves of a way to a place, past those that were blocked; none if there is none."""
        if cell == target:
            return []

        def wanted(move: Move, blocked: int) -> bool:
            return move.to == target and self._blocked[move] <= blocked

        return self._way(cell, wanted, None)

    def _way(self, cell: Cell, wanted: _Wanted, heading: str | None) -> list[Move]:
        """The way to the nearest move that is wanted, by moves that were blocked least."""
        for blocked in sorted({0, *(self._blocked.values())}):
            if blocked < _TRIES and (way := self._nearest(cell, wanted, heading, blocked)):
                return way
        return []

    def _nearest(
        self, start: Cell, wanted: _Wanted, heading: str | None, blocked: int
    ) -> list[Move]:
        came_by: dict[Cell, Move | None] = {start: None}
        frontier = deque([start])
        while frontier:
            cell = frontier.popleft()
            before = came_by[cell]
            moves = [move for move in self._moves(cell) if self._blocked[move] < _TRIES]
            if choices := [move for move in moves if wanted(move, blocked)]:
                facing = heading if before is None else before.action
                way = [min(choices, key=lambda move: self._rank(move, facing))]
                while before is not None:
                    way.append(before)
                    before = came_by[before.cell]
                return way[::-1]
            for move in moves:
                if self._blocked[move] <= blocked and move.to not in came_by:
                    came_by[move.to] = move
                    frontier.append(move.to)
        return []

    def _rank(self, move: Move, facing: str | None) -> tuple[int, bool, int, int]:
        """The least comes first: least blocked, not towards the start, with the least turning."""
        turn = 0 if facing is None else (_TURN[move.action] - _TURN[facing]) % 4
        is_home = self._home.get(move.cell) == move.action
        return self._blocked[move], is_home, min(turn, 4 - turn), _TURN[move.action]


_REVERSE = {
    action: back
    for action, (east, north) in ACTIONS.items()
    for back, way in ACTIONS.items()
    if way == (-east, -north)
}
