"""A tour that teaches the rover all that can be reached."""

import math
from collections.abc import Sequence

from farside.acts import Planned
from farside.control import CommandStage, Failsafe
from farside.ground.config import GuideConfig
from farside.ground.operators.lessons import Lessons, Move
from farside.ground.operators.seat import Seat, Work
from farside.messages import Drive, StuckChanged
from farside.places import Cell

_RESERVE = 2
_CHARGED = 0.9
_REMEMBERED = 4
"""So many times the charge that the way to the dock takes is kept in reserve; up to this state the
rover is charged; over so many times what moves take is averaged (project defaults)."""


def teach(seat: Seat, config: GuideConfig) -> Work:
    """Drive until every move was made that can be; see `GuideConfig`."""
    tour: _Tour | None = None
    while True:
        cell = seat.standing("the rover to be heard")
        if cell is None:
            yield ()
            continue
        if tour is None:
            tour = _Tour(seat, cell, config)
        if _is_unsafe(seat):
            seat.wait_for("the rover to be safe to drive")
            yield ()
        elif (way := tour.way_to_charge(cell)) is not None:
            yield from tour.charge(way)
        elif moves := tour.lessons.plan(cell, config.ahead, tour.heading):
            lessons = tour.lessons
            seat.wait_for(f"every move to be made, as {lessons.made} of {lessons.of} are")
            yield from tour.make(moves)
        elif tour.lessons.knows(cell) or not tour.lessons.of:
            break
        else:
            seat.wait_for("the rover to be where a way leads from")
            yield ()
    if left := tour.lessons.left:
        first = left[0]
        seat.give_up(
            f"{len(left)} moves, as they were blocked: first {first.action} "
            f"from {seat.name(first.cell)}"
        )


class _Tour:
    """A tour under way.

    Attributes:
        lessons: what is still to be taught.
        heading: the action of the last move that was sent.
    """

    def __init__(self, seat: Seat, start: Cell, config: GuideConfig) -> None:
        self._seat, self._ahead = seat, config.ahead
        self.lessons = Lessons(seat.chart, start, config.times)
        self.heading: str | None = None
        self._taken = 0.0  # of the charge, by moves that were sent together
        self._insist_on: Move | None = None  # if it is sent again right now

    def way_to_charge(self, cell: Cell) -> list[Move] | None:
        """The way to the dock where it is time to go there; `None` otherwise, or without one.

        It is when the battery is low, or when what is left is not twice what the way there takes:
        behind a long delay most of the charge goes while the rover waits for the next word.
        """
        dock = self._seat.chart.dock
        if dock is None:
            return None
        way = self.lessons.way_to(cell, dock)
        if not way and cell != dock:
            return None
        rounds = math.ceil(len(way) / self._ahead) + 1
        enough = _RESERVE * rounds * self._taken
        return way if self._seat.is_low or self._seat.battery < enough else None

    def charge(self, way: list[Move]) -> Work:
        """Go on along the way to the dock, or wait there until the rover is charged."""
        if way:
            self._seat.wait_for("the rover to be at the dock")
            yield from self.make(way[: self._ahead])
            return
        while self._seat.is_low or self._seat.battery < _CHARGED:
            self._seat.wait_for("the rover to be charged")
            yield ()

    def make(self, moves: Sequence[Move]) -> Work:
        """Send moves, each to be begun once the one before is done, and learn what came of them."""
        first = self._seat.situation.commands.last_given + 1
        force = moves[0] == self._insist_on
        before = self._seat.battery
        drives = [Drive(move.action) for move in moves[1:]]
        yield [
            Drive(moves[0].action, force=force),
            *(Planned(drive, follows=True) for drive in drives),
        ]
        while not (self._seat.situation.settled and self._are_known(first, len(moves))):
            yield ()
        self._learn(moves, first)
        # The mean of the last few times, so that no outage counts for ever.
        taken = max(0.0, before - self._seat.battery)
        self._taken += (taken - self._taken) / _REMEMBERED if self._taken else taken

    def _are_known(self, first: int, count: int) -> bool:
        """Whether it is known how so many commands ended; word of it may be behind telemetry."""
        lives = map(self._seat.situation.commands.life, range(first, first + count))
        return all(life is None or life.end is not None for life in lives)

    def _learn(self, moves: Sequence[Move], first: int) -> None:
        """What became of moves, the first of them by the command of this number."""
        self._insist_on = None
        for number, move in enumerate(moves, start=first):
            end = self._seat.situation.commands.end_of(number)
            if end is not None:
                if end.stage is CommandStage.FAILED:
                    self.lessons.note_blocked(move)
                if end.stage in {CommandStage.FAILED, CommandStage.REFUSED}:
                    self._insist_on = move  # which is refused where it was blocked just now
                return
            self.lessons.note_made(move)
            self.heading = move.action


def _is_unsafe(seat: Seat) -> bool:
    """Whether the rover stands since something is wrong that no drive can mend."""
    if seat.telemetry is None or seat.telemetry.failsafe is not Failsafe.SAFE:
        return False
    said = (event.what for event in reversed(seat.situation.belief.events))
    last = next((what for what in said if isinstance(what, StuckChanged)), None)
    return last is None or not last.stuck
