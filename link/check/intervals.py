"""Confidence intervals for what was measured."""

import math
from functools import cache
from typing import Any

import numpy as np

from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_quantile

Interval = tuple[float, float]
"""Lower and upper bound."""


@cache
def _special() -> Any:
    """`scipy.special`, imported on first use: it takes long, and most commands do without."""
    from scipy import special  # type: ignore[import-untyped] # noqa: PLC0415

    return special


def normal_scores(probabilities: Floats) -> Floats:
    """Standard normal quantiles of these probabilities."""
    scores: Floats = _special().ndtri(np.clip(probabilities, 1e-12, 1 - 1e-12))
    return scores


def share_interval(hits: float, trials: float, miss: float) -> Interval:
    """The probability behind `hits` in `trials` independent trials.

    Source: Clopper and Pearson (1934). It misses the true value with probability `miss` at most.
    """
    if trials <= 0:
        return 0.0, 1.0
    low = _special().betaincinv(hits, trials - hits + 1, miss / 2) if hits > 0 else 0.0
    high = _special().betaincinv(hits + 1, trials - hits, 1 - miss / 2) if hits < trials else 1.0
    return float(low), float(high)


def clustered_interval(
    hits: Floats, trials: Floats, miss: float, clustering: float = 1.0
) -> Interval:
    """The probability behind hits that come in clusters, from batches far longer than a cluster.

    The scatter between batches gives the effective number of independent trials, which is taken to
    be one in `clustering` of all trials at most. Source: Korn and Graubard (1998).

    Args:
        hits: their number in each batch.
        trials: their number in each batch.
        miss: with what probability the interval may miss the true value.
        clustering: how many trials carry as much information as an independent one.
    """
    total, found = float(trials.sum()), float(hits.sum())
    share = found / total if total else 0.0
    if not 0 < share < 1:
        return share_interval(found / clustering, total / clustering, miss)
    batches = len(hits)
    scatter = batches / (batches - 1) * float(((hits - share * trials) ** 2).sum()) / total**2
    effective = share * (1 - share) / scatter if scatter > 0 else total
    effective *= (_special().ndtri(miss / 2) / _special().stdtrit(batches - 1, miss / 2)) ** 2
    effective = min(effective, total / clustering)
    return share_interval(share * effective, effective, miss)


def correlation_interval(first: Floats, second: Floats, miss: float) -> Interval:
    """The correlation of neighbours in a first-order Gaussian process.

    The variance of its estimate is (1 − ρ²)/n; Fisher's z keeps the interval within −1 and 1.
    """
    rho = min(max(float(np.corrcoef(first, second)[0, 1]), -1 + 1e-9), 1 - 1e-9)
    reach = -_special().ndtri(miss / 2) / math.sqrt((1 - rho**2) * len(first))
    return math.tanh(math.atanh(rho) - reach), math.tanh(math.atanh(rho) + reach)


def kolmogorov_distance(probabilities: Floats) -> float:
    """Kolmogorov-Smirnov distance of samples from a distribution.

    Args:
        probabilities: the value of the distribution function at each sample.
    """
    ordered, count = np.sort(probabilities), len(probabilities)
    steps = np.arange(count + 1) / count
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def kolmogorov_limit(count: int, miss: float) -> float:
    """The distance that `count` samples of the distribution exceed with probability `miss` at most.

    Source: Massart (1990), the Dvoretzky-Kiefer-Wolfowitz inequality; valid for
    any count.
    """
    return math.sqrt(math.log(2 / miss) / (2 * count))


def overtaking_probability(jitter: Jitter | None, lead_s: float) -> float:
    """Probability that a frame's jitter exceeds that of the frame before by less than `lead_s`."""
    if jitter is None:
        return float(lead_s > 0)
    middle = (np.arange(1000) + 0.5) / 1000
    rho = jitter.correlation
    before = _special().ndtri(middle)[:, None]
    then = rho * before + math.sqrt(1 - rho**2) * _special().ndtri(middle)[None, :]
    gained = (
        jitter_quantile(jitter, _special().ndtr(then)) - jitter_quantile(jitter, middle)[:, None]
    )
    return float((gained < lead_s).mean())
