"""Numbers with 95 % intervals: means by percentile bootstrap, shares after Wilson."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest  # type: ignore[import-untyped]

RESAMPLES = 10_000


def mean_told(values: Sequence[float], digits: int = 0) -> str:
    """A mean with its interval, by percentile bootstrap over the values."""
    found = np.asarray(values, float)
    drawn = np.random.default_rng(0).integers(len(found), size=(RESAMPLES, len(found)))
    low, high = np.percentile(found[drawn].mean(axis=1), [2.5, 97.5])
    told = [f"{number:,.{digits}f}" for number in (found.mean(), low, high)]
    return told[0] if len({*told}) == 1 else "{} ({} to {})".format(*told)


def share_told(held: int, of: int, digits: int = 1) -> str:
    """A share in per cent with its interval, after Wilson."""
    low, high = binomtest(held, of).proportion_ci(method="wilson")
    share, *ends = (f"{number:.{digits}%}" for number in (held / of, low, high))
    return f"{share} ({ends[0]} to {ends[1]})"
