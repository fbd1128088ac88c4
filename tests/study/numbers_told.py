"""Numbers as the page tells them: means with intervals, ratios, tables."""

from collections.abc import Sequence

import numpy as np
from drawing import Estimate

RESAMPLES = 10_000


def estimate(values: Sequence[float]) -> Estimate:
    """The mean with its 95 % interval, by percentile bootstrap over the runs."""
    found = np.asarray(values, float)
    rng = np.random.default_rng(0)
    means = found[rng.integers(len(found), size=(RESAMPLES, len(found)))].mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return Estimate(float(found.mean()), float(low), float(high))


def told(value: Estimate, digits: int = 0) -> str:
    """An estimate in words: mean, and interval."""
    mean, low, high = (f"{number:,.{digits}f}" for number in value)
    return f"{mean} ({low} to {high})"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown; all columns but the first to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def ratio(parts: Sequence[float], wholes: Sequence[float]) -> Estimate:
    """The ratio of two sums, with its 95 % interval by percentile bootstrap over the runs."""
    above, below = np.asarray(parts, float), np.asarray(wholes, float)
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(above), size=(RESAMPLES, len(above)))
    shares = above[drawn].sum(axis=1) / np.maximum(below[drawn].sum(axis=1), 1e-9)
    low, high = np.percentile(shares, [2.5, 97.5])
    return Estimate(float(above.sum() / below.sum()), float(low), float(high))
