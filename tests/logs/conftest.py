"""A small run made by hand, for tests that need one to record, ask or look at."""

import math
from pathlib import Path
from typing import Self

import msgspec
import pytest
from noting import records_of

from farside.logs import Recorder
from farside.messages import Failsafe, Mode, ModeCause, Telemetry
from farside.node import Direction, Record, to_ns
from farside.places import Chart
from farside.topics import (
    FailsafeEntry,
    Fate,
    FrameFate,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
    Pose,
    Yard,
)

ROWS = (
    "#######",
    "#A.#.B#",
    "#..o..#",
    "#C...D#",
    "#######",
)


class Handmade:
    """A run that a test writes down, one entry after the other; every method gives it back."""

    def __init__(self) -> None:
        self._chart = Chart(ROWS, 1.0)
        self._records: list[Record] = []
        self._frames = dict.fromkeys(Direction, 0)

    def note(self, t_s: float, *entries: msgspec.Struct) -> Self:
        """Entries known at `t_s`."""
        self._records += records_of((t_s, entry) for entry in entries)
        return self

    def start(self, place: str = "at:D") -> Self:
        """What every run logs first."""
        self.note(0, Yard(ROWS, 1.0), ModeEntry(Mode.GUIDED, ModeCause.START))
        return self.note(0, FailsafeEntry(Failsafe.NOMINAL, 0.0)).stand(0, place)

    def stand(self, t_s: float, place: str, heading_rad: float = math.pi / 2) -> Self:
        """The rover really is at `place`."""
        x_m, y_m = self._chart.centre_m(self._chart.cells[place])
        return self.note(t_s, Pose(x_m, y_m, heading_rad, 0.0, place, 0.75))

    def goal(
        self,
        t_s: float,
        *tokens: str,
        change: GoalChange = GoalChange.SET,
        priority: float = 1.0,
        source: GoalSource = GoalSource.OPERATOR,
    ) -> Self:
        """A change of the Goal List."""
        return self.note(t_s, GoalEntry(tokens, change, priority, source))

    def reach(self, t_s: float, *tokens: str, source: GoalSource = GoalSource.OPERATOR) -> Self:
        """The rover takes a goal to be reached."""
        return self.goal(t_s, *tokens, change=GoalChange.REACHED, source=source)

    def frame(
        self, t_s: float, direction: Direction, fate: Fate = Fate.DELIVERED, *, size_byte: int = 10
    ) -> Self:
        """A frame that needs 1.25 s, and whose fate comes about as soon as it is handed over."""
        number, now_ns = self._frames[direction], to_ns(t_s)
        self._frames[direction] = number + 1
        arrival_ns = now_ns + to_ns(1.25) if fate is Fate.DELIVERED else None
        ended = FrameFate(direction, number, size_byte, now_ns, now_ns, now_ns, arrival_ns, fate)
        return self.note(t_s, ended)

    def hear(self, t_s: float, place: str, *, since_s: float) -> Self:
        """Telemetry reaches the ground at `t_s` that was so at `since_s`."""
        x_m, y_m = self._chart.centre_m(self._chart.cells[place])
        heard = Telemetry(
            to_ns(since_s),
            (place,),
            x_m,
            y_m,
            0.0,
            0.75,
            Mode.GUIDED,
            Failsafe.NOMINAL,
            None,
            (),
            0,
        )
        (record,) = records_of([(t_s, heard)])
        self._records.append(msgspec.structs.replace(record, publish_time_ns=to_ns(since_s)))
        return self

    @property
    def records(self) -> list[Record]:
        """All records so far, in the order of a log."""
        return sorted(self._records, key=lambda record: record.log_time_ns)

    def log(self, path: Path, *, window: int = 5) -> Path:
        """A finished log of it, flushed after every `window` records."""
        records = self.records
        with Recorder(path) as recorder:
            for start in range(0, len(records), window):
                recorder.write(records[start : start + window])
                recorder.flush()
        return path


@pytest.fixture
def run() -> Handmade:
    return Handmade()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where a log may be written."""
    return tmp_path / "run.mcap"
