"""What the verdicts of the check rest on: loss statistics and confidence intervals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.link.check.intervals import clustered_interval, share_interval
from farside.link.profile.impairments import FourState, GilbertElliott
from farside.link.profile.statistics import loss_statistics

probabilities = st.floats(0.01, 0.99)


@settings(max_examples=40, deadline=None)
@given(probabilities, probabilities, probabilities, st.floats(0, 0.5), st.integers(0, 2**32))
def test_the_statistics_of_gilbert_elliott_match_the_closed_form(
    p: float, r: float, bad: float, good: float, seed: int
) -> None:
    """Rate and burst length."""
    found = loss_statistics(GilbertElliott(p=p, r=r, bad_loss=bad, good_loss=good))
    assert found.rate == pytest.approx((p * bad + r * good) / (p + r))
    simple = loss_statistics(GilbertElliott(p=p, r=r))
    assert simple.burst_length == pytest.approx(1 / r)


def test_four_states_with_p13_alone_have_the_statistics_of_independent_losses() -> None:
    """As in the manual page of tc-netem."""
    found = loss_statistics(FourState(p13=0.05))
    assert found.rate == pytest.approx(0.05)
    assert found.burst_length == pytest.approx(1 / 0.95)


def test_an_interval_misses_as_rarely_as_it_says() -> None:
    rng = np.random.default_rng(0)
    missed = 0
    for hits in rng.binomial(500, 0.05, size=2000):
        low, high = share_interval(hits, 500, 0.05)
        missed += not low <= 0.05 <= high
    assert missed < 0.06 * 2000


def test_an_interval_for_bursts_is_wider_than_one_that_assumes_independence() -> None:
    rng = np.random.default_rng(0)
    missed = naive = 0
    for _ in range(400):
        bursts = np.repeat(rng.random(2000) < 0.05, 10).astype(float)
        hits, trials = bursts.reshape(50, -1).sum(axis=1), np.full(50, 400.0)
        low, high = clustered_interval(hits, trials, 0.05)
        missed += not low <= 0.05 <= high
        low, high = share_interval(hits.sum(), trials.sum(), 0.05)
        naive += not low <= 0.05 <= high
    assert missed < 0.08 * 400 < 0.3 * 400 < naive
