"""How sure one can be of what was measured."""

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import jitter_quantile

Floats = NDArray[np.float64]
Interval = tuple[float, float]
"""Lowest and highest value that what was measured leaves likely."""


@cache
def _special() -> Any:
    """Imported here, for it takes long and most commands do without."""
    from scipy import special  # type: ignore[import-untyped] # noqa: PLC0415

    return special


def normal_scores(chances: Floats) -> Floats:
    """The values of a normal variable that are not exceeded with these chances."""
    scores: Floats = _special().ndtri(np.clip(chances, 1e-12, 1 - 1e-12))
    return scores


def share_interval(hits: float, trials: float, miss: float) -> Interval:
    """The chance behind `hits` of `trials` independent ones.

    Source: Clopper and Pearson (1934); it misses with a chance of at most `miss`.
    """
    if trials <= 0:
        return 0.0, 1.0
    low = _special().betaincinv(hits, trials - hits + 1, miss / 2) if hits > 0 else 0.0
    high = _special().betaincinv(hits + 1, trials - hits, 1 - miss / 2) if hits < trials else 1.0
    return float(low), float(high)


def clustered_interval(
    hits: Floats, trials: Floats, miss: float, clustering: float = 1.0
) -> Interval:
    """The chance behind hits that come in clusters, from batches far longer than these.

    The scatter between batches says how many independent trials they are worth; never taken to be
    more than one in `clustering` of those that there were. Source: Korn and Graubard (1998).
    """
    total, found = float(trials.sum()), float(hits.sum())
    share = found / total if total else 0.0
    if not 0 < share < 1:
        return share_interval(found / clustering, total / clustering, miss)
    batches = len(hits)
    scatter = batches / (batches - 1) * float(((hits - share * trials) ** 2).sum()) / total**2
    worth = share * (1 - share) / scatter if scatter > 0 else total
    worth *= (_special().ndtri(miss / 2) / _special().stdtrit(batches - 1, miss / 2)) ** 2
    worth = min(worth, total / clustering)
    return share_interval(share * worth, worth, miss)


def correlation_interval(first: Floats, second: Floats, miss: float) -> Interval:
    """The correlation of neighbours in a first-order Gaussian chain.

    Its estimate scatters with (1 − ρ²)/n; taken in Fisher's z so that it stays within −1 and 1.
    """
    rho = min(max(float(np.corrcoef(first, second)[0, 1]), -1 + 1e-9), 1 - 1e-9)
    reach = -_special().ndtri(miss / 2) / math.sqrt((1 - rho**2) * len(first))
    return math.tanh(math.atanh(rho) - reach), math.tanh(math.atanh(rho) + reach)


def kolmogorov_distance(chances: Floats) -> float:
    """Greatest distance of values from the distribution that gives them these chances."""
    ordered, count = np.sort(chances), len(chances)
    steps = np.arange(count + 1) / count
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def kolmogorov_limit(count: int, miss: float) -> float:
    """The distance that `count` right values exceed with a chance of `miss` at most.

    Source: Massart (1990), the Dvoretzky-Kiefer-Wolfowitz inequality; valid for any count.
    """
    return math.sqrt(math.log(2 / miss) / (2 * count))


def overtaking_chance(jitter: Jitter | None, lead_s: float) -> float:
    """The chance that a frame's jitter is less than `lead_s` above that of the one before it."""
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
