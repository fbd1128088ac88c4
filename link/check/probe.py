"""Synthetic traffic for `farside.link.check`: what to send when, and how it arrives.

Frames are sent at times at which they do not affect each other, so that each fate is evidence of
one impairment alone. Simulated time costs nothing.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator, SeedSequence, default_rng
from numpy.typing import NDArray

from farside.frames import Fate, FrameFate
from farside.link.profile.config import AtEnd, LinkConfig, OneWay
from farside.link.profile.impairments import JitterShape
from farside.link.profile.schedule import outages_of
from farside.node import NS_PER_S, Direction, Frame, Node, Record, to_ns

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
ChannelFactory = Callable[[LinkConfig, Mapping[Direction, Generator]], Node]

_FOREVER_NS = 1 << 60
_MARGIN_NS = 1_000
_HEAVIEST_TAIL = 40.0
"""In mean jitters: what an exponential jitter exceeds once in 10^17 frames."""
_ABSENT = -1
_decode_fate = msgspec.json.Decoder(FrameFate).decode


class Phase(NamedTuple):
    """A span of time in which a direction does not change.

    Attributes:
        begin_ns, end_ns: the span, in the sender's time.
        way: the settings of the direction, with all changes so far.
        rate_bit_s: its rate cap; `None` without one, or with a trace.
    """

    begin_ns: int
    end_ns: int
    way: OneWay
    rate_bit_s: int | None

    def sending_ns(self, size_byte: int) -> int:
        """The longest time from hand-over of a frame until its last bit leaves."""
        if self.way.rate_trace is not None:
            return int(np.diff(_two_rounds_ms(self.way)).max()) * 1_000_000
        if self.rate_bit_s is None:
            return 0
        bits = 8 * (size_byte + self.way.overhead_byte)
        return -(-bits * NS_PER_S // self.rate_bit_s)

    @property
    def spread_ns(self) -> int:
        """By how much a frame may arrive later than the propagation delay has it."""
        jitter, hold_s = self.way.jitter, self.way.reorder.hold_s if self.way.reorder else 0.0
        if jitter is None:
            return to_ns(hold_s)
        tail = _HEAVIEST_TAIL if jitter.shape is JitterShape.EXPONENTIAL else 1.0
        return to_ns(hold_s + tail * jitter.spread_s)


class Traffic(NamedTuple):
    """Frames of one direction in order of sending.

    Attributes:
        time_ns, size_byte: when each is sent, and its size.
        phase: index of the phase that each belongs to.
        burst: number of the burst that each belongs to.
    """

    time_ns: Ints
    size_byte: Ints
    phase: Ints
    burst: Ints


class Arrivals(NamedTuple):
    """How the frames of a `Traffic` arrived, in the same order.

    Attributes:
        time_ns: first arrival; −1 without one.
        copies: how often each arrived.
        wrong_bits: how many bits of the first arrival differ from what was sent.
        overtaken: whether a frame sent later arrived earlier.
        disagreeing: how many frames have records that disagree with what arrived.
    """

    time_ns: Ints
    copies: Ints
    wrong_bits: Ints
    overtaken: Bools
    disagreeing: int

    @property
    def arrived(self) -> Bools:
        """Which frames arrived at all."""
        found: Bools = self.time_ns != _ABSENT
        return found


class Reference:
    """One direction as the profile asks for it, and when frames can be sent in it."""

    def __init__(self, config: LinkConfig, direction: Direction) -> None:
        self.direction = direction
        self.phases = tuple(_phases(config, direction))
        self.outages = [(one.begin_ns, one.end_ns) for one in outages_of(config, direction)]
        way = config.way(direction)
        points = [(to_ns(one.t_s), to_ns(one.delay_s)) for one in way.delay_table]
        self._times, self._delays = zip(*(points or [(0, to_ns(way.delay_s or 0.0))]), strict=True)

    def delay_ns(self, time_ns: Ints) -> Ints:
        """Propagation delay of what is sent at these times."""
        found: Ints = np.rint(np.interp(time_ns, self._times, self._delays)).astype(np.int64)
        return found

    @property
    def slope(self) -> float:
        """The greatest rate of change of the delay, in seconds per second."""
        if len(self._times) < 2:
            return 0.0
        return float(np.abs(np.diff(self._delays) / np.diff(self._times)).max())

    def departure_ns(self, phase: Phase, time_ns: Ints, size_byte: int) -> Ints:
        """When the last bit leaves of frames that do not have to queue."""
        trace = phase.way.rate_trace
        if trace is None:
            return time_ns + phase.sending_ns(size_byte)
        return opportunities_ns(phase.way, time_ns, 1)[:, 0]

    def stay_ns(self, phase: Phase, time_ns: Ints, size_byte: int) -> tuple[Ints, Ints]:
        """First and last moment at which frames sent at these times can be at the rover's end."""
        sending_ns = phase.sending_ns(size_byte)
        if self.direction is Direction.DOWN:
            return time_ns, time_ns + sending_ns
        delay_ns = self.delay_ns(time_ns)
        return time_ns + delay_ns, time_ns + sending_ns + delay_ns + phase.spread_ns

    def is_clear(self, first_ns: Ints, last_ns: Ints) -> Bools:
        """Whether no outage, with a margin, overlaps the time between two moments."""
        return ~self._meets(first_ns - _MARGIN_NS, last_ns + _MARGIN_NS)

    def is_out(self, first_ns: Ints, last_ns: Ints) -> Bools:
        """Whether one outage, with a margin, covers the time between two moments."""
        begins = np.array([begin for begin, _ in self.outages], dtype=np.int64)
        ends = np.array([end for _, end in self.outages], dtype=np.int64)
        at = np.searchsorted(begins, first_ns - _MARGIN_NS, side="right") - 1
        return (at >= 0) & (last_ns + _MARGIN_NS < ends[at])

    def _meets(self, first_ns: Ints, last_ns: Ints) -> Bools:
        begins = np.array([begin for begin, _ in self.outages], dtype=np.int64)
        ends = np.array([end for _, end in self.outages], dtype=np.int64)
        found: Bools = np.searchsorted(ends, first_ns, side="right") != np.searchsorted(
            begins, last_ns, side="right"
        )
        return found

    def starts_ns(
        self, phase: Phase, size_byte: int, frames: int, count: int, rng: Generator
    ) -> Ints:
        """Up to `count` times to send `frames` at once, each burst over before the next begins."""
        busy_ns = phase.sending_ns(size_byte) * frames
        slot_ns = int((busy_ns + phase.spread_ns) * (1 + 2 * self.slope)) + 4 * _MARGIN_NS
        found: list[Ints] = []
        for begin_ns, end_ns in self._windows(phase):
            if count <= 0:
                break
            number = min((end_ns - begin_ns - busy_ns) // (slot_ns + slot_ns // 8), 2 * count)
            times = begin_ns + np.arange(number) * (slot_ns + slot_ns // 8)
            times += rng.integers(0, slot_ns // 8, size=number)
            first_ns, last_ns = self.stay_ns(phase, times, size_byte)
            last_ns = last_ns + busy_ns
            found.append(times[self.is_clear(first_ns, last_ns)][:count])
            count -= len(found[-1])
        return np.concatenate([np.empty(0, np.int64), *found])

    def _windows(self, phase: Phase) -> Iterator[tuple[int, int]]:
        """The spans of a phase in which frames may find the rover's end in service."""
        longest = max(self._delays) if self.direction is Direction.UP else 0
        shortest = min(self._delays) if self.direction is Direction.UP else 0
        edges = [0, *(edge for outage in self.outages for edge in outage), _FOREVER_NS]
        for opens_ns, closes_ns in zip(edges[::2], edges[1::2], strict=True):
            begin_ns = max(phase.begin_ns, opens_ns - longest)
            end_ns = min(phase.end_ns, closes_ns - shortest)
            if end_ns - begin_ns > 2 * _MARGIN_NS:
                yield begin_ns + _MARGIN_NS, end_ns - _MARGIN_NS


def _phases(config: LinkConfig, direction: Direction) -> Iterator[Phase]:
    way = config.way(direction)
    changes = [one for one in config.changes if one.direction.includes(direction)]
    ways = [(0, way)]
    for change in changes:
        ways.append((to_ns(change.at_s), change.applied_to(ways[-1][1])))
    for (begin_ns, changed), (end_ns, _) in pairwise([*ways, (_FOREVER_NS, way)]):
        steps = [(to_ns(step.t_s), step.rate_bit_s) for step in changed.rate_table]
        steps = steps or [(0, changed.rate_bit_s or _FOREVER_NS)]
        for (step_ns, rate), (next_ns, _) in pairwise([*steps, (_trace_end_ns(changed), 0)]):
            first_ns, last_ns = max(begin_ns, step_ns), min(end_ns, next_ns)
            if rate and first_ns < last_ns:
                yield Phase(first_ns, last_ns, changed, None if rate == _FOREVER_NS else rate)


def _trace_end_ns(way: OneWay) -> int:
    if way.rate_trace is None or way.rate_trace.at_end is AtEnd.WRAP:
        return _FOREVER_NS
    return max(way.rate_trace.times_ms) * 1_000_000


def _two_rounds_ms(way: OneWay) -> Ints:
    times = np.array(way.rate_trace.times_ms if way.rate_trace else (), dtype=np.int64)
    return np.concatenate([[0], times, times + times[-1]])


def opportunities_ns(way: OneWay, time_ns: Ints, count: int) -> Ints:
    """The next `count` delivery opportunities from each of these times on, a row for each time."""
    times_ns = np.array(way.rate_trace.times_ms if way.rate_trace else ()) * 1_000_000
    round_ns = int(times_ns[-1])
    rounds, rest = np.divmod(time_ns, round_ns)
    at = np.searchsorted(times_ns, rest, side="left")[:, None] + np.arange(count)
    more, index = np.divmod(at, len(times_ns))
    found: Ints = times_ns[index] + (rounds[:, None] + more) * round_ns
    return found


def seeds(seed: int, probe: int) -> tuple[Generator, dict[Direction, Generator]]:
    """Random generators of a probe: one that chooses times, and those of the channel."""
    traffic, up, down = SeedSequence([seed, probe]).spawn(3)
    return default_rng(traffic), {Direction.UP: default_rng(up), Direction.DOWN: default_rng(down)}


def run_probe(
    channel: Node, traffic: Mapping[Direction, Traffic], on_progress: Callable[[int], None]
) -> dict[Direction, Arrivals]:
    """Send frames through a channel until none is in flight, and match what arrives to them.

    Args:
        channel: one that has not been advanced yet.
        traffic: what to send.
        on_progress: called now and then with the number of frames sent since the last call.
    """
    sent = sorted(
        (
            Frame(direction, number, int(time_ns), _payload(number, int(size_byte)))
            for direction, frames in traffic.items()
            for number, (time_ns, size_byte) in enumerate(
                zip(frames.time_ns, frames.size_byte, strict=True)
            )
        ),
        key=lambda frame: frame.time_ns,
    )
    arrived: list[Frame] = []
    records: list[Record] = []
    for start in range(0, len(sent), 5000):
        batch = sent[start : start + 5000]
        step = channel.advance(_batch_end_ns(sent, start + 5000), batch)
        arrived += step.frames
        records += step.records
        on_progress(len(batch))
    step = channel.advance(2 * _FOREVER_NS, [])
    arrived += step.frames
    fates = [
        _decode_fate(one.payload) for one in [*records, *step.records] if one.topic == "/link/frame"
    ]
    return {
        direction: _matched(
            len(frames.time_ns),
            [one for one in sent if one.direction is direction],
            [one for one in arrived if one.direction is direction],
            [one for one in fates if one.direction is direction],
        )
        for direction, frames in traffic.items()
    }


def _batch_end_ns(sent: Sequence[Frame], end: int) -> int:
    return sent[end].time_ns if end < len(sent) else sent[-1].time_ns + 1


def _payload(number: int, size_byte: int) -> bytes:
    """Bytes that differ from frame to frame and have as many ones as zeros."""
    block = number.to_bytes(4, "big") + bytes(0xFF ^ byte for byte in number.to_bytes(4, "big"))
    return (block * (size_byte // 8 + 1))[:size_byte]


def _matched(
    count: int, sent: Sequence[Frame], arrived: Sequence[Frame], fates: Sequence[FrameFate]
) -> Arrivals:
    time_ns = np.full(count, _ABSENT, dtype=np.int64)
    copies, wrong = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    payloads = {frame.sequence: frame.payload for frame in sent}
    for frame in sorted(arrived, key=lambda one: one.time_ns):
        number = frame.sequence
        if number not in payloads:
            continue
        copies[number] += 1
        if copies[number] == 1:
            time_ns[number] = frame.time_ns
            wrong[number] = _wrong_bits(payloads[number], frame.payload)
    later = np.where(time_ns == _ABSENT, 2 * _FOREVER_NS, time_ns)
    least_after = np.minimum.accumulate(later[::-1])[::-1]
    overtaken = np.zeros(count, dtype=np.bool_)
    overtaken[:-1] = (least_after[1:] < time_ns[:-1]) & (time_ns[:-1] != _ABSENT)
    return Arrivals(time_ns, copies, wrong, overtaken, _disagreeing(count, arrived, fates))


def _wrong_bits(sent: bytes, arrived: bytes) -> int:
    if sent == arrived:
        return 0
    size = max(len(sent), len(arrived))
    return (
        int.from_bytes(sent.ljust(size, b"\0")) ^ int.from_bytes(arrived.ljust(size, b"\0"))
    ).bit_count()


def _disagreeing(count: int, arrived: Sequence[Frame], fates: Sequence[FrameFate]) -> int:
    """How many frames do not have exactly one fate, or arrived otherwise than their records say."""
    recorded = Counter((fate.sequence, fate.copy) for fate in fates)
    delivered = Counter((f.sequence, f.arrival_ns or 0) for f in fates if f.fate is Fate.DELIVERED)
    seen = Counter((frame.sequence, frame.time_ns) for frame in arrived)
    wrong = {number for number in range(count) if recorded[number, 0] != 1}
    wrong |= {number for (number, copy), times in recorded.items() if copy > 1 or times > 1}
    wrong |= {number for number, _ in (delivered - seen) + (seen - delivered)}
    return len(wrong)
