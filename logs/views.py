"""Asking a finished run: who drove when, what was reached, what became of every frame."""

from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from statistics import fmean
from typing import NamedTuple, Self, TypeVar, cast

import msgspec

from farside.logs.reading import LogFile, decode
from farside.messages import BatteryState, Failsafe, Mode, ModeCause, Tokens
from farside.node import Direction, Record, Topic, to_ns, to_s
from farside.places import (
    BATTERY_LOW,
    ON_CHARGE,
    Chart,
    is_place_token,
    place_name,
    place_token,
)
from farside.topics import (
    GROUND_COMMAND,
    GROUND_FRAME,
    GROUND_OPERATOR,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_FAILSAFE,
    ROVER_FRAME,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STUCK,
    TOPICS,
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
from farside.validation import did_you_mean, shown

T = TypeVar("T", bound=msgspec.Struct)
E = TypeVar("E", bound=StrEnum)

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


class OperatorSpan(NamedTuple):
    """From `t_s` on, the operator was at `step` of `of` and waited; see `OperatorEntry`."""

    t_s: float
    step: int
    of: int
    waiting_for: str | None


class LeastCharge(NamedTuple):
    """The least state of charge in a run, 0 to 1, and when the battery first had it."""

    t_s: float
    charge: float


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
    """A run to ask, made from its records as they were logged. Times are in simulated seconds.

    Nothing is decoded before it is asked for.

    Args:
        records: all records of the run in the order of the log.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        self._records: defaultdict[str, list[Record]] = defaultdict(list)
        self._decoded: dict[str, tuple[tuple[float, msgspec.Struct], ...]] = {}
        self._end_ns = 0
        for record in records:
            self._records[record.topic].append(record)
            self._end_ns = record.log_time_ns

    @classmethod
    def of_log(cls, path: Path) -> Self:
        """The run in a log.

        Raises:
            LogError: if the log cannot be read.
        """
        return cls(LogFile(path).records())

    @property
    def duration_s(self) -> float:
        """When the last record was made."""
        return to_s(self._end_ns)

    def entries(self, topic: Topic[T]) -> tuple[tuple[float, T], ...]:
        """All messages of a topic, each with its log time in seconds.

        Raises:
            ValueError: if no log has such a topic. The message names the nearest one.
        """
        if topic.name not in TOPICS:
            hint = did_you_mean(topic.name, TOPICS)
            raise ValueError(f"expected a topic of the log, found {shown(topic.name)}{hint}")
        if topic.name not in self._decoded:
            self._decoded[topic.name] = tuple(
                (to_s(record.log_time_ns), decode(record)) for record in self._records[topic.name]
            )
        return cast("tuple[tuple[float, T], ...]", self._decoded[topic.name])

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
        records = self._records[topic.name]
        known = bisect_right(records, to_ns(t_s), key=_log_time_ns)
        if not known:
            raise ValueError(f"the run has no {topic.name} at {t_s} s or before")
        return cast("T", decode(records[known - 1]))

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
            token: the Sign's Token, or its Tokens in any order. The name of a place, such as `B`,
                stands for its Token, `at:B`.

        Raises:
            ValueError: if there is no Token, or one is neither a place of the map nor any that the
                rover senses or anybody set as a goal. The message names the nearest one.
        """
        named = (token,) if isinstance(token, str) else tuple(token)
        sign = tuple(sorted({self._token(name) for name in named}))
        if not sign:
            raise ValueError("expected one Token at least, found none")
        times = (goal.reached_s for goal in self.goals if goal.tokens == sign)
        return next((t_s for t_s in times if t_s is not None), None)

    def _token(self, name: str) -> str:
        """The Token of this name, or of the place of this name."""
        wanted = {token for goal in self.goals for token in goal.tokens}
        tokens = wanted.union((ON_CHARGE, BATTERY_LOW))
        if name in tokens or name in self._chart.cells:
            return name
        if name in self._chart.places:
            return place_token(name)
        hint = self._chart.like(place_name(name))
        if not hint and not is_place_token(name):
            hint = did_you_mean(name, sorted(tokens))
        known = ", ".join(self._chart.named)
        raise ValueError(
            f"expected a place of the map ({known} or EAST,NORTH) or a Token such as {ON_CHARGE}, "
            f"found {shown(name)}{hint}"
        )

    @cached_property
    def _chart(self) -> Chart:
        yard = self._latest(TRUTH_YARD, 0)
        return Chart(yard.rows, yard.cell_m)

    @cached_property
    def goals(self) -> tuple[GoalStory, ...]:
        """Every goal in the order in which they came on the Goal List, one for each who set it."""
        stories: list[GoalStory] = []
        listed: dict[tuple[Tokens, GoalSource], int] = {}
        for t_s, entry in self.entries(ROVER_GOAL):
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
    def least_charge(self) -> LeastCharge | None:
        """The least true state of charge, as sampled every second; `None` if it never was."""
        charges = (LeastCharge(t_s, pose.battery) for t_s, pose in self.entries(TRUTH_POSE))
        return min(charges, key=lambda least: least.charge, default=None)

    @property
    def flat_since_s(self) -> float | None:
        """Since when the battery has been flat, `None` if it is not at the end of the run."""
        t_s, last = next(reversed(self.entries(ROVER_BATTERY)), (0.0, None))
        return t_s if last and last.state is BatteryState.FLAT else None

    @property
    def stuck_since_s(self) -> float | None:
        """Since when the rover has been stuck, `None` if it is not at the end of the run."""
        t_s, last = next(reversed(self.entries(ROVER_STUCK)), (0.0, None))
        return t_s if last and last.stuck else None

    @property
    def operator(self) -> OperatorSpan | None:
        """Where the operator got to, `None` if there was no script."""
        t_s, last = next(reversed(self.entries(GROUND_OPERATOR)), (0.0, None))
        return OperatorSpan(t_s, last.step, last.of, last.waiting_for) if last else None

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
        records = self._records[ROVER_CYCLE.name]
        return cast("Cycle", decode(records[-1])) if records else None

    # --- the link ------------------------------------------------------------------------------

    def frames(
        self,
        direction: Direction | str | None = None,
        fate: Fate | str | None = None,
        delivered_between: tuple[float, float] | None = None,
    ) -> tuple[FrameFate, ...]:
        """The frames of which all that is given is so.

        Args:
            direction: they went this way, `up` or `down`.
            fate: this became of them, such as `delivered` or `lost`.
            delivered_between: they arrived at or after the first time and before the second.

        Raises:
            ValueError: if `delivered_between` ends before it starts, or there is no such direction
                or fate.
        """
        frames = [frame for _, frame in self.entries(LINK_FRAME)]
        if direction is not None:
            way = _member("direction", direction, Direction)
            frames = [frame for frame in frames if frame.direction is way]
        if fate is not None:
            end = _member("fate", fate, Fate)
            frames = [frame for frame in frames if frame.fate is end]
        if delivered_between is not None:
            frames = list(_arrived_between(frames, *delivered_between))
        return tuple(frames)

    def link_counters(self, direction: Direction) -> LinkCounters:
        """How the frames of one direction fared."""
        frames = [frame for frame in self.frames(direction) if not frame.copy]
        fates = Counter(frame.fate for frame in frames)
        delays_s = [
            to_s(frame.arrival_ns - frame.queued_ns)
            for frame in frames
            if frame.arrival_ns is not None
        ]
        return LinkCounters(
            sent=len(frames),
            delivered=fates[Fate.DELIVERED],
            lost=fates[Fate.LOST],
            outage=fates[Fate.OUTAGE],
            queue_full=fates[Fate.QUEUE_FULL],
            expired=fates[Fate.EXPIRED],
            bit_error=fates[Fate.BIT_ERROR],
            duplicated=sum(frame.copy for frame in self.frames(direction, Fate.DELIVERED)),
            damaged=sum(frame.flipped_bits > 0 for frame in frames),
            refused=self._count(direction, FrameStage.REFUSED),
            shadowed=self._count(direction, FrameStage.SHADOWED),
            bytes=sum(frame.size_byte for frame in frames),
            delay_s=fmean(delays_s) if delays_s else None,
        )

    def _count(self, direction: Direction, stage: FrameStage) -> int:
        return sum(
            event.direction is direction and event.stage is stage
            for end in (ROVER_FRAME, GROUND_FRAME)
            for _, event in self.entries(end)
        )

    @property
    def outages(self) -> tuple[OutageSpan, ...]:
        """Every outage in the order in which they began, uplink first where both did at once."""
        began: dict[Direction, float] = {}
        outages = []
        for t_s, entry in self.entries(LINK_OUTAGE):
            if entry.down:
                began.setdefault(entry.direction, t_s)
            elif entry.direction in began:
                start_s = began.pop(entry.direction)
                outages.append(OutageSpan(entry.direction, start_s, t_s))
        outages += [OutageSpan(way, start_s, self.duration_s) for way, start_s in began.items()]
        return tuple(sorted(outages, key=lambda outage: (outage.start_s, outage.direction != "up")))


def _member(what: str, name: str, kind: type[E]) -> E:
    """The member of an enumeration with this value.

    Raises:
        ValueError: if there is none. The message names the nearest one.
    """
    if name in (known := [member.value for member in kind]):
        return kind(name)
    raise ValueError(
        f"expected the {what} to be one of {', '.join(known)}, found {shown(name)}"
        f"{did_you_mean(name, known)}"
    )


def _arrived_between(
    frames: Iterable[FrameFate], start_s: float, end_s: float
) -> Iterator[FrameFate]:
    if start_s > end_s:
        raise ValueError(f"delivered_between ends at {end_s} s, before it starts at {start_s} s")
    for frame in frames:
        if frame.arrival_ns is not None and start_s <= to_s(frame.arrival_ns) < end_s:
            yield frame
