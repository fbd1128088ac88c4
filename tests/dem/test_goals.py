"""The Goal List on its own."""

import math
from collections.abc import Callable

import pytest

from farside.dem import Aside, Goal, Parameters
from farside.dem.lists.goals import GoalList, Outlook

A, B, C = ("a",), ("b",), ("c",)


@pytest.fixture
def goals() -> GoalList:
    """A list that puts a goal aside for ten cycles at more than four times its first value."""
    return GoalList(Parameters(break_multiple=4.0, recovery=10))


def goal(sign: tuple[str, ...], priority: float, aside: Aside | None = None) -> Goal:
    """A goal that only the operator wants."""
    return Goal(sign, {"operator": priority}, aside)


def names(goals: GoalList) -> list[tuple[str, ...]]:
    return [goal.tokens for goal in goals.ordered]


def promising(value: float, planned: float = 1.0) -> Callable[[object], Outlook]:
    """The same outlook for every goal."""
    return lambda _: Outlook(value, lambda: planned)


NO_DETOUR = promising(math.inf, math.inf)


def test_the_highest_goal_comes_first_and_ties_go_to_the_older(goals: GoalList) -> None:
    for sign, priority in [(A, 1.0), (B, 2.0), (C, 1.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (goal(B, 2.0), goal(A, 1.0), goal(C, 1.0))
    assert goals.top == B


def test_a_changed_priority_leaves_a_goal_its_age(goals: GoalList) -> None:
    for sign, priority in [(A, 1.0), (B, 2.0), (A, 2.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (goal(A, 2.0), goal(B, 2.0))


def test_a_goal_that_was_withdrawn_and_set_again_is_the_younger(goals: GoalList) -> None:
    for sign in (A, B):
        goals.set(sign, 1.0)
    goals.withdraw(A)
    goals.set(A, 1.0)
    assert names(goals) == [B, A]


def test_only_a_goal_on_the_list_can_be_withdrawn(goals: GoalList) -> None:
    goals.set(A, 0.0)
    assert A in goals
    assert goals.withdraw(A)
    assert not goals.withdraw(A)
    assert A not in goals
    assert goals.ordered == ()
    assert goals.top is None


def test_all_active_goals_are_satisfied_at_once(goals: GoalList) -> None:
    for sign in [("a",), ("a", "b"), ("a", "c")]:
        goals.set(sign, 1.0)
    assert goals.take_satisfied(("a", "b")) == (goal(("a",), 1.0), goal(("a", "b"), 1.0))
    assert goals.ordered == (goal(("a", "c"), 1.0),)
    assert goals.take_satisfied(("a", "b")) == ()


def test_of_several_sources_the_one_with_the_highest_priority_counts(goals: GoalList) -> None:
    goals.set(A, 1.0, "mission")
    goals.set(B, 2.0, "mission")
    goals.set(A, 3.0, "operator")
    assert goals.ordered == (
        Goal(A, {"mission": 1.0, "operator": 3.0}),
        Goal(B, {"mission": 2.0}),
    )
    assert [goal.priority for goal in goals.ordered] == [3.0, 2.0]
    assert goals.priorities(A) == {"mission": 1.0, "operator": 3.0}
    assert goals.priorities(C) == {}


def test_a_goal_stays_until_the_last_source_withdraws_it(goals: GoalList) -> None:
    goals.set(A, 1.0, "mission")
    goals.set(B, 2.0, "mission")
    goals.set(A, 3.0, "operator")
    assert not goals.withdraw(A, "robot")
    assert goals.withdraw(A, "operator")
    assert goals.ordered == (Goal(B, {"mission": 2.0}), Goal(A, {"mission": 1.0}))
    assert goals.withdraw(A, "mission")
    assert A not in goals


def test_a_source_that_changes_its_priority_leaves_that_of_the_others(goals: GoalList) -> None:
    goals.set(A, 3.0, "operator")
    goals.set(A, 1.0, "mission")
    goals.set(A, 0.5, "operator")
    assert goals.ordered == (Goal(A, {"operator": 0.5, "mission": 1.0}),)
    assert list(goals.ordered[0].priorities) == ["operator", "mission"]


def test_a_satisfied_goal_goes_for_all_sources(goals: GoalList) -> None:
    goals.set(A, 1.0, "mission")
    goals.set(A, 3.0, "operator")
    assert goals.take_satisfied(A) == (Goal(A, {"mission": 1.0, "operator": 3.0}),)
    assert goals.ordered == ()


def test_nobody_can_set_or_withdraw_a_goal_in_the_name_of_the_rules(goals: GoalList) -> None:
    goals.follow({A: 1.0}, B)
    with pytest.raises(ValueError, match=r"source of goal .*: expected any but 'rule'"):
        goals.set(A, 2.0, "rule")
    assert not goals.withdraw(A, "rule")
    assert goals.ordered == (Goal(A, {"rule": 1.0}),)


@pytest.mark.parametrize("priority", [float("nan"), float("inf")])
def test_a_priority_that_is_not_finite_is_refused(goals: GoalList, priority: float) -> None:
    with pytest.raises(ValueError, match="expected a finite number, found"):
        goals.set(A, priority)
    assert goals.ordered == ()


def test_a_goal_without_tokens_is_refused(goals: GoalList) -> None:
    with pytest.raises(ValueError, match="one Token at least"):
        goals.set((), 1.0)


# --- the break point ---------------------------------------------------------------------------


def test_a_goal_breaks_when_its_value_passes_the_multiple_of_its_first_value(
    goals: GoalList,
) -> None:
    goals.set(A, 1.0)
    for value in (5.0, 12.0, 20.0):
        assert goals.suspend_broken(0, promising(value), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(3, promising(20.1), NO_DETOUR, on_course=True) == (A,)
    assert goals.ordered == (goal(A, 1.0, Aside.BLOCKED),)
    assert goals.top is None


def test_when_the_top_goal_is_suspended_the_next_one_takes_its_place(goals: GoalList) -> None:
    goals.set(A, 2.0)
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(50.0), NO_DETOUR, on_course=True) == (A,)
    assert goals.top == B
    assert goals.ordered == (goal(B, 1.0), goal(A, 2.0, Aside.BLOCKED))


def test_all_goals_past_their_break_points_are_suspended_at_once(goals: GoalList) -> None:
    """B was measured as the top-goal; then A was put above it, and both broke."""
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.set(A, 2.0)
    goals.suspend_broken(1, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(2, promising(50.0), NO_DETOUR, on_course=True) == (A, B)
    assert goals.top is None


def test_a_suspended_goal_recovers_after_its_cycles_and_is_measured_anew(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(5, promising(50.0), NO_DETOUR, on_course=True)
    assert goals.recover(14) == ()
    assert goals.recover(15) == (A,)
    assert goals.recover(16) == ()
    assert goals.ordered == (goal(A, 1.0),)
    assert goals.suspend_broken(15, promising(50.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(16, promising(200.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(17, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_setting_a_suspended_goal_again_does_not_end_its_suspension(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    goals.set(A, 3.0)
    assert goals.ordered == (goal(A, 3.0, Aside.BLOCKED),)


def test_a_suspended_goal_that_becomes_active_is_satisfied(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    assert goals.take_satisfied(A) == (goal(A, 1.0),)
    assert goals.recover(99) == ()


def test_a_goal_without_a_path_waits_and_is_measured_once_there_is_one(goals: GoalList) -> None:
    goals.set(A, 1.0)
    for value in (math.inf, 50.0, math.inf, 200.0):
        assert goals.suspend_broken(0, promising(value), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(0, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_a_value_that_grew_while_the_robot_was_led_away_is_the_new_measure(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(50.0), NO_DETOUR, on_course=False) == ()
    assert goals.suspend_broken(2, promising(200.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(3, promising(201.0), NO_DETOUR, on_course=True) == (A,)


def test_leading_the_robot_nearer_leaves_the_measure_unchanged(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(50.0), NO_DETOUR, on_course=True)
    goals.suspend_broken(1, promising(5.0), NO_DETOUR, on_course=False)
    assert goals.suspend_broken(2, promising(200.0), NO_DETOUR, on_course=True) == ()


def test_a_long_detour_that_can_be_expected_to_succeed_is_no_block(goals: GoalList) -> None:
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), NO_DETOUR, on_course=True)
    assert goals.suspend_broken(1, promising(60.0, planned=15.0), NO_DETOUR, on_course=True) == ()
    assert goals.suspend_broken(2, promising(60.0, planned=14.9), NO_DETOUR, on_course=True) == (A,)
