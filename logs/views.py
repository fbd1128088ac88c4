"""Asking a finished run: who drove when, what was reached, what became of every frame."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property
from operator import attrgetter
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
)

T = TypeVar("T", bound=msgspec.Struct)

_log_time_ns = attrgetter("log_time_ns")


class ModeSpan(NamedTuple):
    """From `t_s` until the next span, the rover was in `mode`."""

    t_s: float
    mode: Mode
    why: ModeCause


class OutageSpan(NamedTuple):
    """One direction was down from `start_s` until `end_s`, or until the run ended."""

    direction: Direction
    start_s: float
    end_s: float


class GoalStory(NamedTuple):
    """What became of a goal, from being set to leaving the Goal List.

    Attributes:
        tokens: its Sign.
        source: whose goal it was.
        set_s: when it came on the Goal List.
        reached_s: when it was reached, `None` if it was not, or if the rover only believed so.
        withdrawn_s: when it was withdrawn, `None` if it was not.
    """

    tokens: Tokens
    source: GoalSource
    set_s: float
    reached_s: float | None = None
    withdrawn_s: float | None = None


class LinkCounters(msgspec.Struct, frozen=True):
    """The frames of one direction whose fate came about in the run.

    Attributes:
        sent: how many the sender handed over; the sum of the next six.
        delivered, lost, outage, queue_full, expired, bit_error: how many of them met each `Fate`.
        duplicated: how many arrived a second time.
        damaged: how many arrived with bits flipped.
        refused: how many arrived and were not taken for what the other end sent, or not again.
        shadowed: how many were lost in terrain shadow, at the rover.
        bytes: payload of all that were handed over.
        delay_s: mean time from handing over to arrival, `None` if none arrived.
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
    """Queries on a run, answered from its log. Times are in simulated seconds.

    Nothing is read before it is asked for, and only what the question is about.

    Args:
        log: the run's log.
    """

    def __init__(self, log: LogFile) -> None:
        self._log = log

    @classmethod
    def of_log(cls, path: Path) -> "RunView":
        """The run in a log.

        Raises:
            LogError: if the log cannot be read.
        """
        return RunView(LogFile(path))

    @property
    def duration_s(self) -> float:
        """When the last record was made."""
        return to_s(self._log.end_ns)

    def entries(self, topic: Topic[T]) -> tuple[tuple[float, T], ...]:
        """All messages of a topic, each with its log time in seconds."""
        return tuple(self.each(topic))

    def each(self, topic: Topic[T]) -> Iterator[tuple[float, T]]:
        """`entries`, one by one: a topic of a long run may be larger than memory."""
        for record in self._log.records([topic]):
            yield to_s(record.log_time_ns), cast("T", decode(record))

    # --- what was so at a time -----------------------------------------------------------------

    def mode_at(self, t_s: float) -> Mode:
        """The rover's mode.

        Raises:
            ValueError: if `t_s` is not within the run.
        """
        return self._latest(ROVER_MODE, t_s).mode

    def failsafe_at(self, t_s: float) -> Failsafe:
        """The state of the rover's failsafe.

        Raises:
            ValueError: if `t_s` is not within the run.
        """
        return self._latest(ROVER_FAILSAFE, t_s).state

    def place_at(self, t_s: float) -> str:
        """The Token of the place where the rover really was.

        Raises:
            ValueError: if `t_s` is not within the run.
        """
        return self._latest(TRUTH_POSE, t_s).place

    def _latest(self, topic: Topic[T], t_s: float) -> T:
        if not 0 <= t_s <= self.duration_s:
            raise ValueError(f"{t_s} s is not within the run, from 0 to {self.duration_s} s")
        record = self._log.latest(topic, to_ns(t_s))
        if record is None:
            raise ValueError(f"the run has no {topic.name} at {t_s} s or before")
        return cast("T", decode(record))

    # --- the whole story -----------------------------------------------------------------------

    @property
    def modes(self) -> tuple[ModeSpan, ...]:
        """Every mode that the rover was in, from the start."""
        return tuple(
            ModeSpan(t_s, entry.mode, entry.why) for t_s, entry in self.entries(ROVER_MODE)
        )

    def reached(self, token: str | Sequence[str]) -> float | None:
        """When a Sign was first reached as a goal, `None` if it never was.

        It does not count where the rover only believed to be at a place: the truth must agree.

        Args:
            token: the Sign's Token, or its Tokens in any order.

        Raises:
            ValueError: if it names a place that the map lacks.
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
                raise ValueError(f"the map has no place {token}; its named places are {named}")

    @cached_property
    def goals(self) -> tuple[GoalStory, ...]:
        """Every goal in the order in which they came on the Goal List, one for each who set it."""
        stories: list[GoalStory] = []
        listed: dict[tuple[Tokens, GoalSource], int] = {}
        for t_s, entry in self.each(ROVER_GOAL):
            wanted = entry.tokens, entry.source
            if wanted not in listed:
                listed[wanted] = len(stories)
                stories.append(GoalStory(entry.tokens, entry.source, t_s))
            if entry.change is GoalChange.SET:
                continue
            number = listed.pop(wanted)
            if entry.change is GoalChange.WITHDRAWN:
                stories[number] = stories[number]._replace(withdrawn_s=t_s)
            elif self._truly(entry.tokens, t_s):
                stories[number] = stories[number]._replace(reached_s=t_s)
        return tuple(stories)

    def _truly(self, sign: Tokens, t_s: float) -> bool:
        places = [token for token in sign if is_place_token(token)]
        return not places or places == [self.place_at(t_s)]

    @property
    def commands_sent(self) -> tuple[tuple[float, CommandSent], ...]:
        """Every command that the ground put on the uplink."""
        return self.entries(GROUND_COMMAND)

    @property
    def commands_taken(self) -> tuple[tuple[float, CommandTaken], ...]:
        """Every command that the rover took, obeyed or refused."""
        return self.entries(ROVER_COMMAND)

    @property
    def dem(self) -> Cycle | None:
        """The DEM's last cycle, with the sizes of its lists; `None` if it never had one."""
        record = self._log.latest(ROVER_CYCLE, self._log.end_ns)
        return None if record is None else cast("Cycle", decode(record))

    # --- the link ------------------------------------------------------------------------------

    def frames(
        self,
        direction: Direction | str | None = None,
        fate: Fate | str | None = None,
        delivered_between: tuple[float, float] | None = None,
    ) -> tuple[FrameFate, ...]:
        """The frames that meet all given conditions.

        Args:
            direction: they went this way, `up` or `down`.
            fate: they met this fate, such as `delivered` or `lost`.
            delivered_between: they arrived at or after the first time and before the second.

        Raises:
            ValueError: if `delivered_between` ends before it starts, or there is no such direction
                or fate.
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
                f"delivered_between ends at {end_s} s, before it starts at {start_s} s"
            )
        for _, frame in self.each(LINK_FRAME):
            if way not in {None, frame.direction} or end not in {None, frame.fate}:
                continue
            if delivered_between is None or (
                frame.arrival_ns is not None and start_s <= to_s(frame.arrival_ns) < end_s
            ):
                yield frame

    def link_counters(self, direction: Direction) -> LinkCounters:
        """Counts of the frames of one direction by fate."""
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
        """Every outage in the order in which they began, uplink first where both did at once."""
        began: dict[Direction, float] = {}
        outages = []
        for t_s, entry in self.each(LINK_OUTAGE):
            if entry.down:
                began.setdefault(entry.direction, t_s)
            elif entry.direction in began:
                start_s = began.pop(entry.direction)
                outages.append(OutageSpan(entry.direction, start_s, t_s))
        outages += [OutageSpan(way, start_s, self.duration_s) for way, start_s in began.items()]
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
