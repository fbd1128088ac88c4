"""Each equation three ways: a worked number, the closed form, and a loop without it."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem.equations import cost_estimate, reinforced, weakened

unit = st.floats(0.0, 1.0)
trials = st.integers(0, 60)


def repeated(rule: Callable[[float, float], float], cm: float, rate: float, times: int) -> float:
    for _ in range(times):
        cm = rule(cm, rate)
    return cm


def test_with_alpha_one_half_a_success_takes_cm_halfway_to_1() -> None:
    assert reinforced(0.5, 0.5) == 0.75


def test_with_alpha_1_one_success_is_certainty_and_with_alpha_0_it_changes_nothing() -> None:
    assert reinforced(0.3, 1.0) == 1.0
    assert reinforced(0.3, 0.0) == 0.3


@given(cm=unit, alpha=unit, n=trials)
def test_a_run_of_successes_has_the_closed_form(cm: float, alpha: float, n: int) -> None:
    expected = 1 - (1 - cm) * (1 - alpha) ** n
    assert repeated(reinforced, cm, alpha, n) == pytest.approx(expected, abs=1e-12)


@given(cm=unit, alpha=unit, n=trials)
def test_each_success_removes_the_fraction_alpha_of_the_distance_to_1(
    cm: float, alpha: float, n: int
) -> None:
    missing = 1 - cm
    for _ in range(n):
        missing -= missing * alpha
    assert repeated(reinforced, cm, alpha, n) == pytest.approx(1 - missing, abs=1e-12)


@given(cm=unit, alpha=unit)
def test_a_success_never_lowers_cm_or_takes_it_above_1(cm: float, alpha: float) -> None:
    assert cm <= reinforced(cm, alpha) <= 1.0


def test_with_beta_one_fifth_a_failure_removes_a_fifth_of_cm() -> None:
    assert weakened(0.5, 0.2) == 0.4


def test_with_beta_1_one_failure_takes_cm_to_0_and_with_beta_0_it_changes_nothing() -> None:
    assert weakened(0.3, 1.0) == 0.0
    assert weakened(0.3, 0.0) == 0.3


@given(cm=unit, beta=unit, n=trials)
def test_a_run_of_failures_has_the_closed_form(cm: float, beta: float, n: int) -> None:
    expected = cm * (1 - beta) ** n
    assert repeated(weakened, cm, beta, n) == pytest.approx(expected, abs=1e-12)


@given(cm=unit, beta=unit, n=trials)
def test_weakening_is_the_mirror_image_of_reinforcement(cm: float, beta: float, n: int) -> None:
    mirrored = 1 - repeated(reinforced, 1 - cm, beta, n)
    assert repeated(weakened, cm, beta, n) == pytest.approx(mirrored, abs=1e-12)


@given(cm=unit, beta=unit)
def test_a_failure_never_raises_cm_or_takes_it_below_0(cm: float, beta: float) -> None:
    assert 0.0 <= weakened(cm, beta) <= cm


def test_an_action_that_works_half_the_time_is_expected_to_cost_twice_as_much() -> None:
    assert cost_estimate(2.66, 0.5) == 5.32


def test_the_cost_estimate_of_a_certain_action_is_its_cost() -> None:
    assert cost_estimate(2.66, 1.0) == 2.66


@given(cm=st.floats(0.2, 1.0), cost=st.floats(0.1, 100.0))
def test_the_cost_estimate_is_the_mean_cost_of_trying_until_it_works(
    cm: float, cost: float
) -> None:
    mean = sum(n * cost * cm * (1 - cm) ** (n - 1) for n in range(1, 400))
    assert cost_estimate(cost, cm) == pytest.approx(mean)


@pytest.mark.parametrize("cm", [0.0, 5e-324])
def test_the_cost_estimate_of_what_never_works_is_infinite(cm: float) -> None:
    assert cost_estimate(2.66, cm) == math.inf
