"""Confidence intervals for what was measured."""

import math
from functools import cache
from typing import Any

import numpy as np

from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_below, jitter_quantile

_HALVINGS = 60
_POINTS = 2000

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
    if math.isinf(clustering) or len(hits) < 2:
        return 0.0, 1.0
    if not 0 < share < 1:
        return share_interval(found / clustering, total / clustering, miss)
    batches = len(hits)
    scatter = batches / (batches - 1) * float(((hits - share * trials) ** 2).sum()) / total**2
    effective = share * (1 - share) / scatter if scatter > 0 else total
    effective *= (_special().ndtri(miss / 2) / _special().stdtrit(batches - 1, miss / 2)) ** 2
    effective = min(effective, total / clustering)
    return share_interval(share * effective, effective, miss)


def correlation_interval(first: Floats, second: Floats, asked: float, miss: float) -> Interval:
    """The correlation of neighbours in a first-order Gaussian process of mean 0 and variance 1.

    With S = Σ x·e over the pairs, where e is the new part of the second one, and V = Σ x², the
    means of exp(θ·S − θ²·V/2) are at most 1; mixed over θ they bound S for any correlation and
    length. Source: de la Peña, Klass and Lai (2004).

    Args:
        first: normal scores.
        second: those of their successors.
        asked: the correlation that gives the new part its variance.
        miss: with what probability the interval may miss that correlation.
    """
    squares = float(first @ first)
    rho = float(first @ second) / squares
    prior = len(first) / 20
    bound = (squares + prior) * (math.log(1 + squares / prior) - 2 * math.log(miss))
    reach = math.sqrt((1 - asked**2) * bound) / squares
    return max(-1.0, rho - reach), min(1.0, rho + reach)


def threshold_share(edge: float, correlation: float) -> float:
    """How often two normal scores with a correlation both exceed the quantile of `edge`.

    Source: Owen (1956): P = (1 − edge) − 2·T(h, √((1 − ρ)/(1 + ρ))), T being Owen's function.
    """
    slope = math.sqrt((1 - correlation) / (1 + correlation))
    return float(1 - edge - 2 * _special().owens_t(_special().ndtri(edge), slope))


def threshold_correlation(edge: float, share: float) -> float:
    """The inverse of `threshold_share`; −1 or 1 if it makes no share so small, or so great."""
    low, high = -1 + 1e-12, 1 - 1e-12
    if share <= threshold_share(edge, low):
        return -1.0
    if share >= threshold_share(edge, high):
        return 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if threshold_share(edge, middle) < share:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def kolmogorov_distance(below: Floats, above: Floats) -> float:
    """Kolmogorov-Smirnov distance of samples from a distribution; 0 if they can be of it.

    Args:
        below: the value of the distribution function at the least that each sample may stand for.
        above: the same at the greatest.
    """
    count = len(below)
    steps = np.arange(count + 1) / count
    over, under = steps[1:] - np.sort(above), np.sort(below) - steps[:-1]
    return max(0.0, float(over.max()), float(under.max()))


def kolmogorov_limit(count: int, miss: float) -> float:
    """The distance that `count` samples of the distribution exceed with probability `miss` at most.

    Source: Massart (1990), the Dvoretzky-Kiefer-Wolfowitz inequality; valid for
    any count.
    """
    return math.sqrt(math.log(2 / miss) / (2 * count))


def overtaking_probabilities(jitter: Jitter | None, leads_s: Floats) -> Floats:
    """Probabilities that a frame's jitter exceeds that of the frame before by less than a lead."""
    if jitter is None:
        return (leads_s > 0).astype(np.float64)
    leads, of_lead = np.unique(leads_s, return_inverse=True)
    rho, middle = jitter.correlation, (np.arange(_POINTS) + 0.5) / _POINTS
    before, before_s = _special().ndtri(middle), jitter_quantile(jitter, middle)

    def overtaking(lead_s: float) -> float:
        # Given the jitter before, the score of the next one is normal around ρ times that one's.
        score = _special().ndtri(jitter_below(jitter, before_s + lead_s))
        return float(_special().ndtr((score - rho * before) / math.sqrt(1 - rho**2)).mean())

    found = np.array([overtaking(lead_s) for lead_s in leads.tolist()])
    return found[of_lead]
