"""Distributions of jitter, as functions of a standard normal score.

Jitter is correlated as its scores are (a Gaussian copula), so that the distribution holds for any
correlation. Delays are whole nanoseconds.
"""

import math
from collections.abc import Callable, Sequence

from farside.link.profile.impairments import TABLE_SCALE, Jitter, JitterShape
from farside.node import to_ns

GREATEST_NS = to_ns(1e9)
"""No jitter is longer, however heavy its tail; beyond any run, and within 64 bits."""

Sample = Callable[[Sequence[float]], list[int]]
"""Delays on top of the propagation, in nanoseconds, of frames with these scores."""

_SQRT_HALF = math.sqrt(0.5)
_PARETO_SCALE, _PARETO_MEAN = 4 / 3, 1.5
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
    return [_clipped(mean_ns + step_ns * entry) for entry in sorted(jitter.table)]


def deviation(shape: JitterShape, score: float) -> float:
    """X of a shape that is a deviation without a table; see `JitterShape`."""
    if shape is JitterShape.NORMAL:
        return score
    # The probability of more, u, is ½·erfc(z/√2).
    pareto = math.pow(0.5 * math.erfc(score * _SQRT_HALF), _PARETO_POWER) - _PARETO_MEAN
    if shape is JitterShape.PARETO:
        return _PARETO_SCALE * pareto
    # (z + 3·4/3·(…))/4
    return 0.25 * score + pareto


def _clipped(delay_ns: float) -> int:
    return round(min(max(delay_ns, 0.0), GREATEST_NS))


def _uniform(jitter: Jitter) -> Sample:
    # spread · Φ(x)
    half_ns, scale, erfc = to_ns(jitter.spread_s) * 0.5, -_SQRT_HALF, math.erfc
    return lambda scores: [round(half_ns * erfc(score * scale)) for score in scores]


def _exponential(jitter: Jitter) -> Sample:
    # −spread · ln(1 − Φ(x))
    spread_ns, erfc, log = to_ns(jitter.spread_s), math.erfc, math.log
    return lambda scores: [
        round(-spread_ns * log(0.5 * erfc(score * _SQRT_HALF))) for score in scores
    ]


def _centred(jitter: Jitter) -> Sample:
    mean_ns, spread_ns, shape = to_ns(jitter.mean_s), to_ns(jitter.spread_s), jitter.shape
    return lambda scores: [
        _clipped(mean_ns + spread_ns * deviation(shape, score)) for score in scores
    ]


def _from_table(jitter: Jitter) -> Sample:
    delays_ns, erfc = table_ns(jitter), math.erfc
    # Two entries from one random number: ⌊n·Φ(x)⌋, of which n occurs where Φ(x) rounds to 1.
    delays_ns.append(delays_ns[-1])
    scale, half = -_SQRT_HALF, len(delays_ns[:-1]) * 0.5
    return lambda scores: [delays_ns[int(half * erfc(score * scale))] for score in scores]
