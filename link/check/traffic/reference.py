"""One direction of a link as its profile asks for it: settings over time, delays, outages."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from farside.link.check.lateness import greatest_ns, greatest_wait_ns
from farside.link.check.traffic.opportunities import TraceTimes
from farside.link.profile.config import AfterLast, AtEnd, LinkConfig, OneWay
from farside.link.profile.rate import OPPORTUNITY_BYTE
from farside.link.profile.schedule import outages_of
from farside.node import NS_PER_S, Direction, to_ns

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

FOREVER_NS = 1 << 60
"""Nothing is sent later: 36 years."""

MARGIN_NS = 1_000
"""What a probe keeps away from anything that might affect it."""

MOST_KINDS = 100
"""Of how many settings at most, spread evenly over all, each probe measures the effect."""


class Phase(NamedTuple):
    """A span of time in which a direction does not change.

    Attributes:
        begin_ns, end_ns: the span, in the sender's time.
        way: the settings of the direction, with all changes so far.
        rate_bit_s: its rate cap; `None` without one, or with a trace.
        trace: its delivery opportunities, where it has any.
        kind: a number that phases share which differ in nothing but their rate and time.
        rate_kind: a number that phases share which differ in nothing but their time.
        loss_start: a number that phases share in which the loss model runs on without a restart.
    """

    begin_ns: int
    end_ns: int
    way: OneWay
    rate_bit_s: int | None
    trace: TraceTimes | None
    kind: int
    rate_kind: int
    loss_start: int

    def busy_ns(self, size_byte: int, frames: int = 1) -> int:
        """The longest time that frames sent at once take until the last bit of all has left."""
        return self.sending_ns(size_byte, frames) + self.waits_ns(size_byte, frames)

    def waits_ns(self, size_byte: int, frames: int = 1) -> int:
        """The longest time of it that they wait for slots."""
        if self.way.slots is None:
            return 0
        one_ns = greatest_wait_ns(self.way.slots)
        if self.trace is not None:
            one_ns += self.trace.longest_ns(1)
        return -(-frames // self.per_slot(size_byte)) * one_ns

    def per_slot(self, size_byte: int) -> int:
        """How many frames of this size a slot carries."""
        most = 1 << 30
        if self.way.slots is not None and self.way.slots.frames is not None:
            most = self.way.slots.frames
        if self.way.slots is not None and self.way.slots.bytes is not None:
            most = min(most, -(-self.way.slots.bytes // max(1, self.frame_byte(size_byte))))
        return most

    def sending_ns(self, size_byte: int, frames: int = 1) -> int:
        """The same without slots."""
        if self.trace is not None:
            return self.trace.longest_ns(frames * self.trace.needed(self.frame_byte(size_byte)))
        if self.rate_bit_s is None:
            return 0
        return frames * -(-8 * self.frame_byte(size_byte) * NS_PER_S // self.rate_bit_s)

    def frame_byte(self, size_byte: int) -> int:
        """What a frame of this size takes on the line."""
        return size_byte + self.way.overhead_byte

    @property
    def filling_byte(self) -> int:
        """On a trace, the size of a frame that leaves nothing over of its opportunities."""
        overhead = self.way.overhead_byte
        return (overhead // OPPORTUNITY_BYTE + 1) * OPPORTUNITY_BYTE - overhead

    def departure_ns(self, time_ns: Ints, size_byte: int) -> Ints:
        """When the last bit leaves of frames that wait neither in the queue nor for a slot."""
        if self.trace is None:
            return time_ns + self.sending_ns(size_byte)
        needed = self.trace.needed(self.frame_byte(size_byte))
        return self.trace.time_ns(self.trace.first_from(time_ns) + needed - 1)

    @property
    def spreads(self) -> bool:
        """Whether some frames are later than others, by jitter, holding back or slots."""
        return self.spread_ns > 0 or self.way.slots is not None

    @property
    def spread_ns(self) -> int:
        """By how much a frame may arrive later than the propagation delay has it."""
        hold_s = self.way.reorder.hold_s if self.way.reorder else 0.0
        return to_ns(hold_s) + greatest_ns(self.way.jitter)


class Windows(NamedTuple):
    """Spans within a phase in which frames may find the rover's end in service, in order."""

    begin_ns: Ints
    end_ns: Ints
    phase: Ints

    def of(self, phase: int) -> tuple[Ints, Ints]:
        """Begin and end of those of one phase."""
        first, after = np.searchsorted(self.phase, [phase, phase + 1])
        return self.begin_ns[first:after], self.end_ns[first:after]

    def longest_ns(self, phase: int) -> int:
        """The length of the longest of one phase; 0 if there is none."""
        begins, ends = self.of(phase)
        return int((ends - begins).max(initial=0))


class Reference:
    """One direction as the profile asks for it.

    Attributes:
        direction: which one.
        phases: in order; times at which nothing can be sent are in none.
        outages_ns: begin and end of each outage, at the rover's end, in order.
        windows: when frames can be sent.
        settled_ns: from when on nothing changes any more.
    """

    def __init__(self, config: LinkConfig, direction: Direction) -> None:
        self.direction = direction
        self.phases = tuple(_phases(config, direction))
        outages = [(one.begin_ns, one.end_ns) for one in outages_of(config, direction)]
        self.outages_ns = _limited(outages)
        way = config.way(direction)
        points = [(to_ns(one.t_s), to_ns(one.delay_s)) for one in way.delay_points]
        # Of points within a nanosecond, the last one.
        points = sorted(dict(points).items()) or [(0, to_ns(way.delay_s or 0.0))]
        self._times, self._delays = _limited(points).T
        trace = way.delay_trace
        wraps = trace is not None and trace.at_end is AfterLast.WRAP
        # Of a delay that wraps, the length of a round.
        self._round_ns = int(self._times[-1]) if wraps else 0
        self._turns = _two_rounds(self._times, self._delays) if self._round_ns else None
        begins = [phase.begin_ns for phase in self.phases]
        self.settled_ns = max(int(self._times[-1]), *self.outages_ns[-1:, 1], 0, *begins[-1:])
        self.windows = self._windows()

    # --- delays --------------------------------------------------------------------------------

    def delay_ns(self, time_ns: Ints) -> Ints:
        """Propagation delay of what is sent at these times."""
        times, delays = self._times, self._delays
        if self._round_ns:
            time_ns = time_ns % self._round_ns
        if len(times) < 2:
            return np.full(len(time_ns), delays[0])
        after = np.clip(np.searchsorted(times, time_ns, side="right"), 1, len(times) - 1)
        begins, ends = times[after - 1], times[after]
        gains, passed = delays[after] - delays[after - 1], np.clip(time_ns, begins, ends) - begins
        # Products of two times do not fit into 64 bits.
        gained = gains.astype(object) * passed.astype(object) // (ends - begins).astype(object)
        found: Ints = delays[after - 1] + gained.astype(np.int64)
        return found

    def delay_range_ns(self, first_ns: Ints, last_ns: Ints) -> tuple[Ints, Ints]:
        """The least and the greatest delay of what is sent between two moments."""
        ends = np.stack([self.delay_ns(first_ns), self.delay_ns(last_ns)])
        least, greatest = ends.min(axis=0), ends.max(axis=0)
        times, delays, first_ns, last_ns = self._within(first_ns, last_ns)
        first = np.searchsorted(times, first_ns, side="right")
        after = np.searchsorted(times, last_ns, side="left")
        within = np.flatnonzero(first < after)
        if len(within):
            slices = np.stack([first[within], after[within]], axis=1).ravel()
            delays = np.append(delays, delays[-1])
            inner = np.minimum.reduceat(delays, slices)[::2]
            least[within] = np.minimum(least[within], inner)
            inner = np.maximum.reduceat(delays, slices)[::2]
            greatest[within] = np.maximum(greatest[within], inner)
        return least, greatest

    def is_compressed(self, first_ns: Ints, last_ns: Ints) -> Bools:
        """Whether what is sent later arrives no later somewhere between two moments."""
        times, delays, first_ns, last_ns = self._within(first_ns, last_ns)
        falling = np.append(0, np.cumsum(np.diff(delays) <= -np.diff(times)))
        first = np.searchsorted(times, first_ns, side="right") - 1
        after = np.searchsorted(times, last_ns, side="left")
        last = len(falling) - 1
        found: Bools = falling[np.clip(first, 0, last)] < falling[np.clip(after, 0, last)]
        return found

    def _within(self, first_ns: Ints, last_ns: Ints) -> tuple[Ints, Ints, Ints, Ints]:
        """The points between which the delay is linear, and the same spans in their time."""
        if self._turns is None:
            return self._times, self._delays, first_ns, last_ns
        begun_ns = first_ns % self._round_ns
        return *self._turns, begun_ns, begun_ns + np.minimum(last_ns - first_ns, self._round_ns)

    @property
    def greatest_delay_ns(self) -> int:
        """The longest propagation delay at any time."""
        return int(self._delays.max())

    # --- outages -------------------------------------------------------------------------------

    def stay_ns(
        self, time_ns: Ints, busy_ns: Ints | int, spread_ns: Ints | int
    ) -> tuple[Ints, Ints]:
        """First and last moment at which something can be at the rover's end.

        Args:
            time_ns: when it is sent.
            busy_ns: how long it takes to leave.
            spread_ns: by how much it may be late.
        """
        if self.direction is Direction.DOWN:
            return time_ns, time_ns + busy_ns
        return self.arrival_range_ns(time_ns, busy_ns, spread_ns)

    def arrival_range_ns(
        self, time_ns: Ints, busy_ns: Ints | int, spread_ns: Ints | int
    ) -> tuple[Ints, Ints]:
        """First and last moment at which something can arrive; arguments as of `stay_ns`."""
        least, greatest = self.delay_range_ns(time_ns, time_ns + busy_ns)
        return time_ns + least, time_ns + busy_ns + greatest + spread_ns

    def is_clear(self, first_ns: Ints, last_ns: Ints) -> Bools:
        """Whether no outage, with a margin, overlaps the time between two moments."""
        begins, ends = self.outages_ns.T
        found: Bools = np.searchsorted(ends, first_ns - MARGIN_NS, side="right") == np.searchsorted(
            begins, last_ns + MARGIN_NS, side="right"
        )
        return found

    def is_out(self, first_ns: Ints, last_ns: Ints) -> Bools:
        """Whether one outage, with a margin, covers the time between two moments."""
        begins, ends = self.outages_ns.T
        if not len(begins):
            return np.zeros(len(first_ns), dtype=np.bool_)
        at = np.searchsorted(begins, first_ns - MARGIN_NS, side="right") - 1
        found: Bools = (at >= 0) & (last_ns + MARGIN_NS < ends[at])
        return found

    def _windows(self) -> Windows:
        edges = np.concatenate([[0], self.outages_ns.ravel(), [FOREVER_NS]])
        opens, closes = edges[::2], edges[1::2]
        if self.direction is Direction.UP:
            opens = opens - self._delays.max()
            closes = np.append(closes[:-1] - self._delays.min(), FOREVER_NS)
            # Where delays differ by more than outages last, spans would overlap.
            opens[1:] = np.maximum(opens[1:], np.maximum.accumulate(closes)[:-1])
        phases = np.array(
            [(one.begin_ns, one.end_ns) for one in self.phases], dtype=np.int64
        ).reshape(-1, 2)
        service = np.stack([opens, closes], axis=1)[opens < closes]
        cuts = np.unique(np.concatenate([phases.ravel(), service.ravel()]))
        begins, ends = cuts[:-1], cuts[1:]
        phase = np.searchsorted(phases[:, 0], begins, side="right") - 1
        within = (phase >= 0) & (begins < np.append(phases[:, 1], 0)[phase])
        at = np.searchsorted(service[:, 0], begins, side="right") - 1
        within &= (at >= 0) & (begins < np.append(service[:, 1], 0)[at])
        return Windows(begins[within], ends[within], phase[within])

    # --- settings ------------------------------------------------------------------------------

    def kinds(self, key: Callable[[Phase], int]) -> tuple[list[list[int]], int]:
        """Indices of the phases of each kind, and how many kinds were passed over as too many."""
        kinds: dict[int, list[int]] = {}
        for index, phase in enumerate(self.phases):
            kinds.setdefault(key(phase), []).append(index)
        found = list(kinds.values())
        if len(found) <= MOST_KINDS:
            return found, 0
        chosen = np.linspace(0, len(found) - 1, MOST_KINDS).astype(int)
        return [found[index] for index in chosen], len(found) - MOST_KINDS


def _two_rounds(times: Ints, delays: Ints) -> tuple[Ints, Ints]:
    """Two rounds of a delay that wraps, which hold any span no longer than one."""
    return (
        np.concatenate([times, times[-1:], times + times[-1]]),
        np.concatenate([delays, delays[:1], delays]),
    )


def _limited(pairs: Sequence[tuple[int, int]]) -> Ints:
    limited = [(min(one, 2 * FOREVER_NS), min(other, 2 * FOREVER_NS)) for one, other in pairs]
    return np.array(limited, dtype=np.int64).reshape(-1, 2)


def _phases(config: LinkConfig, direction: Direction) -> Iterator[Phase]:
    kinds: dict[OneWay, int] = {}
    rate_kinds: dict[tuple[int, object], int] = {}
    way, loss_start = config.way(direction), 0
    ways = [(0, way, loss_start)]
    for change in sorted(config.changes, key=lambda one: to_ns(one.at_s)):
        if change.direction.includes(direction):
            changed = change.applied_to(way)
            loss_start += changed.loss != way.loss
            way = changed
            ways.append((to_ns(change.at_s), way, loss_start))
    for (begin_ns, one, start), (end_ns, *_) in pairwise([*ways, (FOREVER_NS, way, 0)]):
        trace = None if one.rate_trace is None else TraceTimes(one.rate_trace)
        kind = kinds.setdefault(_without_rate_and_delay(one), len(kinds))
        for first_ns, last_ns, rate in _rates(one):
            span = max(begin_ns, first_ns), min(end_ns, last_ns)
            if span[0] >= span[1]:
                continue
            rate_kind = rate_kinds.setdefault((kind, rate or one.rate_trace), len(rate_kinds))
            yield Phase(*span, one, rate, trace, kind, rate_kind, start)


def _rates(way: OneWay) -> Iterator[tuple[int, int, int | None]]:
    """Spans in which something can be sent, each with its rate."""
    if way.rate_table:
        steps = [(to_ns(step.t_s), step.rate_bit_s) for step in way.rate_table]
        for (begin_ns, rate), (end_ns, _) in pairwise([*steps, (FOREVER_NS, 0)]):
            if rate:
                yield begin_ns, end_ns, rate
    elif way.rate_trace is not None and way.rate_trace.at_end is AtEnd.END:
        yield 0, way.rate_trace.times_ms[-1] * 1_000_000, None
    else:
        yield 0, FOREVER_NS, way.rate_bit_s


def _without_rate_and_delay(way: OneWay) -> OneWay:
    free: dict[str, object] = {"rate_table": (), "delay_table": ()}
    for key in ("rate_bit_s", "rate_trace", "delay_s", "delay_trace"):
        free[key] = None
    return msgspec.structs.replace(way, **free)
