"""What all probes of `farside.link.check` share: lines of the report, and bursts of frames."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval, clustered_interval, share_interval
from farside.link.check.probe import Arrivals, Bools, Ints, Phase, Reference, Traffic
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_quantile, loss_statistics

Estimate = Callable[[float], Interval]
"""The interval that misses the true value with at most the probability given."""

SHORT_BYTE = 64
_BATCHES = 50


class CheckLine(NamedTuple):
    """A measurement without its verdict; see `farside.link.check.Measurement`."""

    impairment: str
    unit: str
    frames: int
    asked: Interval
    measured: float
    estimate: Estimate


class Observation(NamedTuple):
    """The traffic of one probe in one direction, and how it arrived."""

    reference: Reference
    traffic: Traffic
    arrivals: Arrivals


def plan_bursts(
    reference: Reference,
    rng: Generator,
    burst_of: Callable[[Phase], tuple[int, int]],
    count: int,
    key: Callable[[Phase], object],
) -> Traffic:
    """Up to `count` bursts for each kind of phase.

    Args:
        reference: the direction to send in.
        rng: chooses the times.
        burst_of: size in bytes and number of the frames of a burst, for a phase.
        count: how many bursts at most.
        key: which phases are of one kind.
    """
    left: dict[object, int] = {}
    columns: list[Ints] = [np.empty((0, 4), dtype=np.int64)]
    bursts = 0
    for index, phase in enumerate(reference.phases):
        size, frames = burst_of(phase)
        kind = key(phase)
        if not frames or not left.setdefault(kind, count):
            continue
        starts = reference.starts_ns(phase, size, frames, left[kind], rng)
        left[kind] -= len(starts)
        times = (starts[:, None] + np.arange(frames)).ravel()
        numbers = np.repeat(np.arange(bursts, bursts + len(starts)), frames)
        bursts += len(starts)
        columns.append(
            np.column_stack([times, np.full(len(times), size), np.full(len(times), index), numbers])
        )
    return Traffic(*np.concatenate(columns).T)


def groups(
    seen: Observation, key: Callable[[Phase], object]
) -> Iterator[tuple[Bools, list[Phase]]]:
    """For each kind of phase: which frames belong to it, and its phases."""
    kinds: dict[object, list[int]] = {}
    for index, phase in enumerate(seen.reference.phases):
        kinds.setdefault(key(phase), []).append(index)
    for indices in kinds.values():
        chosen = np.isin(seen.traffic.phase, indices)
        if chosen.any():
            yield chosen, [seen.reference.phases[index] for index in indices]


def impairment_key(phase: Phase) -> object:
    """Equal for phases that differ in nothing but their rate."""
    return msgspec.structs.replace(phase.way, rate_bit_s=None, rate_table=(), rate_trace=None)


def rate_key(phase: Phase) -> object:
    """Equal for phases that differ in nothing but their time."""
    return phase.rate_bit_s, impairment_key(phase)


def fitting(phase: Phase, size_byte: int) -> int:
    """`size_byte`, or what fits into the queue."""
    return max(1, min(size_byte, phase.way.queue_byte))


def batched(values: Floats) -> Floats:
    """Sums over batches of values, far longer than any burst of losses."""
    return np.array([part.sum() for part in np.array_split(values, _BATCHES)])


def point(value: float) -> Interval:
    """A single value as a range."""
    return float(value), float(value)


def share_line(name: str, asked: float, hits: Bools) -> CheckLine:
    """How often something happened that happens to each frame independently."""
    found, count = int(hits.sum()), len(hits)
    estimate = partial(share_interval, found, count)
    return CheckLine(
        name, "share", count, point(asked), found / count if count else math.nan, estimate
    )


def exact_line(name: str, frames: int, asked: float, measured: float) -> CheckLine:
    """A value without randomness, measured exactly."""
    return CheckLine(name, "", frames, point(asked), float(measured), lambda _miss: point(measured))


def loss_line(name: str, asked: float, arrived: Bools, way: OneWay) -> CheckLine:
    """The share of frames lost, perhaps in bursts."""
    lost = (~arrived).astype(float)
    if isinstance(way.loss, float):
        estimate: Estimate = partial(share_interval, lost.sum(), len(lost))
    else:
        estimate = partial(
            clustered_interval,
            batched(lost),
            batched(np.ones(len(lost))),
            clustering=loss_statistics(way.loss).clustering,
        )
    return CheckLine(name, "share", len(lost), point(asked), float(lost.mean()), estimate)


def bit_error_loss(way: OneWay, size_byte: int) -> float:
    """Probability that a frame is lost to bit errors; one in the overhead always loses it."""
    exposed = way.overhead_byte
    if way.bit_errors is BitErrorEffect.LOSE:
        exposed += size_byte
    return 1 - (1 - way.bit_error_rate) ** (8 * exposed)


def quantile(jitter: Jitter, probability: float) -> float:
    """The jitter in seconds that is not exceeded with this probability, 0 to 1."""
    return float(jitter_quantile(jitter, np.array(min(probability, 1 - 1e-15))))
