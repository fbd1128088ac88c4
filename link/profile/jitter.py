"""Distributions of jitter, as functions of a standard normal score.

Jitter is correlated as its scores are (a Gaussian copula), so that the distribution holds for any
correlation. Delays are whole nanoseconds.
"""

import math
from collections.abc import Callable, Iterable, Sequence

from farside.link.profile.impairments import TABLE_SCALE, Jitter, JitterShape
from farside.node import to_ns

GREATEST_NS = to_ns(1e9)
"""No jitter is longer, however heavy its tail; beyond any run, and within 64 bits."""

_FARTHEST_NS = 8 * GREATEST_NS  # with the greatest spread, exceeded once in 3,000 frames
_HEAVIEST = 100  # spreads, more than any score there is stands for

Sample = Callable[[Sequence[float]], list[int]]
"""Delays on top of the propagation, in nanoseconds, of frames with these scores."""

_SQRT_HALF = math.sqrt(0.5)
_PARETO_SCALE, _PARETO_MEAN = 4 / 3, 1.5
_PARETO_LEAST = _PARETO_SCALE * _PARETO_MEAN
_PARETO_POWER = -1 / 3


def sampler(jitter: Jitter) -> Sample:
    """The delays that scores stand for."""
    match jitter.shape:
        case JitterShape.UNIFORM:
            return _uniform(jitter)
        case JitterShape.EXPONENTIAL:
            return _exponential(jitter)
        case JitterShape.TABLE:
            return _from_table(jitter)
        case _:
            return _centred(jitter)


def table_ns(jitter: Jitter) -> list[int]:
    """The delays of a distribution table, each as likely as any other, in order."""
    mean_ns, step_ns = to_ns(jitter.mean_s), to_ns(jitter.spread_s) / TABLE_SCALE
    return _clipped(mean_ns + step_ns * entry for entry in sorted(jitter.table))


def deviation(shape: JitterShape, score: float) -> float:
    """The deviation x of a shape that has no table; see `JitterShape`."""
    return _deviations(shape, [score])[0]


def _deviations(shape: JitterShape, scores: Sequence[float]) -> Sequence[float]:
    # In loops of their own, which is twice as fast as a call for each.
    erfc, power = math.erfc, math.pow
    if shape is JitterShape.NORMAL:
        return scores
    # The probability of more, u, is ½·erfc(z/√2).
    if shape is JitterShape.PARETO:
        return [
            _PARETO_SCALE * power(0.5 * erfc(score * _SQRT_HALF), _PARETO_POWER) - _PARETO_LEAST
            for score in scores
        ]
    # (z + 3·4/3·(u^(−1/3) − 3/2))/4
    return [
        0.25 * score + power(0.5 * erfc(score * _SQRT_HALF), _PARETO_POWER) - _PARETO_MEAN
        for score in scores
    ]


def _clipped(delays_ns: Iterable[float]) -> list[int]:
    return [
        round(delay_ns) if 0.0 < delay_ns < GREATEST_NS else 0 if delay_ns <= 0 else GREATEST_NS
        for delay_ns in delays_ns
    ]


def _uniform(jitter: Jitter) -> Sample:
    # spread · Φ(x)
    half_ns, scale, erfc = to_ns(jitter.spread_s) * 0.5, -_SQRT_HALF, math.erfc
    return lambda scores: [round(half_ns * erfc(score * scale)) for score in scores]


def _exponential(jitter: Jitter) -> Sample:
    # −spread · ln(1 − Φ(x))
    spread_ns, erfc, log = to_ns(jitter.spread_s), math.erfc, math.log

    def sample(scores: Sequence[float]) -> list[int]:
        return [round(-spread_ns * log(0.5 * erfc(score * _SQRT_HALF))) for score in scores]

    if spread_ns * _HEAVIEST < _FARTHEST_NS:
        return sample
    return lambda scores: [min(delay_ns, _FARTHEST_NS) for delay_ns in sample(scores)]


def _centred(jitter: Jitter) -> Sample:
    mean_ns, spread_ns, shape = to_ns(jitter.mean_s), to_ns(jitter.spread_s), jitter.shape
    return lambda scores: _clipped(
        [mean_ns + spread_ns * deviation for deviation in _deviations(shape, scores)]
    )


def _from_table(jitter: Jitter) -> Sample:
    delays_ns, erfc = table_ns(jitter), math.erfc
    # Two entries from one random number: ⌊n·Φ(x)⌋, of which n occurs where Φ(x) rounds to 1.
    delays_ns.append(delays_ns[-1])
    scale, half = -_SQRT_HALF, len(delays_ns[:-1]) * 0.5
    return lambda scores: [delays_ns[int(half * erfc(score * scale))] for score in scores]
