"""The lines of the report, and what all probes share that fill them."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from farside.link.check.chains import LossLikelihood
from farside.link.check.intervals import Interval, clustered_interval, share_interval
from farside.link.check.traffic.planning import Traffic
from farside.link.check.traffic.reference import Bools, Ints, Phase, Reference
from farside.link.check.traffic.run import Arrivals
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_quantile, loss_statistics
from farside.node import to_s

Estimate = Callable[[float], Interval]
"""The interval that misses the true value with at most the probability given."""

_SHORT_BYTE = 64
_BATCHES = 50
_TRANSIENT = 0.001


class CheckLine(NamedTuple):
    """A measurement without its verdict; see `farside.link.check.Measurement`."""

    impairment: str
    unit: str
    frames: int
    asked: Interval
    measured: float
    estimate: Estimate
    why: str = ""


Lines = Iterator[tuple[float, CheckLine]]
"""Lines, each with the time in seconds from which on the direction has been so."""


class Group(NamedTuple):
    """What was sent in all phases of one kind.

    Attributes:
        chosen: which frames of the traffic.
        phases: these phases.
        phase: of each chosen frame, its index in the reference.
        size_byte: of the first frame.
    """

    chosen: Bools
    phases: list[Phase]
    phase: Ints
    size_byte: int

    @property
    def way(self) -> OneWay:
        """The settings, of which phases of a kind share all but the rate."""
        return self.phases[0].way

    @property
    def from_s(self) -> float:
        """Since when the direction has been so."""
        return to_s(self.phases[0].begin_ns)


class Observation(NamedTuple):
    """The traffic of one probe in one direction, and how it arrived."""

    reference: Reference
    traffic: Traffic
    arrivals: Arrivals

    def groups(self, key: Callable[[Phase], int]) -> Iterator[Group]:
        """The frames by kind of phase; kinds in which none was sent are not among them."""
        phases = self.reference.phases
        kind_of = np.array([key(phase) for phase in phases], dtype=np.int64)
        kinds = kind_of[self.traffic.phase]
        for kind in sorted(set(kinds.tolist())):
            chosen = kinds == kind
            of_kind = [phases[index] for index in np.flatnonzero(kind_of == kind)]
            size = int(self.traffic.size_byte[chosen][0])
            yield Group(chosen, of_kind, self.traffic.phase[chosen], size)

    def losses(self, way: OneWay, other: float, counted: Bools) -> LossLikelihood:
        """How likely losses are among those of the frames that count."""
        starts = np.array([phase.loss_start for phase in self.reference.phases], dtype=np.int64)
        return LossLikelihood(way.loss, other, starts[self.traffic.phase], counted)

    def left_out(self, name: str, unit: str, asked: Callable[[OneWay], float]) -> Lines:
        """A line for each kind in which the probe could not be made."""
        for phases, why in self.traffic.left_out:
            value = asked(phases[0].way) if phases else math.nan
            from_s = to_s(phases[0].begin_ns) if phases else 0.0
            yield from_s, unmeasured(name, unit, value, why)


def point(value: float) -> Interval:
    """A single value as a range."""
    return float(value), float(value)


def unmeasured(name: str, unit: str, asked: float, why: str) -> CheckLine:
    """A line for what could not be measured, with the reason in words."""
    return CheckLine(name, unit, 0, point(asked), math.nan, lambda _miss: point(math.nan), why)


def share_line(name: str, asked: float, hits: Bools, why: str = "") -> CheckLine:
    """How often something happened that happens to each frame independently.

    Args:
        name: of the impairment.
        asked: the probability.
        hits: for each frame, whether it happened.
        why: the reason if there are no frames.
    """
    found, count = int(hits.sum()), len(hits)
    if not count:
        return unmeasured(name, "share", asked, why or "no frame arrived that could show it")
    estimate = partial(share_interval, found, count)
    return CheckLine(name, "share", count, point(asked), found / count, estimate)


def exact_line(name: str, frames: int, asked: float, measured: float) -> CheckLine:
    """A value without randomness, measured exactly."""
    return CheckLine(name, "", frames, point(asked), float(measured), lambda _miss: point(measured))


def loss_line(name: str, way: OneWay, other: float, seen: Observation, counted: Bools) -> CheckLine:
    """The share of frames lost, perhaps in bursts.

    Args:
        name: of the impairment.
        way: the settings in which they were sent.
        other: probability that a frame spared by the loss model is lost nevertheless.
        seen: what was sent, and how it arrived.
        counted: which frames count.
    """
    lost = (~seen.arrivals.arrived[counted]).astype(float)
    asked = loss_statistics(way.loss, other)
    if isinstance(way.loss, float | int):
        estimate: Estimate = partial(share_interval, lost.sum(), len(lost))
        return CheckLine(name, "share", len(lost), point(asked.rate), float(lost.mean()), estimate)
    likelihood = seen.losses(way, other, counted)
    expected, rate = likelihood.expected_share(), asked.rate
    if abs(expected - rate) > _TRANSIENT * min(rate, 1 - rate):
        # So few frames, or so slow a chain, that it still shows in which state it began.
        rate = expected
    interval = partial(
        clustered_interval,
        batched(lost),
        batched(np.ones(len(lost))),
        clustering=asked.clustering,
    )
    estimate = believing(rate, interval, lambda: likelihood.chance(float(lost.sum())))
    return CheckLine(name, "share", len(lost), point(rate), float(lost.mean()), estimate)


def believing(asked: float, interval: Estimate, chance: Callable[[], float]) -> Estimate:
    """An interval that also holds the value asked for, unless what was seen is too improbable.

    Args:
        asked: that value.
        interval: the interval to widen.
        chance: an upper bound of the probability, given that value, of what was seen.
    """

    def widened(miss: float) -> Interval:
        low, high = interval(miss)
        if low <= asked <= high or chance() <= miss:
            return low, high
        return min(low, asked), max(high, asked)

    return widened


def batched(values: Floats) -> Floats:
    """Sums over batches of values, far longer than any burst of losses."""
    return np.array([part.sum() for part in np.array_split(values, _BATCHES)])


def short_byte(phase: Phase) -> int:
    """The size of a short frame: it fits into the queue, and bit errors do not lose every one."""
    return max(1, min(_SHORT_BYTE, phase.way.queue_byte, sparing_byte(phase.way)))


def sparing_byte(way: OneWay) -> int:
    """The size of a frame that has about one wrong bit, or any if there are hardly any."""
    if not way.bit_error_rate:
        return 1 << 62
    return math.ceil(1 / max(8 * way.bit_error_rate, 1e-15))


def bit_error_loss(way: OneWay, size_byte: int) -> float:
    """Probability that a frame is lost to bit errors; one in the overhead always loses it."""
    exposed = way.overhead_byte
    if way.bit_errors is BitErrorEffect.LOSE:
        exposed += size_byte
    return any_wrong(way.bit_error_rate, 8 * exposed)


def any_wrong(bit_error_rate: float, bits: int) -> float:
    """Probability that any of so many bits is wrong."""
    if bit_error_rate >= 1:
        return float(bits > 0)
    return -math.expm1(bits * math.log1p(-bit_error_rate))


def quantile(jitter: Jitter, probability: float) -> float:
    """The jitter in seconds that is not exceeded with this probability, 0 to 1."""
    return float(jitter_quantile(jitter, np.array(min(probability, 1 - 1e-15))))
