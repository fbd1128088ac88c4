"""The Action List, the Hypothesis List and the Prediction List."""

import math
from collections.abc import Sequence
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem import Hypothesis, Parameters
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.lists.predictions import PredictionList

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
    """Apply the events; return the remaining rows by (c, a, o, delay), oldest first."""
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
def test_the_cost_of_an_action_is_finite_and_above_0(cost: float) -> None:
    with pytest.raises(ValueError, match="cost of action 'N': expected above 0, found"):
        ActionList({"N": cost})


def test_the_error_about_an_unknown_action_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="unknown action 'c': expected one of 'a', 'b'"):
        ActionList(COSTS).id_of("c")


def test_actions_are_ordered_by_name() -> None:
    actions = ActionList({"b": 2.0, "a": 1.0})
    assert actions.names == ["a", "b"]
    assert actions.costs == [1.0, 2.0]
    assert [actions.id_of(name) for name in actions.names] == [0, 1]


@given(events)
def test_each_chain_holds_its_hypotheses_once_and_in_order_of_age_after_any_removals(
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
def test_costs_and_the_sum_of_cm_follow_every_change(
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


def test_a_reused_row_keeps_nothing_of_the_removed_hypothesis(hypotheses: HypothesisList) -> None:
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


def test_a_hypothesis_is_the_last_of_its_outcome_once_the_others_are_removed(
    hypotheses: HypothesisList,
) -> None:
    rows = [hypotheses.add(context, 0, 3, 1, credit=0.5) for context in range(3)]
    assert not any(hypotheses.is_last_of(row) for row in rows)
    hypotheses.remove(rows[2])
    hypotheses.remove(rows[0])
    assert hypotheses.is_last_of(rows[1])
    hypotheses.add(2, 1, 3, 1, credit=0.5)
    assert not hypotheses.is_last_of(rows[1])


def test_every_result_moves_cm_but_only_a_success_that_stands_alone_raises_credit(
    hypotheses: HypothesisList,
) -> None:
    row = hypotheses.add(0, 0, 1, 1, credit=0.4)
    hypotheses.succeed(row, alone=False)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == (0.75, 0.4)
    hypotheses.succeed(row, alone=True)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == pytest.approx((5 / 6, 0.6))
    hypotheses.fail(row)
    assert (hypotheses.cm[row], hypotheses.credit[row]) == pytest.approx((5 / 8, 0.45))
    assert (hypotheses.predictions[row], hypotheses.successes[row]) == (3, 2)


def test_every_cost_change_is_noted_with_the_old_cost(hypotheses: HypothesisList) -> None:
    row = hypotheses.add(0, 1, 3, 1, credit=0.5)
    hypotheses.fail(row)
    hypotheses.remove(row)
    assert hypotheses.cost_changes == [
        CostChange(row, 0, 3, math.inf),
        CostChange(row, 0, 3, 2.0 / 0.5),
        CostChange(row, 0, 3, 2.0 / 0.25),
    ]


def test_only_creation_and_removal_change_the_structure(hypotheses: HypothesisList) -> None:
    row = hypotheses.add(0, 0, 1, 1, credit=0.5)
    made = hypotheses.structure
    hypotheses.succeed(row, alone=True)
    hypotheses.fail(row)
    assert hypotheses.structure == made
    hypotheses.remove(row)
    assert hypotheses.structure > made


def test_from_a_context_come_the_hypotheses_of_all_its_actions(hypotheses: HypothesisList) -> None:
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


def test_the_predictions_of_a_removed_hypothesis_are_dropped() -> None:
    predictions = PredictionList(reach=2)
    for hypothesis, delay in [(7, 1), (8, 1), (7, 2), (7, 1)]:
        predictions.add(hypothesis, delay)
    predictions.forget(7)
    assert predictions.take_due() == [8]
    assert predictions.take_due() == []
