"""A person who presses whatever there is, at any time, and much that there is not: for tests."""

from collections.abc import Sequence
from itertools import count
from pathlib import Path
from random import Random

import msgspec

from farside.acts import Act
from farside.console.page.hand import Hand, Press, What
from farside.console.screen.screen import Screen
from farside.console.seats import Seats
from farside.console.session import Session
from farside.console.station import Station
from farside.escaping import printable
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.conductor import Watcher
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import Record, to_ns

QUEUED = 'ground.operator="queued"'

_WORDS = ("", "N", "E", "S", "W", "A", "B", "D", "5,3", "guided", "shared", "autonomous", "shown")
_WILD = ("9" * 400 + ",1", "1e400,nan", "-1,-1", "at:A", "\x1b[2J\u202e\0", "A" * 20_000, "hover")
_NUMBERS = (0, 1, 2, 3, -1, -2, 10**30, -(10**30))
_AMOUNTS = (None, 1.0, 60.0, 0.1, 0.0, -1.0, 1e300, 1e-300, float("inf"), float("nan"))
_TOKENS = ((), ("at:B",), ("at:C",), ("at:nowhere",), ("x" * 300,) * 300, ("\x1b[0m",))


class RestlessPerson(AtStation):
    """Presses several things after each window, each of which may be of any length.

    Attributes:
        given: the orders that the run took, with the simulated time in nanoseconds.
        replies: what was said to what was pressed.
    """

    def __init__(self, session: Session, seed: int) -> None:
        # By this clock the run is never held: any time has passed between two looks.
        clock = count(0, 1e6)
        station = Station(session, end=lambda: None, now=lambda: next(clock))
        super().__init__(station, Interrupts())
        self._chance, self._session = Random(seed), session  # noqa: S311 - no secret
        seats = Seats()
        self._at, self._hand = station, Hand(station, seats)
        self._hand.page = "restless"
        seats.open("restless", 0.0)
        self.given: list[tuple[int, list[Act]]] = []
        self.replies: list[str] = []

    def window_ns(self, now_ns: int) -> int:
        asked_ns = super().window_ns(now_ns)
        assert asked_ns > 0
        return self._chance.choice((1, to_ns(0.3), to_ns(1.0), to_ns(9.0), asked_ns))

    def orders(self, now_s: float) -> Sequence[Act]:
        orders = list(super().orders(now_s))
        if orders:
            self.given.append((to_ns(now_s), orders))
        return orders

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        super().watch(now_s, records)
        for _ in range(self._chance.choice((0, 0, 1, 3))):
            self._press(self._any_press(self._at.screen()))
        if self._session.pacing.paused:
            self._press(Press(What.PLAY))
        look(self._at.screen())

    def _press(self, press: Press) -> None:
        self.replies.append(self._hand.order(press))

    def _any_press(self, screen: Screen) -> Press:
        any_of = self._chance.choice
        what = any_of(tuple(What))
        word = any_of(_WILD) if self._chance.random() < 0.1 else any_of(_WORDS)
        numbers = [number for row in screen.commands for number in (row.number, row.held or 0)]
        if screen.proposal is not None:
            numbers = [screen.proposal.number] * 3
        number = any_of((*numbers, any_of(_NUMBERS)))
        insist = any_of((False, True))
        return Press(
            what,
            word,
            number=number,
            amount=any_of(_AMOUNTS),
            tokens=any_of(_TOKENS),
            insist=insist,
        )


class GivenAgain(Watcher):
    """Gives the orders of another run at the same times, in windows of other lengths."""

    def __init__(self, given: list[tuple[int, list[Act]]], seed: int) -> None:
        self._given, self._chance = list(given), Random(seed)  # noqa: S311 - no secret

    def window_ns(self, now_ns: int) -> int:
        wanted_ns = self._chance.choice((1, to_ns(0.7), to_ns(30.0)))
        return min(wanted_ns, self._given[0][0] - now_ns) if self._given else wanted_ns

    def orders(self, now_s: float) -> Sequence[Act]:
        if self._given and self._given[0][0] == to_ns(now_s):
            return self._given.pop(0)[1]
        return ()

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        pass

    def wait(self, roles: Sequence[object], waited_s: float) -> None:
        pass


def look(screen: Screen) -> None:
    """A screen crosses to a page whole, and holds nothing that a terminal would obey."""
    assert msgspec.json.decode(msgspec.json.encode(screen), type=Screen) == screen
    for text in texts(msgspec.to_builtins(screen)):
        assert text == printable(text), text


def texts(value: object) -> list[str]:
    """Every text in it."""
    match value:
        case str():
            return [value]
        case dict():
            return [text for part in value.values() for text in texts(part)]
        case list() | tuple():
            return [text for part in value for text in texts(part)]
        case _:
            return []


def restless_run(
    mission: str, settings: Sequence[str], out: Path, seed: int
) -> tuple[FinishedRun, RestlessPerson]:
    """A run in this process with such a person."""
    loaded = load_mission(mission, (*settings, QUEUED))
    person = RestlessPerson(Session(mission, to_ns(loaded.mission.duration_s)), seed)
    return run_mission(loaded, in_process=True, out=out, watcher=person), person
