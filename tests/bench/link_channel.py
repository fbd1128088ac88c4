"""How many frames a second the channel takes, and the memory of a million frames in flight.

Frames of 64 bytes come in windows of a second, as many up as down; the time is that of
`Channel.advance` alone, records included. The reference is what one would write for a test: a heap
of arrivals, and a JSON record of each frame. Times are processor times, so that other load on the
machine counts less. The limits are those of the issue tracker; nothing here fails.
"""

import gc
import heapq
import random
import resource
import statistics
import subprocess
import sys
import time

import msgspec
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.link import Channel, LinkConfig, OneWay
from farside.link.profile.config import BitErrorEffect, Blackout, DropPolicy
from farside.link.profile.impairments import (
    CorrelatedLoss,
    GilbertElliott,
    Jitter,
    JitterShape,
    Reorder,
    Slots,
)
from farside.node import Direction, Frame, to_ns

ROUNDS = 5
FRAMES = 200_000
WINDOWS = 10
IN_FLIGHT = 1_000_000
END_S = 100.0
PAYLOAD = bytes(64)

ALL, BY_HAND = "all impairments", "by hand: a heap, delay and loss"
HEAVY = "the same, with slots and heavy tails"
BARE = OneWay(delay_s=1.28)
# 10,000 frames/s per direction are a little more than the rate carries: there is always a queue.
IMPAIRED = OneWay(
    delay_s=1.28,
    rate_bit_s=5_900_000,
    overhead_byte=12,
    queue_byte=16_384,
    queue_frame=200,
    drop=DropPolicy.LOWEST,
    lifetime_s=0.05,
    loss=GilbertElliott(p=0.01, r=0.3),
    bit_error_rate=1e-6,
    bit_errors=BitErrorEffect.FLIP,
    corrupt=0.001,
    jitter=Jitter(spread_s=0.002, correlation=0.5),
    reorder=Reorder(share=0.01, hold_s=0.005),
    duplicate=0.01,
)
# Slots cost a fifth of the time, so that as many frames are dropped as above.
SLOTTED = msgspec.structs.replace(
    IMPAIRED,
    rate_bit_s=8_000_000,
    loss=CorrelatedLoss(probability=0.03, correlation=0.3),
    jitter=Jitter(spread_s=0.002, shape=JitterShape.PARETONORMAL, mean_s=0.003, correlation=0.5),
    reorder=Reorder(share=0.01, hold_s=0.005, correlation=0.3),
    slots=Slots(min_s=0.0002, max_s=0.0008, frames=26, bytes=2_000),
)


def channel(one_way: OneWay) -> Channel:
    """A channel with both directions alike, and one blackout."""
    config = LinkConfig(up=one_way, down=one_way, blackouts=(Blackout(start_s=5.0, end_s=5.2),))
    return Channel(config, {way: np.random.default_rng([1, way == "up"]) for way in Direction})


def windows(count: int) -> list[list[Frame]]:
    """`count` frames of both directions in windows of a second, in four priorities."""
    each = count // 2 // WINDOWS
    gap_ns = to_ns(1.0) // each
    return [
        [
            Frame(way, number, window * to_ns(1.0) + index * gap_ns, PAYLOAD, number % 4)
            for index in range(each)
            for way in Direction
            for number in [window * each + index]
        ]
        for window in range(WINDOWS)
    ]


def by_hand_per_s() -> float:
    """Frames per second of the reference, which delays and loses frames one by one."""
    sent, rng = windows(FRAMES), random.Random(1)  # noqa: S311 - for a link
    delay_ns, encode = to_ns(1.28), msgspec.json.Encoder().encode
    arriving: list[tuple[int, int, Direction, Frame]] = []
    records: list[bytes] = []
    began = time.process_time()
    for window, frames in enumerate([*sent, []], 1):
        for frame in frames:
            if rng.random() < 0.01:
                records.append(encode(("lost", frame.direction, frame.sequence)))
            else:
                heapq.heappush(
                    arriving, (frame.time_ns + delay_ns, frame.sequence, frame.direction, frame)
                )
        until_ns = to_ns(float(window) if frames else END_S)
        while arriving and arriving[0][0] < until_ns:
            at_ns, _, _, frame = heapq.heappop(arriving)
            records.append(encode(("arrived", frame.direction, frame.sequence, at_ns)))
    return FRAMES / (time.process_time() - began)


def frames_per_s(one_way: OneWay) -> float:
    """Frames handed over per second, until the last one is recorded."""
    sent = windows(FRAMES)
    node = channel(one_way)
    records = 0
    began = time.process_time()
    for window, frames in enumerate(sent, 1):
        records += len(node.advance(to_ns(float(window)), frames).records)
    records += len(node.advance(to_ns(END_S), []).records)
    taken_s = time.process_time() - began
    if records < FRAMES:
        raise RuntimeError(f"expected a record of each of {FRAMES} frames, found {records}")
    return FRAMES / taken_s


def growth_mib() -> float:
    """Resident memory of a million frames that have been sent and not yet arrived."""
    node = channel(OneWay(delay_s=1200.0))
    before_mib = _peak_mib()
    arriving: list[Frame] = []
    for window in range(WINDOWS * WINDOWS):
        first, begin_ns = window * IN_FLIGHT // WINDOWS**2, window * to_ns(1.0)
        frames = [
            Frame(Direction.DOWN, first + index, begin_ns + index * 1000, bytes([index % 256] * 64))
            for index in range(IN_FLIGHT // WINDOWS**2)
        ]
        arriving += node.advance(begin_ns + to_ns(1.0), frames).frames
    return _peak_mib() - before_mib


def _peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _growth_alone_mib() -> float:
    # In a process of its own, since the peak of this one includes all it has done before.
    command = [sys.executable, __file__, "memory"]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)  # noqa: S603


def main() -> None:
    """Measure, and print the table."""
    console = Console()
    measures = {
        ALL: lambda: frames_per_s(IMPAIRED),
        HEAVY: lambda: frames_per_s(SLOTTED),
        "delay only": lambda: frames_per_s(BARE),
        BY_HAND: by_hand_per_s,
    }
    figures: dict[str, list[float]] = {name: [] for name in measures}
    for _ in track(range(ROUNDS), "measuring", console=console):
        for name, measure in measures.items():
            figures[name].append(measure())
            gc.collect()
    medians = {name: statistics.median(runs) for name, runs in figures.items()}
    table = Table("what", "median", "least", "most", "of by hand", "limit")
    for name, runs in figures.items():
        numbers = (f"{value:,.0f}" for value in (medians[name], min(runs), max(runs)))
        ratio = f"{medians[name] / medians[BY_HAND]:.2f}"
        limit = "at least 200,000" if name in {ALL, HEAVY} else ""
        table.add_row(f"{name} (frames/s)", *numbers, ratio, limit)
    memory = f"{_growth_alone_mib():,.0f}"
    table.add_row("a million frames in flight (MiB)", memory, "", "", "", "below 1,024")
    console.print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["memory"]:
        sys.stdout.write(f"{growth_mib()}\n")
    else:
        main()
