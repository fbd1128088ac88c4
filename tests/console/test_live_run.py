"""A whole run with a person at the ground: it succeeds, and its log verifies."""

from collections.abc import Sequence
from functools import partial
from itertools import count
from pathlib import Path

import pytest
from sitting import BlackoutPerson, Press

from farside.console.screen.screen import Screen
from farside.console.session import Session
from farside.console.station import Station
from farside.control import Mode
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.interrupts import Interrupts
from farside.missions.reliving.verifying import verify
from farside.missions.run import FinishedRun
from farside.node import Record, to_ns


class Sitting(AtStation):
    """A person who looks after every window, and never holds the run."""

    def __init__(self, station: Station, person: BlackoutPerson) -> None:
        super().__init__(station, Interrupts())
        self._station, self._person = station, person
        self.replies: list[str] = []
        self.screens: list[Screen] = []

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        super().watch(now_s, records)
        screen, chart = self._station.screen(), self._station.chart
        assert chart is not None
        self.screens.append(screen)
        press = self._person.next(screen, chart)
        if press is not None:
            self.replies.append(self._station.do(partial(do, press)))


def do(press: Press, session: Session) -> str:
    match press.what:
        case "choose":
            return session.choose(press.which)
        case "approve":
            return session.approve(int(press.which))
        case "goal":
            return session.set_goal(press.which)
        case _:
            return session.set_mode(Mode(press.which))


def sat(tmp_path: Path, *, in_process: bool = True) -> tuple[FinishedRun, Sitting]:
    loaded = load_mission("blackout", ('ground.operator="queued"',))
    session = Session("blackout", to_ns(loaded.mission.duration_s))
    # By this clock every window is worth a look.
    station = Station(session, end=lambda: None, now=partial(next, count(0, 1)))
    station.leave()
    sitting = Sitting(station, BlackoutPerson())
    return run_mission(loaded, in_process=in_process, out=tmp_path, watcher=sitting), sitting


@pytest.fixture(scope="session")
def afternoon(tmp_path_factory: pytest.TempPathFactory) -> tuple[FinishedRun, Sitting]:
    """A person who plays `blackout` by the screen alone."""
    return sat(tmp_path_factory.mktemp("sat"))


def test_a_person_who_sees_only_the_screen_meets_all_that_the_mission_expects(
    afternoon: tuple[FinishedRun, Sitting],
) -> None:
    run, sitting = afternoon

    assert run.result.outcome == "success", run.result.expectations
    assert not [line for line in sitting.replies if line.startswith("not ")]


def test_the_log_of_a_run_with_a_person_verifies(afternoon: tuple[FinishedRun, Sitting]) -> None:
    run, _ = afternoon

    assert verify(run.log).equal


def test_nobody_is_told_what_the_rover_did_in_the_silence_before_it_can_be_known(
    afternoon: tuple[FinishedRun, Sitting],
) -> None:
    run, sitting = afternoon
    assert run.mode_at(700) == "autonomous"

    in_silence = [one for one in sitting.screens if to_ns(660) < one.now_ns < to_ns(980)]
    back = sitting.screens[-1]

    assert len(in_silence) > 300
    assert {screen.mode.text for screen in in_silence} == {"SHARED"}
    assert not any("reached at:B" in str(screen.events) for screen in in_silence)
    assert any("meanwhile" in event.text for event in back.events)
