"""Jitter in the shapes of tc-netem: each has its distribution, and nothing arrives too early."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats  # type: ignore[import-untyped]

from farside.link.channel.chance import JitterProcess
from farside.link.profile.impairments import Jitter, JitterShape
from farside.link.profile.jitter import GREATEST_NS, deviation, sampler, table_ns
from farside.link.profile.statistics import (
    Floats,
    jitter_below,
    jitter_cdf,
    jitter_quantile,
)
from farside.node import to_ns

SPREAD_S = 0.01
NORMAL = Jitter(spread_s=SPREAD_S, shape=JitterShape.NORMAL, mean_s=0.06)
PARETO = Jitter(spread_s=SPREAD_S, shape=JitterShape.PARETO, mean_s=0.01)
MIXED = Jitter(spread_s=SPREAD_S, shape=JitterShape.PARETONORMAL, mean_s=0.03)
TABLE = Jitter(
    spread_s=SPREAD_S, shape=JitterShape.TABLE, mean_s=0.02, table=(8192, -8192, 0, 4096, 4096)
)
HALF = Jitter(spread_s=SPREAD_S, shape=JitterShape.NORMAL)
ALL = [NORMAL, PARETO, MIXED, TABLE, HALF]


def drawn_ns(jitter: Jitter, count: int = 20_000, seed: int = 7) -> Floats:
    return np.array(JitterProcess(np.random.default_rng(seed)).draw(jitter, count), dtype=float)


def with_correlation(jitter: Jitter, correlation: float) -> Jitter:
    names = ("spread_s", "shape", "mean_s", "table")
    return Jitter(**{name: getattr(jitter, name) for name in names}, correlation=correlation)


@pytest.mark.parametrize("correlation", [0.0, 0.7])
def test_normal_jitter_is_normal_around_its_mean(correlation: float) -> None:
    delays = drawn_ns(with_correlation(NORMAL, correlation))[::20] / 1e9
    assert stats.kstest(delays, stats.norm(0.06, SPREAD_S).cdf).pvalue > 1e-4


@pytest.mark.parametrize("correlation", [0.0, -0.5])
def test_pareto_jitter_has_the_tail_of_the_third_power(correlation: float) -> None:
    delays = drawn_ns(with_correlation(PARETO, correlation))[::20] / 1e9
    # From two thirds of the spread below the mean on, which has 4/3 of it as scale.
    law = stats.lomax(3, loc=0.01 - SPREAD_S * 2 / 3, scale=SPREAD_S * 4 / 3)
    assert stats.kstest(delays, law.cdf).pvalue > 1e-4


def test_paretonormal_is_a_quarter_of_the_one_and_three_of_the_other() -> None:
    scores = np.linspace(-3, 3, 61)
    mixed = [deviation(JitterShape.PARETONORMAL, z) for z in scores]
    parts = [0.25 * z + 0.75 * deviation(JitterShape.PARETO, z) for z in scores]
    assert mixed == pytest.approx(parts)
    # As the middle and the quarters of iproute2's paretonormal.dist, to the 16 bits of its entries.
    quarters = [deviation(JitterShape.PARETONORMAL, stats.norm.ppf(p)) for p in (0.25, 0.5, 0.75)]
    assert [round(8192 * x) for x in quarters] == pytest.approx([-4653, -1967, 2097], abs=2)


def test_each_entry_of_a_table_is_as_likely_as_any_other() -> None:
    values, counts = np.unique(drawn_ns(TABLE), return_counts=True)
    assert values.tolist() == [to_ns(s) for s in (0.01, 0.02, 0.025, 0.03)]
    assert stats.chisquare(counts, np.array([1, 1, 2, 1]) / 5 * 20_000).pvalue > 1e-4


@pytest.mark.parametrize("score", [-9.0, 0.0, 9.0])
def test_no_score_is_beyond_a_table(score: float) -> None:
    assert sampler(TABLE)([score])[0] in table_ns(TABLE)


def test_half_of_a_normal_jitter_around_0_is_cut_off_and_the_mean_grows() -> None:
    delays = drawn_ns(HALF) / 1e9
    assert np.mean(delays == 0) == pytest.approx(0.5, abs=0.02)
    # ∫₀^∞ x·φ(x) dx = 1/√(2π), which the documents call 0.4 spreads.
    assert delays.mean() == pytest.approx(SPREAD_S / math.sqrt(2 * math.pi), rel=0.03)


def test_a_heavy_tail_stays_within_64_bits() -> None:
    huge = Jitter(spread_s=1e9, shape=JitterShape.PARETO)
    assert sampler(huge)([8.0]) == [GREATEST_NS]


@pytest.mark.parametrize("jitter", ALL, ids=lambda jitter: jitter.shape)
def test_the_distribution_function_is_that_of_what_is_drawn(jitter: Jitter) -> None:
    delays = np.sort(drawn_ns(jitter)) / 1e9
    steps = np.arange(len(delays) + 1) / len(delays)
    limit = math.sqrt(math.log(2 / 1e-4) / 2 / len(delays))
    assert (steps[1:] - jitter_cdf(jitter, delays)).max() < limit
    assert (jitter_below(jitter, delays) - steps[:-1]).max() < limit


@pytest.mark.parametrize("jitter", ALL, ids=lambda jitter: jitter.shape)
def test_the_quantile_is_the_inverse_of_the_distribution_function(jitter: Jitter) -> None:
    shares = np.linspace(0.01, 0.99, 99)
    delays = jitter_quantile(jitter, shares)
    assert (jitter_cdf(jitter, delays) >= shares - 1e-6).all()
    assert (jitter_below(jitter, delays) <= shares + 1e-6).all()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"mean_s": 1.0}, "expected mean_s with one of normal, pareto, paretonormal, table only"),
        ({"shape": "table"}, "expected a table by file or by table, found neither"),
        ({"shape": "table", "file": "a", "table": (1,)}, "by file or by table, found both"),
        ({"shape": "normal", "file": "a"}, 'expected file with shape = "table" only, found normal'),
    ],
)
def test_keys_that_do_not_belong_to_a_shape_are_refused(
    keys: dict[str, float | str | Sequence[int]], words: str
) -> None:
    shape = JitterShape(str(keys.pop("shape", "uniform")))
    with pytest.raises(ValueError, match=words):
        Jitter(spread_s=1.0, shape=shape, **keys)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [JitterShape.EXPONENTIAL, JitterShape.PARETO])
def test_no_jitter_is_longer_than_a_time_can_be_recorded(shape: JitterShape) -> None:
    [delay_ns] = sampler(Jitter(spread_s=1e9, shape=shape))([12.0])
    assert 10**18 <= delay_ns < 2**63
