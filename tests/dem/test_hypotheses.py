"""The Action List, the Hypothesis List and what it predicts, and the numbers it learns by."""

import math
from collections.abc import Sequence
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem import Curiosity, Hypothesis, Parameters
from farside.dem.learning.learner import PredictionList
from farside.dem.lists.hypotheses import ActionList, Change, HypothesisList

COSTS = {"a": 1.0, "b": 2.0}

rows = st.tuples(st.integers(0, 3), st.integers(0, 1), st.integers(0, 3), st.integers(1, 2))
events = st.lists(
    st.one_of(
        st.tuples(st.just("add"), rows),
        st.tuples(st.sampled_from(["remove", "succeed", "accompany", "fail"]), st.integers(0, 99)),
    ),
    max_size=40,
)


@pytest.fixture
def hypotheses() -> HypothesisList:
    return HypothesisList(ActionList(COSTS), Parameters())


def live(
    hypotheses: HypothesisList, events: Sequence[tuple[str, Any]]
) -> dict[tuple[int, ...], int]:
    """Do all this to the list, and return the rows that are left by (c, a, o, delay), by age."""
    left: dict[tuple[int, ...], int] = {}
    for event, what in events:
        if event == "add":
            assert hypotheses.holds(*what) == (what in left)
            if what not in left:
                left[what] = hypotheses.add(*cast("tuple[int, int, int, int]", what), credit=0.3)
        elif left:
            key = list(left)[what % len(left)]
            if event == "remove":
                hypotheses.remove(left.pop(key))
            elif event == "fail":
                hypotheses.fail(left[key])
            else:
                hypotheses.succeed(left[key], alone=event == "succeed")
    return left


@pytest.mark.parametrize("cost", [0.0, -1.0, float("inf"), float("nan")])
def test_no_action_is_free_or_priceless(cost: float) -> None:
    with pytest.raises(ValueError, match="cost of action 'N': expected above 0, found"):
        ActionList({"N": cost})


def test_without_any_action_there_is_no_model() -> None:
    with pytest.raises(ValueError, match="one action at least"):
        ActionList({})


def test_an_unknown_action_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="unknown action 'c': expected one of 'a', 'b'"):
        ActionList(COSTS).id_of("c")


def test_actions_have_one_order_whatever_that_of_the_mapping() -> None:
    actions = ActionList({"b": 2.0, "a": 1.0})
    assert actions.names == ("a", "b")
    assert actions.costs == (1.0, 2.0)
    assert [actions.id_of(name) for name in actions.names] == [0, 1]


@given(events)
def test_each_chain_holds_its_hypotheses_once_in_order_of_age_whatever_was_removed(
    events: Sequence[tuple[str, Any]],
) -> None:
    hypotheses = HypothesisList(ActionList(COSTS), Parameters())
    left = live(hypotheses, events)
    assert hypotheses.by_age() == list(left.values())
    assert hypotheses.count == len(left)
    for sign in range(5):
        ending = [row for (_, _, outcome, _), row in left.items() if outcome == sign]
        assert list(hypotheses.of_outcome(sign)) == ending
        for action in range(2):
            beginning = [row for (*cause, _, _), row in left.items() if cause == [sign, action]]
            assert list(hypotheses.of_cause(sign, action)) == beginning
        assert hypotheses.is_context(sign) == any(sign == c for c, _, _, _ in left)
    for (_, _, outcome, _), row in left.items():
        others = [key for key in left if key[2] == outcome and left[key] != row]
        assert hypotheses.is_last_of(row) == (not others)


@pytest.mark.parametrize("own_credit", [True, False])
@given(events=events)
def test_costs_and_the_sum_of_cm_are_kept_up_with_every_change(
    own_credit: bool, events: Sequence[tuple[str, Any]]
) -> None:
    hypotheses = HypothesisList(ActionList(COSTS), Parameters(own_credit=own_credit))
    left = live(hypotheses, events)
    assert hypotheses.cm_sum == pytest.approx(sum(hypotheses.cm[row] for row in left.values()))
    measure = hypotheses.credit if own_credit else hypotheses.cm
    for (_, action, _, _), row in left.items():
        assert hypotheses.cost[row] == [1.0, 2.0][action] / measure[row]
    gone = set(range(len(hypotheses))) - set(left.values())
    assert all(hypotheses.cost[row] == math.inf for row in gone)


def test_a_row_is_used_again_and_nothing_of_the_old_one_stays(hypotheses: HypothesisList) -> None:
    old = hypotheses.add(0, 0, 1, 1, credit=0.5)
    young = hypotheses.add(0, 0, 2, 1, credit=0.5)
    hypotheses.succeed(old, alone=True)
    hypotheses.remove(old)
    assert hypotheses.add(0, 0, 3, 2, credit=0.25) == old
    assert (len(hypotheses), hypotheses.count) == (2, 2)
    assert list(hypotheses.of_cause(0, 0)) == hypotheses.by_age() == [young, old]
    names = [("w",), ("x",), ("y",), ("z",)]
    assert hypotheses.named(names) == (
        Hypothesis(("w",), "a", ("y",), 1, 0.5, 0.5, 0, 0),
        Hypothesis(("w",), "a", ("z",), 2, 0.5, 0.25, 0, 0),
    )


def test_the_last_of_an_outcome_is_so_when_the_others_are_gone(hypotheses: HypothesisList) -> None:
    rows = [hypotheses.add(context, 0, 3, 1, credit=0.5) for context in range(3)]
    assert not any(hypotheses.is_last_of(row) for row in rows)
    hypotheses.remove(rows[2])
    hypotheses.remove(rows[0])
    assert hypotheses.is_last_of(rows[1])
    hypotheses.add(2, 1, 3, 1, credit=0.5)
    assert not hypotheses.is_last_of(rows[1])


def test_a_judgement_counts_and_credit_follows_only_a_success_that_stands_alone(
    hypotheses: HypothesisList,
) -> None:
    row = hypotheses.add(0, 0, 1, 1, credit=0.4)
    hypotheses.succeed(row, alone=False)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == (0.75, 0.4)
    hypotheses.succeed(row, alone=True)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == (0.875, 0.7)
    hypotheses.fail(row)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == pytest.approx((0.7, 0.56))
    assert (hypotheses.predictions[row], hypotheses.successes[row]) == (3, 2)


def test_the_map_is_told_what_each_change_made_of_which_cost(hypotheses: HypothesisList) -> None:
    row = hypotheses.add(0, 1, 3, 1, credit=0.5)
    hypotheses.fail(row)
    hypotheses.remove(row)
    assert hypotheses.changes == [
        Change(row, 0, 3, math.inf),
        Change(row, 0, 3, 2.0 / 0.5),
        Change(row, 0, 3, 2.0 / 0.4),
    ]


def test_only_coming_and_going_changes_the_structure(hypotheses: HypothesisList) -> None:
    row = hypotheses.add(0, 0, 1, 1, credit=0.5)
    made = hypotheses.structure
    hypotheses.succeed(row, alone=True)
    hypotheses.fail(row)
    assert hypotheses.structure == made
    hypotheses.remove(row)
    assert hypotheses.structure > made


def test_from_a_context_leads_what_any_action_makes_active(hypotheses: HypothesisList) -> None:
    rows = [hypotheses.add(1, action, 2, 1, credit=0.5) for action in (1, 0)]
    hypotheses.add(2, 0, 1, 1, credit=0.5)
    assert list(hypotheses.from_context(1)) == rows[::-1]


def test_a_prediction_falls_due_after_its_delay() -> None:
    predictions = PredictionList(reach=3)
    predictions.add(7, delay=1)
    predictions.add(8, delay=3)
    assert predictions.take_due() == [7]
    predictions.add(9, delay=2)
    assert predictions.take_due() == []
    assert predictions.take_due() == [8, 9]
    assert predictions.take_due() == []


def test_the_predictions_of_a_hypothesis_that_is_no_more_are_dropped() -> None:
    predictions = PredictionList(reach=2)
    for hypothesis, delay in [(7, 1), (8, 1), (7, 2), (7, 1)]:
        predictions.add(hypothesis, delay)
    predictions.forget(7)
    assert predictions.take_due() == [8]
    assert predictions.take_due() == []


@pytest.mark.parametrize(
    "name", ["alpha", "beta", "learning_probability", "initial_cm", "ineffective"]
)
@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_rates_and_chances_lie_between_0_and_1(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name}: expected a number from 0 to 1, found"):
        Parameters(**{name: cast("Any", value)})


@pytest.mark.parametrize(
    ("name", "unit"), [("reach", "cycles"), ("maturity", "predictions"), ("recovery", "cycles")]
)
@pytest.mark.parametrize("value", [0, -1, 1.5])
def test_what_is_counted_is_a_whole_number(name: str, unit: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name}: expected a whole number of {unit}, 1 or more"):
        Parameters(**{name: cast("Any", value)})


@pytest.mark.parametrize("value", [1.0, -4.0, float("nan")])
def test_a_goal_breaks_only_when_its_value_has_grown(value: float) -> None:
    with pytest.raises(ValueError, match="break_multiple: expected above 1, found"):
        Parameters(break_multiple=value)


@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_trying_something_new_is_expected_to_cost_something(value: float) -> None:
    with pytest.raises(ValueError, match="optimistic_cost: expected above 0, found"):
        Curiosity(optimistic_cost=value)


@pytest.mark.parametrize("value", [-1.0, float("inf"), float("nan")])
def test_restlessness_is_a_finite_number_of_zero_or_more(value: float) -> None:
    with pytest.raises(ValueError, match="restlessness: expected 0 or more, found"):
        Curiosity(restlessness=value)
