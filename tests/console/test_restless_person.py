"""A person who presses anything at any time, and what the ground must not show however it is."""

from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

import pytest
from msgspec.structs import replace
from restless_person import QUEUED, GivenAgain, restless_run

from farside.console.session import Session
from farside.console.station import Station
from farside.ground.view.view import Focus, GroundView
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.interrupts import Interrupts
from farside.missions.reliving.verifying import verify
from farside.node import Record, to_ns

Look = Callable[[Focus], GroundView | None]

CUT_OFF = ("duration_s=120", "link.blackouts=[{start_s=30.0, end_s=75.0}]")


@pytest.mark.parametrize(
    ("mission", "settings", "seed"),
    [("blackout", CUT_OFF, 4), ("mars-relay", ("duration_s=130",), 1)],
    ids=["cut off", "between passes"],
)
def test_whatever_is_pressed_the_log_verifies_and_no_window_nor_pause_leaves_a_mark(
    mission: str, settings: Sequence[str], seed: int, tmp_path: Path
) -> None:
    run, person = restless_run(mission, settings, tmp_path, seed)

    assert len(person.given) >= 3
    assert len([line for line in person.replies if line.startswith("not ")]) > 10
    assert verify(run.log).equal
    loaded = load_mission(mission, (*settings, QUEUED))
    again = run_mission(
        loaded, in_process=True, out=tmp_path, watcher=GivenAgain(person.given, seed)
    )
    assert again.result.digest == run.result.digest


class TwoSessions(AtStation):
    """One is handed every record; the other the ground's, and nonsense in place of the others."""

    def __init__(self, end_ns: int) -> None:
        self.whole, self.blind = (Session("blackout", end_ns) for _ in range(2))
        clock = count()
        station = Station(self.whole, end=lambda: None, now=lambda: next(clock))
        station.leave()
        super().__init__(station, Interrupts())
        self.withheld = 0

    def seeing(self, look: Look) -> None:
        def looking(focus: Focus) -> GroundView | None:
            view = look(focus)
            self.blind.see(view)
            return view

        super().seeing(looking)

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        known = [self._as_known(record) for record in records]
        self.blind.take(to_ns(now_s), known)
        super().watch(now_s, records)
        assert self.blind.screen() == self.whole.screen()

    def _as_known(self, record: Record) -> Record:
        if record.topic.startswith("/ground/"):
            return record
        self.withheld += 1
        return replace(record, payload=b"nonsense")


def test_what_the_ground_did_not_note_is_on_no_screen_of_a_whole_run(tmp_path: Path) -> None:
    loaded = load_mission("blackout", {"duration_s": 150.0})
    two = TwoSessions(to_ns(150))

    run_mission(loaded, in_process=True, out=tmp_path, watcher=two)

    assert two.withheld > 1000
