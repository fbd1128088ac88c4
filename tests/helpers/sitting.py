"""A person at the ground station, for tests: looks at the screen, and says which key comes next."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import count
from pathlib import Path
from typing import NamedTuple

from farside.console.exercise import Exercise
from farside.console.screen.screen import Chart, Screen
from farside.console.session import Session
from farside.console.station import Station
from farside.control import Mode
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import Record, to_ns
from farside.places import Cell
from farside.places import Chart as Places

TOUR = ("A", "7,7", "B", "12,1", "8,2", "C", "D")
"""The tour of the script in missions/blackout.toml."""


class Press(NamedTuple):
    """What a person does next.

    Attributes:
        what: `choose`, `approve`, `goal` or `mode`.
        which: the action, the place, the mode, or the number of a proposal.
    """

    what: str
    which: str


class BlackoutPerson:
    """Plays the mission `blackout` by the screen alone, as its script does.

    It drives the tour, hands over to the model, sends goal A, approves but for one proposal that it
    overrides, sends goal B shortly before the link is lost, and takes over when it is back.

    Attributes:
        stage: what it does, in words.
    """

    def __init__(self) -> None:
        self.stage = "tour"
        self._plays = self._play()
        self._screen: Screen | None = None
        self._places: Places | None = None

    @property
    def is_done(self) -> bool:
        """Whether it has done all that it came for."""
        return self.stage == "done"

    def next(self, screen: Screen, chart: Chart) -> Press | None:
        """What it does on this screen, if anything."""
        self._screen = screen
        if self._places is None:
            self._places = Places(tuple(chart.rows), chart.cell_m)
        return next(self._plays, None)

    @property
    def _now(self) -> Screen:
        assert self._screen is not None
        return self._screen

    def _cell(self) -> Cell | None:
        """Where the rover stands, for who has nothing on the way."""
        heard, places = self._now.map.heard, self._places
        if heard is None or places is None or self._now.on_the_way:
            return None
        return places.cell_at(heard.x_m, heard.y_m)

    def _play(self) -> Iterator[Press | None]:
        for place in TOUR:
            yield from self._drive_to(place)
        yield from self._set_mode("shared")
        self.stage = "goal A"
        yield Press("goal", "A")
        answered: set[int] = set()
        while not self._reached("A"):
            card = self._now.proposal
            if card is None or not card.can_answer or card.number in answered:
                yield None
                continue
            answered.add(card.number)
            if len(answered) == 3:
                yield Press("choose", "E")
            else:
                yield Press("approve", str(card.number))
        self.stage = "wait"
        while self._now.now_ns < to_ns(600):
            yield None
        self.stage = "goal B"
        yield Press("goal", "B")
        while not (self._reached("B") and self._reached("C")):
            yield None
        yield from self._set_mode("guided")
        self.stage = "done"

    def _drive_to(self, place: str) -> Iterator[Press | None]:
        places = None
        while places is None:
            places = self._places
            if places is None:
                yield None
        goal = places.places[place]
        while (cell := self._cell()) != goal:
            if cell is None:
                yield None
                continue
            yield Press("choose", places.way(cell, goal)[0])
            yield None  # until it is shown as ordered

    def _set_mode(self, mode: str) -> Iterator[Press | None]:
        self.stage = f"mode {mode}"
        yield Press("mode", mode)
        while self._now.mode.text != mode.upper():
            yield None

    def _reached(self, place: str) -> bool:
        return any(event.text == f"goal at:{place} reached" for event in self._now.events)


class Sitting(AtStation):
    """A person who looks after every window, and never holds the run.

    Args:
        station: the station, which nobody sits at.
        person: who plays.

    Attributes:
        replies: what the person was told.
        screens: what the person has seen.
    """

    def __init__(self, station: Station, person: BlackoutPerson) -> None:
        super().__init__(station, Interrupts())
        self._station, self._person = station, person
        self.replies: list[str] = []
        self.screens: list[Screen] = []

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`."""
        super().watch(now_s, records)
        screen, chart = self._station.screen(), self._station.chart
        assert chart is not None
        self.look(screen)
        press = self._person.next(screen, chart)
        if press is not None:
            self.replies.append(self._station.do(partial(_do, press)))

    def look(self, screen: Screen) -> None:
        """The person looks, before anything is done."""
        self.screens.append(screen)


def _do(press: Press, session: Session) -> str:
    match press.what:
        case "choose":
            return session.choose(press.which)
        case "approve":
            return session.approve(int(press.which))
        case "goal":
            return session.set_goal(press.which)
        case _:
            return session.set_mode(Mode(press.which))


def sat(
    out: Path,
    *,
    in_process: bool = True,
    sitting: Callable[[Station, BlackoutPerson], Sitting] = Sitting,
) -> tuple[FinishedRun, Sitting]:
    """A run of `blackout` with a person before the session, and that person.

    Args:
        out: folder for the log.
        in_process: as of `run_mission`.
        sitting: how the person sits there.
    """
    loaded = load_mission("blackout", ('ground.operator="queued"',))
    exercise = Exercise(lost_after_s=loaded.mission.rover.failsafe.lost_after_s)
    session = Session("blackout", to_ns(loaded.mission.duration_s), exercise=exercise)
    # By this clock every window is worth a look.
    station = Station(session, end=lambda: None, now=partial(next, count(0, 1)))
    station.leave()
    sits = sitting(station, BlackoutPerson())
    return run_mission(loaded, in_process=in_process, out=out, watcher=sits), sits
