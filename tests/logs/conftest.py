"""A small handmade run, for tests that record, query or show one."""

import math
from pathlib import Path
from typing import Self

import msgspec
import pytest
from noting import failsafe_entry, records_of

from farside.control import Failsafe, Mode, ModeCause
from farside.frames import Fate, FrameFate
from farside.logs import LogFile, Recorder
from farside.messages import Telemetry
from farside.missions import FinishedRun
from farside.node import Direction, Record, to_ns
from farside.places import Chart
from farside.topics import GoalChange, GoalEntry, GoalSource, ModeEntry, Pose, Yard

ROWS = (
    "#######",
    "#A.#.B#",
    "#..o..#",
    "#C...D#",
    "#######",
)


class Handmade:
    """A run that a test builds message by message; every method returns the run."""

    def __init__(self) -> None:
        self._chart = Chart(ROWS, 1.0)
        self._records: list[Record] = []
        self._frames = dict.fromkeys(Direction, 0)

    def note(self, t_s: float, *messages: msgspec.Struct) -> Self:
        """Record messages at `t_s`."""
        self._records += records_of((t_s, message) for message in messages)
        return self

    def start(self, place: str = "at:D") -> Self:
        """Record what every run starts with."""
        self.note(0, Yard(ROWS, 1.0), ModeEntry(Mode.GUIDED, ModeCause.START))
        return self.note(0, failsafe_entry()).stand(0, place)

    def stand(self, t_s: float, place: str, heading_rad: float = math.pi / 2) -> Self:
        """Record that the rover truly is at `place`."""
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
        """Record a change of the Goal List."""
        return self.note(t_s, GoalEntry(tokens, change, priority, source))

    def reach(self, t_s: float, *tokens: str, source: GoalSource = GoalSource.OPERATOR) -> Self:
        """Record that the rover considers a goal reached."""
        return self.goal(t_s, *tokens, change=GoalChange.REACHED, source=source)

    def frame(
        self, t_s: float, direction: Direction, fate: Fate = Fate.DELIVERED, *, size_byte: int = 10
    ) -> Self:
        """Record a frame with a delay of 1.25 s, whose fate is decided as soon as it is sent."""
        sequence, now_ns = self._frames[direction], to_ns(t_s)
        self._frames[direction] = sequence + 1
        arrival_ns = now_ns + to_ns(1.25) if fate is Fate.DELIVERED else None
        decided = FrameFate(
            direction, sequence, size_byte, now_ns, now_ns, now_ns, arrival_ns, fate
        )
        return self.note(t_s, decided)

    def hear(self, t_s: float, place: str, *, since_s: float) -> Self:
        """Record that telemetry measured at `since_s` reaches the ground at `t_s`."""
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
        """All records so far, in log order."""
        return sorted(self._records, key=lambda record: record.log_time_ns)

    def log(self, path: Path, *, window: int = 5) -> Path:
        """Write a finished log of the run, flushed after every `window` records."""
        records = self.records
        with Recorder(path) as recorder:
            for start in range(0, len(records), window):
                recorder.write(records[start : start + window])
                recorder.flush()
        return path


@pytest.fixture
def run() -> Handmade:
    return Handmade()


@pytest.fixture(scope="session")
def flown(blackout: FinishedRun) -> LogFile:
    """The log of the shipped blackout mission."""
    return LogFile(blackout.log)


@pytest.fixture
def handmade() -> type[Handmade]:
    """For tests of several runs."""
    return Handmade


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A path for a new log."""
    return tmp_path / "run.mcap"
