"""The Goal List on its own."""

import math
from collections.abc import Callable

import pytest

from farside.dem import Goal
from farside.dem.lists.goals import GoalList, Outlook

A, B, C = ("a",), ("b",), ("c",)


@pytest.fixture
def goals() -> GoalList:
    """A list that breaks a goal past four times its first value, for ten cycles."""
    return GoalList(break_multiple=4.0, recovery=10)


def names(goals: GoalList) -> list[tuple[str, ...]]:
    return [goal.tokens for goal in goals.ordered]


def promising(value: float, planned: float = 1.0) -> Callable[[object], Outlook]:
    """The same outlook for every goal."""
    return lambda _: Outlook(value, planned)


NO_DETOUR = promising(math.inf, math.inf)


def test_the_highest_goal_comes_first_and_ties_go_to_the_older(goals: GoalList) -> None:
    for sign, priority in [(A, 1.0), (B, 2.0), (C, 1.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (Goal(B, 2.0), Goal(A, 1.0), Goal(C, 1.0))
    assert goals.top == B


def test_a_changed_priority_leaves_a_goal_its_age(goals: GoalList) -> None:
    for sign, priority in [(A, 1.0), (B, 2.0), (A, 2.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (Goal(A, 2.0), Goal(B, 2.0))


def test_a_goal_that_was_withdrawn_and_set_again_is_the_younger(goals: GoalList) -> None:
    for sign in (A, B):
        goals.set(sign, 1.0)
    goals.withdraw(A)
    goals.set(A, 1.0)
    assert names(goals) == [B, A]


def test_only_a_goal_that_is_there_is_withdrawn(goals: GoalList) -> None:
    goals.set(A, 0.0)
    assert A in goals
    assert goals.withdraw(A)
    assert not goals.withdraw(A)
    assert A not in goals
    assert goals.ordered == ()
    assert goals.top is None


def test_all_goals_that_are_active_go_at_once(goals: GoalList) -> None:
    for sign in [("a",), ("a", "b"), ("a", "c")]:
        goals.set(sign, 1.0)
    assert goals.take_satisfied(("a", "b")) == (Goal(("a",), 1.0), Goal(("a", "b"), 1.0))
    assert goals.ordered == (Goal(("a", "c"), 1.0),)
    assert goals.take_satisfied(("a", "b")) == ()


@pytest.mark.parametrize("priority", [float("nan"), float("inf")])
def test_a_priority_without_an_order_is_refused(goals: GoalList, priority: float) -> None:
    with pytest.raises(ValueError, match="expected a finite number, found"):
        goals.set(A, priority)
    assert goals.ordered == ()


def test_a_goal_without_tokens_is_refused(goals: GoalList) -> None:
    with pytest.raises(ValueError, match="one Token at least"):
        goals.set((), 1.0)


# --- the break point ---------------------------------------------------------------------------


def test_a_goal_breaks_when_its_value_is_past_the_multiple_of_what_it_was(goals: GoalList) -> None:
    goals.set(A, 1.0)
    for value in (5.0, 12.0, 20.0):
        assert goals.suspend_broken(0, promising(value), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(3, promising(20.1), NO_DETOUR, on_course=True) == (A,)
    assert goals.ordered == (Goal(A, 1.0, suspended=True),)
    assert goals.top is None


def test_a_suspended_goal_lets_the_next_one_be_the_top(goals: GoalList) -> None:
    goals.set(A, 2.0)
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(50.0), NO_DETOUR, on_course=True) == (A,)
    assert goals.top == B
    assert goals.ordered == (Goal(B, 1.0), Goal(A, 2.0, suspended=True))


def test_all_that_are_past_their_break_points_are_suspended_at_once(goals: GoalList) -> None:
    """B was measured while it was the top-goal; then A came before it, and both broke."""
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.set(A, 2.0)
    goals.suspend_broken(1, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(2, promising(50.0), NO_DETOUR, on_course=True) == (A, B)
    assert goals.top is None


def test_a_suspended_goal_recovers_when_its_time_is_over_and_is_measured_anew(
    goals: GoalList,
) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(5, promising(50.0), NO_DETOUR, on_course=True)
    assert goals.recover(14) == ()
    assert goals.recover(15) == (A,)
    assert goals.recover(16) == ()
    assert goals.ordered == (Goal(A, 1.0),)
    assert goals.suspend_broken(15, promising(50.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(16, promising(200.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(17, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_setting_a_suspended_goal_again_does_not_end_its_suspension(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    goals.set(A, 3.0)
    assert goals.ordered == (Goal(A, 3.0, suspended=True),)


def test_a_suspended_goal_that_comes_about_is_satisfied(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    assert goals.take_satisfied(A) == (Goal(A, 1.0, suspended=True),)
    assert goals.recover(99) == ()


def test_a_goal_that_no_path_leads_to_waits_and_is_measured_when_one_does(goals: GoalList) -> None:
    goals.set(A, 1.0)
    for value in (math.inf, 50.0, math.inf, 200.0):
        assert goals.suspend_broken(0, promising(value), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(0, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_a_value_that_grew_while_led_away_is_the_new_measure(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(50.0), NO_DETOUR, on_course=False) == ()
    assert goals.suspend_broken(2, promising(200.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(3, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_being_led_nearer_leaves_the_measure_as_it_was(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(1, promising(5.0), NO_DETOUR, on_course=False)
    assert goals.suspend_broken(2, promising(200.0), NO_DETOUR, on_course=True) == ()


def test_a_long_way_round_that_would_go_as_planned_is_no_block(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(60.0, planned=15.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(2, promising(60.0, planned=14.9), NO_DETOUR, on_course=True) == (A,)
