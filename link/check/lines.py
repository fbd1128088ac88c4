"""What the parts of `farside.link.check` have in common: lines of the report, and traffic."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Floats, Interval, clustered_interval, share_interval
from farside.link.check.probe import Arrivals, Bools, Ints, Phase, Route, Traffic
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import jitter_quantile, loss_statistics

Estimate = Callable[[float], Interval]
"""The interval that misses the true value with a chance of at most the one given."""

SHORT_BYTE = 64
_BATCHES = 50


class Line(NamedTuple):
    """A measurement without its verdict; see `farside.link.check.Measurement`."""

    impairment: str
    unit: str
    frames: int
    asked: Interval
    measured: float
    estimate: Estimate


class Seen(NamedTuple):
    """The traffic of one probe in one direction, and what came of it."""

    route: Route
    traffic: Traffic
    arrivals: Arrivals


# --- helpers -----------------------------------------------------------------------------------


def plan_bursts(
    route: Route,
    rng: Generator,
    burst_of: Callable[[Phase], tuple[int, int]],
    count: int,
    key: Callable[[Phase], object],
) -> Traffic:
    """Up to `count` bursts for each kind of phase: size and number of frames as `burst_of` says."""
    left: dict[object, int] = {}
    columns: list[Ints] = [np.empty((0, 4), dtype=np.int64)]
    bursts = 0
    for index, phase in enumerate(route.phases):
        size, frames = burst_of(phase)
        kind = key(phase)
        if not frames or not left.setdefault(kind, count):
            continue
        starts = route.starts_ns(phase, size, frames, left[kind], rng)
        left[kind] -= len(starts)
        times = (starts[:, None] + np.arange(frames)).ravel()
        numbers = np.repeat(np.arange(bursts, bursts + len(starts)), frames)
        bursts += len(starts)
        columns.append(
            np.column_stack([times, np.full(len(times), size), np.full(len(times), index), numbers])
        )
    return Traffic(*np.concatenate(columns).T)


def groups(seen: Seen, key: Callable[[Phase], object]) -> Iterator[tuple[Bools, list[Phase]]]:
    """The frames of each kind of phase, and those phases."""
    kinds: dict[object, list[int]] = {}
    for index, phase in enumerate(seen.route.phases):
        kinds.setdefault(key(phase), []).append(index)
    for indices in kinds.values():
        chosen = np.isin(seen.traffic.phase, indices)
        if chosen.any():
            yield chosen, [seen.route.phases[index] for index in indices]


def chance_key(phase: Phase) -> object:
    """What phases have in common that differ in their rate alone."""
    return msgspec.structs.replace(phase.way, rate_bit_s=None, rate_table=(), rate_trace=None)


def rate_key(phase: Phase) -> object:
    """What phases have in common that are the same at different times."""
    return phase.rate_bit_s, chance_key(phase)


def fitting(phase: Phase, size_byte: int) -> int:
    """`size_byte`, or what the queue takes."""
    return max(1, min(size_byte, phase.way.queue_byte))


def batched(values: Floats) -> Floats:
    """Sums over stretches of values, far longer than any burst of losses."""
    return np.array([part.sum() for part in np.array_split(values, _BATCHES)])


def point(value: float) -> Interval:
    """A single value as a range."""
    return float(value), float(value)


def share_line(name: str, asked: float, hits: Bools) -> Line:
    """How often something happened that happens to each frame on its own."""
    found, count = int(hits.sum()), len(hits)
    estimate = partial(share_interval, found, count)
    return Line(name, "share", count, point(asked), found / count if count else math.nan, estimate)


def exact_line(name: str, frames: int, asked: float, measured: float) -> Line:
    """What chance has no part in."""
    return Line(name, "", frames, point(asked), float(measured), lambda _miss: point(measured))


def loss_line(name: str, asked: float, arrived: Bools, way: OneWay) -> Line:
    """How many frames were lost, which may come in bursts."""
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
    return Line(name, "share", len(lost), point(asked), float(lost.mean()), estimate)


def bit_error_loss(way: OneWay, size_byte: int) -> float:
    """The chance to lose a frame to bit errors; those beside the payload always lose it."""
    exposed = way.overhead_byte
    if way.bit_errors is BitErrorEffect.LOSE:
        exposed += size_byte
    return 1 - (1 - way.bit_error_rate) ** (8 * exposed)


def quantile(jitter: Jitter, chance: float) -> float:
    """The jitter in seconds that is not exceeded with a chance of `chance`."""
    return float(jitter_quantile(jitter, np.array(min(chance, 1 - 1e-15))))
