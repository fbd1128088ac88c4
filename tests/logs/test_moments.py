"""Pictures of any moment: each is that of all that came before it."""

from bisect import bisect_right
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from noting import command_sent, log_of, records_of, said_of

from farside.control import CommandStage, Failsafe, Mode, ModeCause, TakeBackChance, Verdict
from farside.frames import LinkOutage, OutageReason
from farside.logs import EventLine, LogEntry, LogFile, Moments, Picture, picture, picture_at
from farside.logs.picture import PICTURE_TOPICS
from farside.messages import Drive, Proposal, Telemetry
from farside.node import Direction, Record, Topic, to_ns
from farside.topics import (
    ActionEnded,
    BeliefEntry,
    BeliefItem,
    Cycle,
    GoalChange,
    GoalEntry,
    GoalSource,
    HeldEntry,
    HeldFate,
    Likely,
    ModeEntry,
    OperatorEntry,
    Pose,
    Prediction,
    ProposalEnded,
    ShadowEntry,
    Silence,
)


def telemetry_of(time_s: float, commands_done: int) -> Telemetry:
    return Telemetry(
        to_ns(time_s), ("at:A",), 1.5, 2.5, 0.0, 1.0, Mode.GUIDED, Failsafe.NOMINAL, None, (),
        commands_done,
    )  # fmt: skip


@given(
    moments=st.lists(st.tuples(st.integers(0, 40), st.integers(0, 24)), max_size=30),
    at=st.integers(0, 40),
)
def test_a_picture_made_from_the_index_is_that_of_everything_before(
    moments: list[tuple[int, int]], at: int
) -> None:
    happenings = [
        ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST),
        GoalEntry(("at:B",), GoalChange.SET, 2.0, GoalSource.OPERATOR),
        GoalEntry(("at:B",), GoalChange.REACHED, 2.0, GoalSource.OPERATOR),
        Proposal(1, 0, ("at:B",), "N", ()),
        ProposalEnded(1, "vetoed by the operator"),
        ActionEnded("E", 4.0, blocked=True),
        Pose(1.5, 2.5, 0.0, 0.0, "at:A", 1.0),
        Cycle((), (), (), 0, 0, 0, 1, 0, 0.0),
        LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT),
        Silence(silent=True),
        command_sent(1, Drive("E"), due_s={CommandStage.BEGUN: 3.0, CommandStage.DONE: 6.0}),
        command_sent(2, Drive("N"), due_s={CommandStage.BEGUN: 6.0, CommandStage.DONE: 9.0}),
        said_of(1, take_back=TakeBackChance.SURE, until_s=2.0),
        said_of(1, CommandStage.BEGUN, Verdict.OVERDUE, due_s=4.0),
        said_of(1, CommandStage.BEGUN, Verdict.ON_TIME, due_s=4.0, so_s=3.0),
        said_of(1, CommandStage.DONE, Verdict.LATE, due_s=7.0, so_s=9.0),
        said_of(2, CommandStage.DONE, Verdict.LATE, due_s=10.0, so_s=12.0),
        telemetry_of(5.0, 0),
        telemetry_of(3.0, 2),
        HeldEntry(1, (Drive("E"),), HeldFate.HELD),
        HeldEntry(1, (Drive("E"),), HeldFate.RELEASED, (3,)),
        BeliefEntry(stale=(BeliefItem.PLACE,)),
        Prediction(0, 0, (Likely(("at:A",), 0.9),), 0.1),
        ShadowEntry(
            2, 1, in_step=False, why="update 3 is missing", signs=1, hypotheses=0, cycles=0
        ),
        OperatorEntry(1, 2, None, ("goal A: nothing was proposed",)),
    ]
    assert len(happenings) == 25
    records = records_of((t_s, happenings[which]) for t_s, which in sorted(moments))
    everything = Picture()
    for record in records:
        if record.log_time_ns <= to_ns(at):
            everything.apply(LogEntry.of(record))

    everything.settle(to_ns(at))

    with log_of(records) as log:
        assert picture_at(log, to_ns(at)) == everything


# --- a whole run ---------------------------------------------------------------------------------

TIMES_S = (0.0, 0.3, 59.0, 60.0, 61.5, 130.0, 333.3, 620.0, 623.0, 690.0, 762.0, 840.5, 1199.0)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A past of one minute, so that there is a long time before it."""
    monkeypatch.setattr(picture, "RECENT_NS", to_ns(60))


def played(log: LogFile, times_s: Sequence[float]) -> list[Picture]:
    """The pictures at times in order, by applying all from the beginning."""
    state, pictures = Picture(as_ground=log.is_as_ground), []
    records = iter([*log.records(PICTURE_TOPICS)])
    coming = next(records)
    for time_ns in map(to_ns, times_s):
        while coming.log_time_ns <= time_ns:
            state.apply(LogEntry.of(coming))
            coming = next(records)
        pictures.append(state.copy())
        pictures[-1].settle(time_ns)
        pictures[-1].chart = None  # two charts are never equal
    return pictures


@pytest.mark.parametrize("as_ground", [False, True])
def test_a_picture_sought_is_the_picture_played(
    flown: LogFile, short: None, as_ground: bool
) -> None:
    log = flown.as_ground() if as_ground else flown
    for time_s, expected in zip(TIMES_S, played(log, TIMES_S), strict=True):
        sought = picture_at(log, to_ns(time_s))
        assert sought.chart is not None
        sought.chart = None
        assert sought == expected, time_s


@pytest.mark.parametrize("step", [1, -1], ids=["forwards", "backwards"])
def test_it_is_the_same_from_what_was_kept_on_the_way(
    flown: LogFile, short: None, step: int
) -> None:
    moments = Moments(flown)
    order = list(zip(TIMES_S, played(flown, TIMES_S), strict=True))[::step]
    for time_s, expected in (*order, *order):
        sought = moments.at(to_ns(time_s))
        sought.chart = None
        assert sought == expected, time_s
        sought.settle(to_ns(5000))  # which is for the caller to do


def test_the_events_about_a_time_are_found(flown: LogFile) -> None:
    state, lines = Picture(), list[EventLine]()
    for record in flown.records(PICTURE_TOPICS):
        line = state.apply(LogEntry.of(record))
        if line is not None and not line.routine:
            lines.append(line)
    assert len(lines) > 30
    moments, times_ns = Moments(flown), [line.t_ns for line in lines]

    for time_ns in (0, to_ns(59.0), times_ns[20], to_ns(690.0), flown.end_ns):
        after = bisect_right(times_ns, time_ns)
        before = bisect_right(times_ns, time_ns - 1) - 1
        assert moments.next_event(time_ns) == (lines[after] if after < len(lines) else None)
        assert moments.previous_event(time_ns) == (lines[before] if before >= 0 else None)


def test_a_seek_reads_no_more_than_what_is_recent_however_long_the_run(flown: LogFile) -> None:
    day = Repeated(flown, 72)

    picture_at(day, day.end_ns // 3)

    assert day.read < 12_000


class Repeated:
    """A log over and over, which counts the records that are read of it."""

    is_as_ground = False

    def __init__(self, log: LogFile, times: int) -> None:
        self._log, self.read = log, 0
        self.end_ns = self.there_until_ns = times * log.end_ns

    def records(
        self, topics: Collection[Topic[Any]] | None = None, *, start_ns: int = 0, end_ns: int = 0
    ) -> Iterator[Record]:
        """See `LogFile.records`."""
        length_ns = self._log.end_ns + 1
        for turn in range(max(start_ns, 0) // length_ns, end_ns // length_ns + 1):
            since_ns = turn * length_ns
            for record in self._log.records(
                topics, start_ns=start_ns - since_ns, end_ns=end_ns - since_ns
            ):
                self.read += 1
                yield msgspec.structs.replace(record, log_time_ns=record.log_time_ns + since_ns)
