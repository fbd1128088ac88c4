"""Sends the traffic of a probe through an emulator in simulated time, and sees how it arrives."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from farside.frames import Fate, FrameFate
from farside.link.check.traffic.planning import Traffic
from farside.link.check.traffic.reference import Bools, Ints
from farside.link.profile.config import LinkConfig
from farside.node import NEVER_NS, Direction, Frame, Node, Record, Step

ChannelFactory = Callable[[LinkConfig, Mapping[Direction, Generator]], Node]

_ABSENT = -1
_BATCH = 5000
_SHARED_BYTE = 2_048
"""Frames of more bytes all carry the same, lest they take too much memory."""
_decode_fate = msgspec.json.Decoder(FrameFate).decode


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


class Idle:
    """A channel for probes that send nothing: some take long to make."""

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:  # noqa: ARG002 - a `Node`
        """Nothing happens."""
        return Step([], [])


def seeds(seed: int, probe: int) -> tuple[Generator, dict[Direction, Generator]]:
    """Random generators of a probe: one that chooses times, and those of the channel."""
    traffic, up, down = SeedSequence([seed, probe]).spawn(3)
    return default_rng(traffic), {Direction.UP: default_rng(up), Direction.DOWN: default_rng(down)}


def run_probe(
    channel: Node,
    traffic: Mapping[Direction, Traffic],
    on_progress: Callable[[int], None],
    *,
    lifetime_ns: int | None = None,
) -> dict[Direction, Arrivals]:
    """Send frames through a channel until none is in flight, and match what arrives to them.

    Args:
        channel: one that has not been advanced yet.
        traffic: what to send.
        on_progress: called now and then with the number of frames sent since the last call.
        lifetime_ns: how long each frame may wait; the link's own limit by default.
    """
    sent = sorted(
        (
            Frame(direction, number, time_ns, _payload(number, size_byte), priority, lifetime_ns)
            for direction, frames in traffic.items()
            for number, (time_ns, size_byte, priority) in enumerate(
                zip(
                    frames.time_ns.tolist(),
                    frames.size_byte.tolist(),
                    frames.priority.tolist(),
                    strict=True,
                )
            )
        ),
        key=lambda frame: frame.time_ns,
    )
    arrived: list[Frame] = []
    records: list[Record] = []
    for batch in _batches(sent):
        step = channel.advance(batch[-1].time_ns + 1, batch)
        arrived += step.frames
        records += step.records
        on_progress(len(batch))
    step = channel.advance(NEVER_NS, [])
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


def _batches(sent: Sequence[Frame]) -> Iterator[Sequence[Frame]]:
    """The frames in windows of time, so that those of one moment stay together."""
    begin = 0
    while begin < len(sent):
        end = min(begin + _BATCH, len(sent))
        while end < len(sent) and sent[end].time_ns == sent[end - 1].time_ns:
            end += 1
        yield sent[begin:end]
        begin = end


def _payload(number: int, size_byte: int) -> bytes:
    """Bytes that differ from frame to frame and have as many ones as zeros."""
    return _shared(size_byte) if size_byte > _SHARED_BYTE else _filled(number, size_byte)


@lru_cache(maxsize=1)
def _shared(size_byte: int) -> bytes:
    return _filled(0, size_byte)


def _filled(number: int, size_byte: int) -> bytes:
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
    later = np.where(time_ns == _ABSENT, NEVER_NS, time_ns)
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
