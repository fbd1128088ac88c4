"""The channel: what the link does to frames, decided from the frames and their times alone."""

import heapq
from collections.abc import Mapping, Sequence

from numpy.random import Generator

from farside.link.config import Blackout, LinkConfig, OneWay
from farside.link.node import NS_PER_S, Direction, Frame, Step, to_ns
from farside.link.records import Fate, FrameFate, Journal, LinkOutage


class _Way:
    """One direction: a queue, a transmitter, a distance, and the outages at the rover's end."""

    def __init__(
        self,
        direction: Direction,
        config: OneWay,
        outages: Sequence[tuple[int, int]],
        rng: Generator,
    ) -> None:
        self._direction = direction
        self._config = config
        self._delay_ns = to_ns(config.delay_s)
        self._outages = outages
        self._rng = rng
        self._busy_until_ns = 0

    def pass_on(self, frame: Frame) -> FrameFate:
        """Decide what becomes of the next frame of this direction."""
        lost = self._rng.random() < self._config.loss
        size_byte = len(frame.payload)
        start_ns = max(frame.time_ns, self._busy_until_ns)
        if self._waiting_byte(frame.time_ns) + size_byte > self._config.queue_byte:
            return self._fate(frame, (frame.time_ns, frame.time_ns), None, Fate.QUEUE_FULL)
        end_ns = self._busy_until_ns = start_ns + self._serialisation_ns(size_byte)
        arrival_ns = end_ns + self._delay_ns
        if self._is_out(start_ns, end_ns, arrival_ns):
            return self._fate(frame, (start_ns, end_ns), None, Fate.OUTAGE)
        if lost:
            return self._fate(frame, (start_ns, end_ns), None, Fate.LOST)
        return self._fate(frame, (start_ns, end_ns), arrival_ns, Fate.DELIVERED)

    def decided_ns(self, fate: FrameFate) -> int:
        """When a fate comes about: at the transmitter, or where the frame would have arrived."""
        if fate.fate is Fate.QUEUE_FULL:
            return fate.queued_ns
        if fate.fate is Fate.OUTAGE and self._direction is Direction.DOWN:
            return fate.sent_end_ns
        return fate.sent_end_ns + self._delay_ns

    def _waiting_byte(self, now_ns: int) -> float:
        if self._config.rate_bit_s is None:
            return 0
        backlog_ns = max(0, self._busy_until_ns - now_ns)
        return backlog_ns * self._config.rate_bit_s / (8 * NS_PER_S)

    def _serialisation_ns(self, size_byte: int) -> int:
        if self._config.rate_bit_s is None:
            return 0
        return -(-size_byte * 8 * NS_PER_S // self._config.rate_bit_s)

    def _is_out(self, start_ns: int, end_ns: int, arrival_ns: int) -> bool:
        # Outages are at the rover's end: what matters is when a frame is there.
        if self._direction is Direction.UP:
            start_ns = end_ns = arrival_ns
        return any(begin <= end_ns and start_ns < end for begin, end in self._outages)

    def _fate(
        self, frame: Frame, sent_ns: tuple[int, int], arrival_ns: int | None, fate: Fate
    ) -> FrameFate:
        return FrameFate(
            direction=frame.direction,
            sequence=frame.sequence,
            size_byte=len(frame.payload),
            queued_ns=frame.time_ns,
            sent_ns=sent_ns[0],
            sent_end_ns=sent_ns[1],
            arrival_ns=arrival_ns,
            fate=fate,
        )


class Channel:
    """The link between the two endpoints, as a `Node` whose arrivals are the frames sent into it.

    Each direction has a rate cap with a bounded queue in front of it (serialisation), then a
    propagation delay. Every frame is lost with a fixed probability of its own. A frame is lost to
    an outage if it is at the rover's end during one: an uplink frame when it would arrive, a
    downlink frame when any of it is sent. What already passed arrives.

    One random number is drawn for every frame in order of sending, needed or not, so that
    changing a rate or a blackout leaves the losses of all other frames as they were.
    """

    def __init__(self, config: LinkConfig, rngs: Mapping[Direction, Generator]) -> None:
        self._journal = Journal()
        self._now_ns = 0
        # (time, direction, sequence) is unique, so a heap never compares the entries themselves.
        self._pending: list[tuple[int, str, int, FrameFate | LinkOutage]] = []
        self._ways: dict[Direction, _Way] = {}
        for direction, one_way in ((Direction.UP, config.up), (Direction.DOWN, config.down)):
            outages = _merged(config.blackouts, direction)
            self._ways[direction] = _Way(direction, one_way, outages, rngs[direction])
            for begin_ns, end_ns in outages:
                self._plan(begin_ns, LinkOutage(direction, down=True, reason="blackout"))
                self._plan(end_ns, LinkOutage(direction, down=False, reason="blackout"))

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Take the frames sent up to `until_ns`; give back those that will arrive, at their time.

        Raises:
            ValueError: if a frame was sent before this window or after it.
        """
        delivered = []
        for frame in sorted(arrivals, key=_sending_order):
            if not self._now_ns <= frame.time_ns < until_ns:
                raise ValueError(
                    f"expected {frame.direction} frame {frame.sequence} to be sent in the window "
                    f"[{self._now_ns}, {until_ns}) ns, found {frame.time_ns} ns"
                )
            way = self._ways[frame.direction]
            fate = way.pass_on(frame)
            heapq.heappush(
                self._pending, (way.decided_ns(fate), frame.direction, frame.sequence, fate)
            )
            if fate.arrival_ns is not None:
                delivered.append(
                    Frame(frame.direction, frame.sequence, fate.arrival_ns, frame.payload)
                )
        while self._pending and self._pending[0][0] < until_ns:
            time_ns, _, _, entry = heapq.heappop(self._pending)
            self._journal.note(entry, time_ns)
        self._now_ns = until_ns
        return Step(delivered, self._journal.take())

    def _plan(self, time_ns: int, outage: LinkOutage) -> None:
        heapq.heappush(self._pending, (time_ns, outage.direction, -1, outage))


def _sending_order(frame: Frame) -> tuple[int, str, int]:
    return frame.time_ns, frame.direction, frame.sequence


def _merged(blackouts: Sequence[Blackout], direction: Direction) -> list[tuple[int, int]]:
    """The outages of one direction in order, those that touch or overlap made one."""
    merged: list[tuple[int, int]] = []
    spans = sorted(b.span_ns for b in blackouts if b.direction.includes(direction))
    for begin_ns, end_ns in spans:
        if merged and begin_ns <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], end_ns)
        else:
            merged.append((begin_ns, end_ns))
    return merged
