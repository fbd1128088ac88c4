"""Queries on the link: frames, outages, and what came through."""

from collections.abc import Iterator
from functools import cached_property
from typing import cast

from farside.frames import Fate, FrameEvent, FrameFate, OutageReason
from farside.logs.names import member_of
from farside.logs.spans import (
    LinkCounters,
    LinkTally,
    OutageSpan,
    ShadowPrice,
    ShadowTally,
)
from farside.logs.views.topics import TopicView
from farside.messages import Telemetry
from farside.node import Direction, to_s
from farside.topics import (
    GROUND_FRAME,
    GROUND_SHADOW,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_FRAME,
    ROVER_MODEL,
    ROVER_STORE,
    StoreEntry,
)


class LinkView(TopicView):
    """What became of frames and telemetry. The counts are kept once they were asked for."""

    @property
    def telemetry(self) -> tuple[tuple[float, Telemetry], ...]:
        """All telemetry in the order in which the ground received it, live and from the store."""
        heard = self.together(GROUND_TELEMETRY, GROUND_STORED_TELEMETRY)
        return tuple((t_s, cast("Telemetry", telemetry)) for t_s, telemetry in heard)

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
        for _, entry in self.together(LINK_FRAME, ROVER_FRAME, GROUND_FRAME):
            if isinstance(entry, FrameFate):
                tallies[entry.direction].add(entry)
            elif isinstance(entry, FrameEvent):
                tallies[entry.direction].stages[entry.stage] += 1
                shadow.add(entry)
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

    @property
    def store(self) -> StoreEntry:
        """What became of the telemetry that the rover stored while the link was out."""
        last = self._last(ROVER_STORE)
        return StoreEntry(0, 0, 0) if last is None else last[1]
