"""The five lists on their own."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem import Goal, Parameters
from farside.dem.lists import (
    ActionList,
    GoalList,
    HypothesisList,
    PredictionList,
    SignList,
    to_sign,
)

tokens = st.frozensets(st.sampled_from("abcdef"), max_size=6).map(to_sign)
causes = st.tuples(st.integers(0, 3), st.integers(0, 1))
conjunctions = st.frozensets(st.sampled_from("abcdef"), min_size=2, max_size=4).map(to_sign)


def test_a_sign_is_its_tokens_once_each_and_sorted():
    assert to_sign(["b", "a", "b"]) == ("a", "b")


def test_a_string_is_not_taken_for_its_letters():
    with pytest.raises(TypeError, match=r"write \['at:A'\]"):
        to_sign("at:A")


def test_a_token_makes_its_sign_once():
    signs = SignList()
    assert signs.sense(("a", "b")) == ([0, 1], [0, 1])
    assert signs.sense(("b", "c")) == ([1, 2], [2])
    assert signs.names == [("a",), ("b",), ("c",)]


def test_a_conjunction_is_novel_when_first_active_not_when_made_known():
    signs = SignList()
    signs.add_conjunction(("a", "b"))
    signs.add_conjunction(("a", "b"))
    assert signs.sense(("a",)) == ([1], [1])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [0, 2])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [])


@given(known=st.lists(conjunctions), cycles=st.lists(tokens))
def test_active_are_exactly_the_signs_whose_tokens_are_all_sensed(known, cycles):
    signs = SignList()
    for sign in known:
        signs.add_conjunction(sign)
    seen = set()
    for sensed in cycles:
        active, novel = signs.sense(sensed)
        holds = [i for i, name in enumerate(signs.names) if set(name) <= set(sensed)]
        assert active == holds
        assert novel == [sign for sign in holds if sign not in seen]
        seen.update(holds)


def test_a_conjunction_is_looked_at_only_when_one_of_its_tokens_is_sensed():
    """With a Token that is in every conjunction, the watches fall on the others."""
    signs = SignList()
    for place in range(100):
        signs.add_conjunction(to_sign([f"at:{place}", "battery:ok"]))
    assert max(len(watched) for watched in signs._watched.values()) == 1


@pytest.mark.parametrize("cost", [0.0, -1.0, float("inf"), float("nan")])
def test_no_action_is_free_or_priceless(cost):
    with pytest.raises(ValueError, match="cost of action 'N': expected above 0, found"):
        ActionList({"N": cost})


def test_without_any_action_there_is_no_model():
    with pytest.raises(ValueError, match="one action at least"):
        ActionList({})


def test_actions_have_one_order_whatever_that_of_the_mapping():
    assert ActionList({"b": 1.0, "a": 2.0}).names == ActionList({"a": 2.0, "b": 1.0}).names


@given(st.lists(st.tuples(causes, st.integers(0, 3), st.integers(1, 2)), unique=True))
def test_both_indexes_of_hypotheses_hold_every_hypothesis_once_in_order_of_age(rows):
    hypotheses = HypothesisList(ActionList({"a": 1.0, "b": 2.0}), Parameters())
    for (context, action), outcome, delay in rows:
        assert not hypotheses.holds(context, action, outcome, delay)
        hypotheses.add(context, action, outcome, delay)
        assert hypotheses.holds(context, action, outcome, delay)
    for context in range(4):
        assert list(hypotheses.of_outcome(context)) == [
            i for i, row in enumerate(rows) if row[1] == context
        ]
        for action in range(2):
            assert list(hypotheses.of_cause(context, action)) == [
                i for i, row in enumerate(rows) if row[0] == (context, action)
            ]


@given(st.lists(st.tuples(st.integers(0, 2), st.booleans())))
def test_the_sum_of_cm_and_the_costs_follow_every_change_of_cm(trials):
    hypotheses = HypothesisList(ActionList({"a": 1.0, "b": 2.0}), Parameters())
    for outcome in range(3):
        hypotheses.add(0, outcome % 2, outcome, 1)
    for hypothesis, success in trials:
        hypotheses.corroborate(hypothesis, success=success)
    assert hypotheses.cm_sum == pytest.approx(sum(hypotheses.cm))
    for hypothesis, cost in enumerate([1.0, 2.0, 1.0]):
        assert hypotheses.cost[hypothesis] == cost / hypotheses.cm[hypothesis]


def test_the_revision_stands_still_when_certainty_is_confirmed():
    hypotheses = HypothesisList(ActionList({"a": 1.0}), Parameters(initial_cm=1.0))
    hypotheses.add(0, 0, 1, 1)
    before = hypotheses.revision
    hypotheses.corroborate(0, success=True)
    assert hypotheses.revision == before
    hypotheses.corroborate(0, success=False)
    assert hypotheses.revision > before


def test_a_prediction_falls_due_after_its_delay():
    predictions = PredictionList(reach=3)
    predictions.add(7, delay=1)
    predictions.add(8, delay=3)
    assert predictions.take_due() == [7]
    predictions.add(9, delay=2)
    assert predictions.take_due() == []
    assert predictions.take_due() == [8, 9]
    assert predictions.take_due() == []


def test_the_highest_goal_comes_first_and_ties_go_to_the_older():
    goals = GoalList()
    for name, priority in [("a", 1.0), ("b", 2.0), ("c", 1.0)]:
        goals.set((name,), priority)
    assert goals.ordered == (Goal(("b",), 2.0), Goal(("a",), 1.0), Goal(("c",), 1.0))


def test_a_changed_priority_leaves_a_goal_its_age():
    goals = GoalList()
    for name, priority in [("a", 1.0), ("b", 2.0), ("a", 2.0)]:
        goals.set((name,), priority)
    assert goals.ordered == (Goal(("a",), 2.0), Goal(("b",), 2.0))


def test_only_a_goal_that_is_there_is_withdrawn():
    goals = GoalList()
    goals.set(("a",), 0.0)
    assert goals.withdraw(("a",))
    assert not goals.withdraw(("a",))
    assert goals.ordered == ()


def test_all_goals_that_are_active_go_at_once():
    goals = GoalList()
    for sign in [("a",), ("a", "b"), ("a", "c")]:
        goals.set(sign, 1.0)
    assert goals.take_satisfied(("a", "b")) == (Goal(("a",), 1.0), Goal(("a", "b"), 1.0))
    assert goals.ordered == (Goal(("a", "c"), 1.0),)


@pytest.mark.parametrize("priority", [float("nan"), float("inf")])
def test_a_priority_without_an_order_is_refused(priority):
    with pytest.raises(ValueError, match="expected a finite number, found"):
        GoalList().set(("a",), priority)


def test_a_goal_without_tokens_is_refused():
    with pytest.raises(ValueError, match="one Token at least"):
        GoalList().set((), 1.0)


@pytest.mark.parametrize("name", ["alpha", "beta", "learning_probability", "initial_cm"])
@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_rates_and_chances_lie_between_0_and_1(name, value):
    with pytest.raises(ValueError, match=f"{name}: expected a number from 0 to 1, found"):
        Parameters(**{name: value})


@pytest.mark.parametrize("reach", [0, -1, 1.5])
def test_reach_is_a_whole_number_of_cycles(reach):
    with pytest.raises(ValueError, match="reach: expected a whole number of cycles, 1 or more"):
        Parameters(reach=reach)
