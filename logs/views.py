"""Queries on a finished run: modes, goals, commands, frames and outages."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec

from farside.control import BatteryState, CommandStage, Failsafe, Mode
from farside.frames import Fate, FrameFate, OutageReason
from farside.logs.file.reading import LogFile, decode
from farside.logs.names import member_of
from farside.logs.spans import (
    GoalSpan,
    LeastCharge,
    LinkCounters,
    LinkTally,
    ModeSpan,
    OperatorSpan,
    OutageSpan,
    ShadowPrice,
    ShadowTally,
)
from farside.messages import Telemetry, Tokens
from farside.node import Direction, Topic, to_ns, to_s
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
    GROUND_SHADOW,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_FAILSAFE,
    ROVER_FRAME,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_MODEL,
    ROVER_STORE,
    ROVER_STUCK,
    TOPICS,
    TRUTH_POSE,
    TRUTH_YARD,
    CommandEntry,
    CommandSent,
    Cycle,
    GoalChange,
    GoalSource,
    StoreEntry,
)
from farside.validation import did_you_mean, shown

T = TypeVar("T", bound=msgspec.Struct)


class RunView:
    """Queries on a run, answered from its log. All times are simulated seconds.

    A query reads what it is about through the log's index. Only the map, the goals and the counts
    of frames are kept once they were asked for: a run may be larger than memory.

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
            ValueError: if no log has such a topic. The message names the nearest one.
        """
        return tuple(self.each(topic))

    def each(self, topic: Topic[T]) -> Iterator[tuple[float, T]]:
        """`entries` one by one, for topics that may be larger than memory."""
        if topic.name not in TOPICS:
            hint = did_you_mean(topic.name, TOPICS)
            raise ValueError(f"expected a topic of the log, found {shown(topic.name)}{hint}")
        for record in self._log.records([topic]):
            yield to_s(record.log_time_ns), cast("T", decode(record))

    def together(self, *topics: Topic[Any]) -> Iterator[tuple[float, msgspec.Struct]]:
        """The messages of several topics in log order, one by one, each with its log time.

        Raises:
            LogError: if a message cannot be decoded.
        """
        for record in self._log.records(topics):
            yield to_s(record.log_time_ns), decode(record)

    @property
    def telemetry(self) -> tuple[tuple[float, Telemetry], ...]:
        """All telemetry in the order in which the ground received it, live and from the store."""
        heard = self.together(GROUND_TELEMETRY, GROUND_STORED_TELEMETRY)
        return tuple((t_s, cast("Telemetry", telemetry)) for t_s, telemetry in heard)

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
            token: the Sign's only Token, or all its Tokens in any order. The name of a place,
                such as `B`, stands for its Token, `at:B`.

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
    def goals(self) -> tuple[GoalSpan, ...]:
        """Every goal in the order in which it was set; one span per source if several set it."""
        spans: list[GoalSpan] = []
        listed: dict[tuple[Tokens, GoalSource], int] = {}
        for t_s, entry in self.each(ROVER_GOAL):
            key = entry.tokens, entry.source
            if entry.change is GoalChange.SET and key not in listed:
                listed[key] = len(spans)
                spans.append(GoalSpan(entry.tokens, entry.source, t_s))
            if entry.change not in {GoalChange.REACHED, GoalChange.WITHDRAWN}:
                continue
            index = listed.pop(key, None)
            if index is None:
                continue  # a mission goal can be withdrawn before it comes on the list
            if entry.change is GoalChange.WITHDRAWN:
                spans[index] = spans[index]._replace(withdrawn_s=t_s)
            elif self._was_true(entry.tokens, t_s):
                spans[index] = spans[index]._replace(reached_s=t_s)
        return tuple(spans)

    def _was_true(self, sign: Tokens, t_s: float) -> bool:
        places = [token for token in sign if is_place_token(token)]
        return not places or places == [self.place_at(t_s)]

    @property
    def least_charge(self) -> LeastCharge | None:
        """The least true state of charge, as sampled every second; `None` if it never was."""
        charges = (LeastCharge(t_s, pose.battery) for t_s, pose in self.each(TRUTH_POSE))
        return min(charges, key=lambda least: least.charge, default=None)

    @property
    def flat_since_s(self) -> float | None:
        """Since when the battery has been flat, `None` if it is not at the end of the run."""
        last = self._last(ROVER_BATTERY)
        return last[0] if last is not None and last[1].state is BatteryState.FLAT else None

    @property
    def stuck_since_s(self) -> float | None:
        """Since when the rover has been stuck, `None` if it is not at the end of the run."""
        last = self._last(ROVER_STUCK)
        return last[0] if last is not None and last[1].stuck else None

    @property
    def operator(self) -> OperatorSpan | None:
        """Where the operator got to, `None` if there was no script."""
        last = self._last(GROUND_OPERATOR)
        if last is None:
            return None
        t_s, operator = last
        return OperatorSpan(t_s, operator.step, operator.of, operator.waiting_for, operator.left)

    def _last(self, topic: Topic[T]) -> tuple[float, T] | None:
        """The last message of a topic, with its log time in seconds; `None` if there is none."""
        record = self._log.latest(topic, self._log.end_ns)
        return None if record is None else (to_s(record.log_time_ns), cast("T", decode(record)))

    @property
    def commands_sent(self) -> tuple[tuple[float, CommandSent], ...]:
        """Every command that the ground sent, with its log time."""
        return self.entries(GROUND_COMMAND)

    @property
    def commands_taken(self) -> tuple[tuple[float, CommandEntry], ...]:
        """Every command that the rover received, obeyed or not, with its log time."""
        return tuple(
            (t_s, entry) for t_s, entry in self.command_stages if entry.stage is CommandStage.TAKEN
        )

    @property
    def command_stages(self) -> tuple[tuple[float, CommandEntry], ...]:
        """Every stage of every command on board, with its log time."""
        return self.entries(ROVER_COMMAND)

    @property
    def dem(self) -> Cycle | None:
        """The DEM's last cycle, which gives the sizes of its lists; `None` if there was none."""
        last = self._last(ROVER_CYCLE)
        return None if last is None else last[1]

    @property
    def store(self) -> StoreEntry:
        """What became of the telemetry that the rover stored while the link was out."""
        last = self._last(ROVER_STORE)
        return StoreEntry(0, 0, 0) if last is None else last[1]

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
        way = None if direction is None else member_of("direction", direction, Direction)
        end = None if fate is None else member_of("fate", fate, Fate)
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
        return self._counters[0][direction]

    @property
    def shadow(self) -> ShadowPrice | None:
        """What the shadow of the model took of the link; `None` if no update was made."""
        sent = [entry for _, entry in self.each(ROVER_MODEL)]
        if not sent:
            return None
        tally, last = self._counters[1], self._last(GROUND_SHADOW)
        return ShadowPrice(
            updates=len(sent),
            wholes=sum(update.whole for update in sent),
            cycles=sum(update.cycles for update in sent),
            downlink_byte=tally.downlink_byte,
            downlink_share=tally.downlink_byte / (tally.sent_byte or 1),
            report_byte=tally.report_byte,
            in_step=last is not None and last[1].in_step,
        )

    @cached_property
    def _counters(self) -> tuple[dict[Direction, LinkCounters], ShadowTally]:
        tallies, shadow = {direction: LinkTally() for direction in Direction}, ShadowTally()
        for frame in self.each_frame():
            tallies[frame.direction].add(frame)
        for end in (ROVER_FRAME, GROUND_FRAME):
            for _, event in self.each(end):
                tallies[event.direction].stages[event.stage] += 1
                shadow.add(event)
        return {direction: tally.counters() for direction, tally in tallies.items()}, shadow

    @property
    def outages(self) -> tuple[OutageSpan, ...]:
        """Every outage in order of its start; of two that start together, the uplink's first."""
        started: dict[Direction, tuple[float, OutageReason]] = {}
        outages = []
        for t_s, entry in self.each(LINK_OUTAGE):
            if entry.down:
                started.setdefault(entry.direction, (t_s, entry.reason))
            elif entry.direction in started:
                start_s, reason = started.pop(entry.direction)
                outages.append(OutageSpan(entry.direction, start_s, t_s, reason))
        outages += [
            OutageSpan(direction, start_s, self.duration_s, reason)
            for direction, (start_s, reason) in started.items()
        ]
        return tuple(sorted(outages, key=lambda outage: (outage.start_s, outage.direction != "up")))
