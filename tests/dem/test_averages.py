"""C_m as an average of results: what equation 4 says of it, and how soon a change is noticed."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.dem import Parameters
from farside.dem.equations import IMPROBABLE, averaged, averaging_rate, cost_estimate
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList

COST = 2.0
DEFAULT = Parameters()
# In blocks, so that runs long enough to be a surprise occur.
blocks = st.lists(st.tuples(st.booleans(), st.integers(1, 30)), max_size=12)
courses = blocks.map(lambda drawn: [one for one, times in drawn for _ in range(times)])


def measures(results: Iterable[bool], parameters: Parameters = DEFAULT) -> Iterator[float]:
    """C_m of a new hypothesis after each result."""
    hypotheses = HypothesisList(ActionList({"go": COST}), parameters)
    row = hypotheses.add(0, 0, 1, 1, credit=parameters.initial_cm)
    for success in results:
        if success:
            hypotheses.succeed(row, alone=True)
        else:
            hypotheses.fail(row)
        hypotheses.cost_changes.clear()
        yield hypotheses.cm[row]


def failures_until(times: float, successes: int, parameters: Parameters = DEFAULT) -> int:
    """How many failures make a hypothesis so many times as dear, after so many successes."""
    course = measures([True] * successes + [False] * 200, parameters)
    *_, before = (next(course) for _ in range(successes))
    return next(failed for failed, cm in enumerate(course, start=1) if before / cm >= times)


def test_c_m_is_the_mean_of_what_it_was_at_first_and_of_all_results() -> None:
    assert list(measures([True, False, True])) == pytest.approx([1.5 / 2, 1.5 / 3, 2.5 / 4])


@given(courses)
def test_with_no_constant_rate_c_m_is_the_mean_since_a_run_that_was_as_good_as_impossible(
    course: list[bool],
) -> None:
    """Told by keeping all results, and looking back over the run at each of them."""
    cm, since, run = [0.5], [0.5], [1.0]
    for number, success in enumerate(course):
        odds = cm[-1] if success else 1.0 - cm[-1]
        if number and course[number - 1] == success:
            run.append(odds)
            if np.prod(run) < IMPROBABLE:
                since, run = [cm[-1]], [1.0]
        else:
            run = [odds]
        since.append(float(success))
        cm.append(float(np.mean(since)))
    found = list(measures(course, Parameters(alpha=0.0, beta=0.0)))
    assert found == pytest.approx(cm[1:])


@given(courses)
def test_where_no_run_is_impossible_c_m_is_the_mean_of_all_results(course: list[bool]) -> None:
    results = [0.5, *map(float, course)]
    means = [np.mean(results[: number + 1]) for number in range(1, len(results))]
    found = list(measures(course, Parameters(alpha=0.0, beta=0.0, improbable=0.0)))
    assert found == pytest.approx(means)


@given(course=courses, alpha=st.floats(0, 1), beta=st.floats(0, 1))
def test_a_success_never_lowers_c_m_a_failure_never_raises_it_and_it_stays_a_probability(
    course: list[bool], alpha: float, beta: float
) -> None:
    found = [0.5, *measures(course, Parameters(alpha=alpha, beta=beta))]
    for (before, after), success in zip(pairwise(found), course, strict=True):
        assert 0.0 <= after <= 1.0
        assert after >= before if success else after <= before


@settings(max_examples=50)
@given(alpha=st.floats(0, 1), beta=st.floats(0, 1), course=courses)
def test_without_averaging_the_rates_are_constant_from_the_first_result_on(
    alpha: float, beta: float, course: list[bool]
) -> None:
    cm, expected = 0.5, []
    for success in course:
        cm += alpha * (1.0 - cm) if success else -beta * cm
        expected.append(cm)
    constant = Parameters(alpha=alpha, beta=beta, averaging=False)
    assert list(measures(course, constant)) == pytest.approx(expected)


@pytest.mark.parametrize("tenths", range(1, 10))
def test_of_constant_chance_c_m_is_the_probability_and_c_e_the_cost_of_the_mean_number_of_attempts(
    tenths: int,
) -> None:
    """Both within 10 %, over a long time: at p = .1 they differ by 2 % and 6 %."""
    chance, count = tenths / 10, 200_000 // tenths
    drawn = (np.random.default_rng(tenths).random(count) < chance).tolist()
    cm, results, run = 0.5, 1, 1.0
    settled = []
    for success in drawn:
        results, run = averaged(results, run, cm if success else 1.0 - cm, 1.0 if success else -1.0)
        rate = averaging_rate(DEFAULT.alpha if success else DEFAULT.beta, results)
        cm += rate * (success - cm)
        settled.append(cm)
    late = np.array(settled[1000:])
    costs = [cost_estimate(COST, one) for one in late.tolist()]
    assert late.mean() == pytest.approx(chance, rel=0.1)
    assert np.mean(costs) == pytest.approx(COST / chance, rel=0.1)


def test_at_the_constant_rates_that_were_the_default_one_in_three_settles_at_more_than_half() -> (
    None
):
    """As the seed has it where α and β differ: twice the successes, half the attempts."""
    drawn = (np.random.default_rng(0).random(9000) < 1 / 3).tolist()
    late = list(measures(drawn, Parameters(plain=True)))[1000:]
    assert np.mean(late) == pytest.approx(0.56, abs=0.01)
    late = list(measures(drawn))[1000:]
    assert np.mean(late) == pytest.approx(0.33, abs=0.02)


def test_what_worked_sixty_times_and_is_blocked_costs_twice_as_much_after_two_failures() -> None:
    assert [failures_until(times, 60) for times in (2, 4, 8)] == [2, 4, 8]
    alone = Parameters(alpha=0.01, beta=0.01, averaging=False)
    assert failures_until(2, 60, alone) > 60


@pytest.mark.parametrize("successes", [3, 5, 8, 12, 20, 60, 200])
def test_a_blocked_way_is_given_up_as_soon_as_at_the_seeds_constant_rates(successes: int) -> None:
    for times in (2, 4, 8, 14):
        seed = failures_until(times, successes, Parameters(plain=True))
        assert failures_until(times, successes) <= seed + 2


def test_one_failure_of_what_never_failed_before_is_no_contradiction() -> None:
    *_, before, after = measures([True] * 1000 + [False])
    assert before - after < 0.011


def test_what_failed_for_long_and_works_again_is_believed_after_a_few_successes() -> None:
    course = [True] * 20 + [False] * 60 + [True] * 3
    assert list(measures(course))[-1] > 0.5


def test_a_change_that_is_no_run_is_followed_at_the_constant_rate() -> None:
    """From nine in ten to every other one: two thirds of the way in 100 results."""
    course = ([True] * 9 + [False]) * 30 + [True, False] * 50
    *_, after = measures(course)
    assert 0.5 + 0.4 / np.e == pytest.approx(after, abs=0.03)


def test_by_default_the_rates_are_those_that_go_with_averaging_or_with_its_absence() -> None:
    def rates(parameters: Parameters) -> tuple[float, float]:
        return parameters.alpha, parameters.beta

    assert rates(Parameters()) == (0.01, 0.01)
    assert rates(Parameters(averaging=False)) == rates(Parameters(plain=True)) == (0.5, 0.2)
    assert rates(Parameters(alpha=0.3)) == (0.3, 0.01)
    assert rates(Parameters(plain=True, beta=0.0)) == (0.5, 0.0)
