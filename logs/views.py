"""Queries on a finished run: modes, goals, commands, frames and outages."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, TypeVar, cast

import msgspec

from farside.logs.reading import LogFile, decode
from farside.messages import Failsafe, Mode, ModeCause, Tokens
from farside.node import Direction, Topic, to_ns, to_s
from farside.places import Chart, is_place_token
from farside.topics import (
    GROUND_COMMAND,
    GROUND_FRAME,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_FAILSAFE,
    ROVER_FRAME,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STORE,
    TRUTH_POSE,
    TRUTH_YARD,
    CommandSent,
    CommandTaken,
    Cycle,
    Fate,
    FrameFate,
    FrameStage,
    GoalChange,
    GoalSource,
    StoreEntry,
)

T = TypeVar("T", bound=msgspec.Struct)


class ModeSpan(NamedTuple):
    """The rover was in `mode` from `t_s` until the next span; `why` is the cause of the change."""

    t_s: float
    mode: Mode
    why: ModeCause


class OutageSpan(NamedTuple):
    """One direction was down from `start_s` to `end_s`, or to the end of the run."""

    direction: Direction
    start_s: float
    end_s: float


class GoalSpan(NamedTuple):
    """A goal from being set to leaving the Goal List, or to the end of the run.

    Attributes:
        tokens: its Sign.
        source: who set it.
        set_s: when it was added to the Goal List.
        reached_s: when it was reached; `None` if it was not, or if only the estimate said so.
        withdrawn_s: when it was withdrawn; `None` if it was not.
    """

    tokens: Tokens
    source: GoalSource
    set_s: float
    reached_s: float | None = None
    withdrawn_s: float | None = None


class LinkCounters(msgspec.Struct, frozen=True):
    """Counts of the frames of one direction whose fate was decided within the run.

    Attributes:
        sent: frames handed to the channel; the sum of the next six.
        delivered, lost, outage, queue_full, expired, bit_error: frames with each `Fate`.
        duplicated: frames that arrived twice.
        damaged: frames that arrived with bit errors.
        refused: frames that the receiver refused as not genuine or not new.
        shadowed: frames lost to terrain shadow, at the rover.
        bytes: total payload of the frames sent, in bytes.
        delay_s: mean time from sender to arrival, queueing included; `None` if none arrived.
    """

    sent: int
    delivered: int
    lost: int
    outage: int
    queue_full: int
    expired: int
    bit_error: int
    duplicated: int
    damaged: int
    refused: int
    shadowed: int
    bytes: int
    delay_s: float | None


class RunView:
    """Queries on a run, answered from its log. All times are simulated seconds.

    A query reads what it is about through the log's index, and nothing is kept: a run may be
    larger than memory.

    Args:
        log: the log.
    """

    def __init__(self, log: LogFile) -> None:
        self._log = log

    @classmethod
    def of_log(cls, path: Path) -> "RunView":
        """A view of the run in a log.

        Raises:
            LogError: if the log cannot be read.
        """
        return RunView(LogFile(path))

    @property
    def duration_s(self) -> float:
        """Log time of the last record; 0 if there is none."""
        return to_s(self._log.end_ns)

    def entries(self, topic: Topic[T]) -> tuple[tuple[float, T], ...]:
        """All messages of a topic in log order, each with its log time.

        Raises:
            LogError: if a message cannot be decoded.
        """
        return tuple(self.each(topic))

    def each(self, topic: Topic[T]) -> Iterator[tuple[float, T]]:
        """`entries` one by one, for topics that may be larger than memory."""
        for record in self._log.records([topic]):
            yield to_s(record.log_time_ns), cast("T", decode(record))

    # --- state at a time -----------------------------------------------------------------------

    def mode_at(self, t_s: float) -> Mode:
        """The rover's mode at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._latest(ROVER_MODE, t_s).mode

    def failsafe_at(self, t_s: float) -> Failsafe:
        """The failsafe's state at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._latest(ROVER_FAILSAFE, t_s).state

    def place_at(self, t_s: float) -> str:
        """The Token of the rover's true place at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._latest(TRUTH_POSE, t_s).place

    def _latest(self, topic: Topic[T], t_s: float) -> T:
        if not 0 <= t_s <= self.duration_s:
            raise ValueError(
                f"expected a time within the run, 0 to {self.duration_s} s, found {t_s} s"
            )
        record = self._log.latest(topic, to_ns(t_s))
        if record is None:
            raise ValueError(f"expected a {topic.name} message at {t_s} s or before, found none")
        return cast("T", decode(record))

    # --- modes, goals, commands and the DEM ----------------------------------------------------

    @property
    def modes(self) -> tuple[ModeSpan, ...]:
        """The rover's modes in order, from the start of the run."""
        return tuple(
            ModeSpan(t_s, entry.mode, entry.why) for t_s, entry in self.entries(ROVER_MODE)
        )

    def reached(self, token: str | Sequence[str]) -> float | None:
        """When a Sign was first reached as a goal; `None` if it never was.

        A goal that names a place counts only if the rover was truly there, whatever it estimated.

        Args:
            token: the Sign's only Token, or all its Tokens in any order.

        Raises:
            ValueError: if a Token names a place that is not on the map.
        """
        sign = (token,) if isinstance(token, str) else tuple(sorted(token))
        self._check_places(sign)
        times = (goal.reached_s for goal in self.goals if goal.tokens == sign)
        return next((t_s for t_s in times if t_s is not None), None)

    def _check_places(self, sign: Tokens) -> None:
        yard = self._latest(TRUTH_YARD, 0)
        places = Chart(yard.rows, yard.cell_m).cells
        for token in sign:
            if is_place_token(token) and token not in places:
                named = ", ".join(sorted(place for place in places if "," not in place))
                raise ValueError(f"expected a place on the map, such as {named}, found {token}")

    @cached_property
    def goals(self) -> tuple[GoalSpan, ...]:
        """Every goal in the order in which it was set; one span per source if several set it."""
        spans: list[GoalSpan] = []
        listed: dict[tuple[Tokens, GoalSource], int] = {}
        for t_s, entry in self.each(ROVER_GOAL):
            key = entry.tokens, entry.source
            if key not in listed:
                listed[key] = len(spans)
                spans.append(GoalSpan(entry.tokens, entry.source, t_s))
            if entry.change is GoalChange.SET:
                continue
            index = listed.pop(key)
            if entry.change is GoalChange.WITHDRAWN:
                spans[index] = spans[index]._replace(withdrawn_s=t_s)
            elif self._was_true(entry.tokens, t_s):
                spans[index] = spans[index]._replace(reached_s=t_s)
        return tuple(spans)

    def _was_true(self, sign: Tokens, t_s: float) -> bool:
        places = [token for token in sign if is_place_token(token)]
        return not places or places == [self.place_at(t_s)]

    @property
    def commands_sent(self) -> tuple[tuple[float, CommandSent], ...]:
        """Every command that the ground sent, with its log time."""
        return self.entries(GROUND_COMMAND)

    @property
    def commands_taken(self) -> tuple[tuple[float, CommandTaken], ...]:
        """Every command that the rover received, obeyed or refused, with its log time."""
        return self.entries(ROVER_COMMAND)

    @property
    def dem(self) -> Cycle | None:
        """The DEM's last cycle, which gives the sizes of its lists; `None` if there was none."""
        record = self._log.latest(ROVER_CYCLE, self._log.end_ns)
        return None if record is None else cast("Cycle", decode(record))

    @property
    def store(self) -> StoreEntry:
        """What became of the telemetry that the rover stored while the link was out."""
        record = self._log.latest(ROVER_STORE, self._log.end_ns)
        return StoreEntry(0, 0, 0) if record is None else cast("StoreEntry", decode(record))

    # --- the link ------------------------------------------------------------------------------

    def frames(
        self,
        direction: Direction | str | None = None,
        fate: Fate | str | None = None,
        delivered_between: tuple[float, float] | None = None,
    ) -> tuple[FrameFate, ...]:
        """The frames that match all given filters, in log order.

        Args:
            direction: `up` or `down`.
            fate: such as `delivered` or `lost`.
            delivered_between: frames that arrived at or after the first time and before the second.

        Raises:
            ValueError: if `delivered_between` ends before it starts, or the direction or fate does
                not exist.
        """
        return tuple(self.each_frame(direction, fate, delivered_between))

    def each_frame(
        self,
        direction: Direction | str | None = None,
        fate: Fate | str | None = None,
        delivered_between: tuple[float, float] | None = None,
    ) -> Iterator[FrameFate]:
        """`frames`, one by one."""
        way = None if direction is None else Direction(direction)
        end = None if fate is None else Fate(fate)
        start_s, end_s = delivered_between or (0.0, 0.0)
        if start_s > end_s:
            raise ValueError(
                f"expected delivered_between to end after it starts, found {start_s} s to {end_s} s"
            )
        for _, frame in self.each(LINK_FRAME):
            if way not in {None, frame.direction} or end not in {None, frame.fate}:
                continue
            if delivered_between is None or (
                frame.arrival_ns is not None and start_s <= to_s(frame.arrival_ns) < end_s
            ):
                yield frame

    def link_counters(self, direction: Direction) -> LinkCounters:
        """Counts of the frames of one direction."""
        return self._counters[direction]

    @cached_property
    def _counters(self) -> dict[Direction, LinkCounters]:
        tallies = {direction: _Tally() for direction in Direction}
        for frame in self.each_frame():
            tallies[frame.direction].add(frame)
        for end in (ROVER_FRAME, GROUND_FRAME):
            for _, event in self.each(end):
                tallies[event.direction].stages[event.stage] += 1
        return {direction: tally.counters() for direction, tally in tallies.items()}

    @property
    def outages(self) -> tuple[OutageSpan, ...]:
        """Every outage in order of its start; of two that start together, the uplink's first."""
        started: dict[Direction, float] = {}
        outages = []
        for t_s, entry in self.each(LINK_OUTAGE):
            if entry.down:
                started.setdefault(entry.direction, t_s)
            elif entry.direction in started:
                start_s = started.pop(entry.direction)
                outages.append(OutageSpan(entry.direction, start_s, t_s))
        outages += [
            OutageSpan(direction, start_s, self.duration_s)
            for direction, start_s in started.items()
        ]
        return tuple(sorted(outages, key=lambda outage: (outage.start_s, outage.direction != "up")))


class _Tally:
    """Counts the frames of one direction."""

    def __init__(self) -> None:
        self.stages: Counter[FrameStage] = Counter()
        self._fates: Counter[Fate] = Counter()
        self._sent = self._duplicated = self._damaged = self._bytes = self._delay_ns = 0

    def add(self, frame: FrameFate) -> None:
        if frame.copy:
            self._duplicated += frame.copy if frame.fate is Fate.DELIVERED else 0
            return
        self._sent += 1
        self._fates[frame.fate] += 1
        self._damaged += frame.flipped_bits > 0
        self._bytes += frame.size_byte
        if frame.arrival_ns is not None:
            self._delay_ns += frame.arrival_ns - frame.queued_ns

    def counters(self) -> LinkCounters:
        fates = self._fates
        delivered = fates[Fate.DELIVERED]
        return LinkCounters(
            sent=self._sent,
            delivered=delivered,
            lost=fates[Fate.LOST],
            outage=fates[Fate.OUTAGE],
            queue_full=fates[Fate.QUEUE_FULL],
            expired=fates[Fate.EXPIRED],
            bit_error=fates[Fate.BIT_ERROR],
            duplicated=self._duplicated,
            damaged=self._damaged,
            refused=self.stages[FrameStage.REFUSED],
            shadowed=self.stages[FrameStage.SHADOWED],
            bytes=self._bytes,
            delay_s=to_s(self._delay_ns) / delivered if delivered else None,
        )
