"""The Goal List on its own, and stories of goals through the model."""

import math

import numpy as np
import pytest

from farside.dem import DynamicExpectancyModel, Goal, InherentGoal
from farside.dem.goals import GoalList, Outlook

A, B, C = ("a",), ("b",), ("c",)


@pytest.fixture
def goals():
    """A list that breaks a goal past four times its first value, for ten cycles."""
    return GoalList(break_multiple=4.0, recovery=10)


def names(goals):
    return [goal.tokens for goal in goals.ordered]


def promising(value, planned=1.0):
    """The same outlook for every goal."""
    return lambda _: Outlook(value, planned)


def test_the_highest_goal_comes_first_and_ties_go_to_the_older(goals):
    for sign, priority in [(A, 1.0), (B, 2.0), (C, 1.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (Goal(B, 2.0), Goal(A, 1.0), Goal(C, 1.0))
    assert goals.top == B


def test_a_changed_priority_leaves_a_goal_its_age(goals):
    for sign, priority in [(A, 1.0), (B, 2.0), (A, 2.0)]:
        goals.set(sign, priority)
    assert goals.ordered == (Goal(A, 2.0), Goal(B, 2.0))


def test_a_goal_that_was_withdrawn_and_set_again_is_the_younger(goals):
    for sign in (A, B):
        goals.set(sign, 1.0)
    goals.withdraw(A)
    goals.set(A, 1.0)
    assert names(goals) == [B, A]


def test_only_a_goal_that_is_there_is_withdrawn(goals):
    goals.set(A, 0.0)
    assert A in goals
    assert goals.withdraw(A)
    assert not goals.withdraw(A)
    assert A not in goals
    assert goals.ordered == ()
    assert goals.top is None


def test_all_goals_that_are_active_go_at_once(goals):
    for sign in [("a",), ("a", "b"), ("a", "c")]:
        goals.set(sign, 1.0)
    assert goals.take_satisfied(("a", "b")) == (Goal(("a",), 1.0), Goal(("a", "b"), 1.0))
    assert goals.ordered == (Goal(("a", "c"), 1.0),)
    assert goals.take_satisfied(("a", "b")) == ()


@pytest.mark.parametrize("priority", [float("nan"), float("inf")])
def test_a_priority_without_an_order_is_refused(goals, priority):
    with pytest.raises(ValueError, match="expected a finite number, found"):
        goals.set(A, priority)
    assert goals.ordered == ()


def test_a_goal_without_tokens_is_refused(goals):
    with pytest.raises(ValueError, match="one Token at least"):
        goals.set((), 1.0)


# --- the break point ---------------------------------------------------------------------------


def test_a_goal_breaks_when_its_value_is_past_the_multiple_of_what_it_was(goals):
    goals.set(A, 1.0)
    for value in (5.0, 12.0, 20.0):
        assert goals.suspend_broken(0, promising(value), on_course=True) == ()
    assert goals.suspend_broken(3, promising(20.1), on_course=True) == (A,)
    assert goals.ordered == (Goal(A, 1.0, suspended=True),)
    assert goals.top is None


def test_a_suspended_goal_lets_the_next_one_be_the_top(goals):
    goals.set(A, 2.0)
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    assert goals.suspend_broken(1, promising(50.0), on_course=True) == (A,)
    assert goals.top == B
    assert goals.ordered == (Goal(B, 1.0), Goal(A, 2.0, suspended=True))

    """B was measured while it came first; then A came before it, and the way to both broke."""


def test_all_that_are_past_their_break_points_are_suspended_at_once(goals):
    """B was measured while it was the top-goal; then A came before it, and both broke."""
    goals.set(B, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    goals.set(A, 2.0)
    goals.suspend_broken(1, promising(5.0), on_course=True)
    assert goals.suspend_broken(2, promising(50.0), on_course=True) == (A, B)
    assert goals.top is None


def test_a_suspended_goal_recovers_when_its_time_is_over_and_is_measured_anew(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    goals.suspend_broken(5, promising(50.0), on_course=True)
    assert goals.recover(14) == ()
    assert goals.recover(15) == (A,)
    assert goals.recover(16) == ()
    assert goals.ordered == (Goal(A, 1.0),)
    assert goals.suspend_broken(15, promising(50.0), on_course=True) == ()
    assert goals.suspend_broken(16, promising(200.0), on_course=True) == ()
    assert goals.suspend_broken(17, promising(201.0), on_course=True) == (A,)


def test_setting_a_suspended_goal_again_does_not_end_its_suspension(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    goals.suspend_broken(0, promising(50.0), on_course=True)
    goals.set(A, 3.0)
    assert goals.ordered == (Goal(A, 3.0, suspended=True),)


def test_a_suspended_goal_that_comes_about_is_satisfied(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    goals.suspend_broken(0, promising(50.0), on_course=True)
    assert goals.take_satisfied(A) == (Goal(A, 1.0, suspended=True),)
    assert goals.recover(99) == ()


def test_a_goal_that_no_path_leads_to_waits_and_is_measured_when_one_does(goals):
    goals.set(A, 1.0)
    for value in (math.inf, 50.0, math.inf, 200.0):
        assert goals.suspend_broken(0, promising(value), on_course=True) == ()
    assert goals.suspend_broken(0, promising(201.0), on_course=True) == (A,)


def test_a_value_that_grew_while_led_away_is_the_new_measure(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    assert goals.suspend_broken(1, promising(50.0), on_course=False) == ()
    assert goals.suspend_broken(2, promising(200.0), on_course=True) == ()
    assert goals.suspend_broken(3, promising(201.0), on_course=True) == (A,)


def test_being_led_nearer_leaves_the_measure_as_it_was(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(50.0), on_course=True)
    goals.suspend_broken(1, promising(5.0), on_course=False)
    assert goals.suspend_broken(2, promising(200.0), on_course=True) == ()


def test_a_long_way_round_that_would_go_as_planned_is_no_block(goals):
    goals.set(A, 1.0)
    goals.suspend_broken(0, promising(5.0), on_course=True)
    assert goals.suspend_broken(1, promising(60.0, planned=15.0), on_course=True) == ()
    assert goals.suspend_broken(2, promising(60.0, planned=14.9), on_course=True) == (A,)


# --- stories -----------------------------------------------------------------------------------


@pytest.fixture
def driven(make_model, corridor, cycle):
    """A model that knows a corridor both ways and stands at its west end."""
    model = make_model()
    for action in "EEEEEWWWWW" * 2:
        cycle(model, corridor.tokens(), corridor.do(action))
    return model


def drive(model, world, patience):
    """Leave the model alone until it has no goals: what was sensed."""
    story = []
    for _ in range(patience):
        story.append(model.sense(world.tokens()))
        if not model.goals:
            model.perform(None)
            return story
        model.perform(world.do(model.choose().action))
    raise AssertionError(f"{model.goals} not reached from {world.at} in {patience} cycles")


def reached(story):
    return [goal.tokens for sensed in story for goal in sensed.reached]


def suspended(story):
    return [sign for sensed in story for sign in sensed.suspended]


def test_several_goals_are_visited_in_their_order_and_those_on_the_way_in_passing(driven, corridor):
    for place, priority in [("at:0,0", 1.0), ("at:4,0", 2.0), ("at:1,0", 1.0), ("at:3,0", 2.0)]:
        driven.set_goal([place], priority)
    corridor.at = (2, 0)
    story = drive(driven, corridor, patience=20)
    assert reached(story) == [("at:3,0",), ("at:4,0",), ("at:1,0",), ("at:0,0",)]
    assert len(story) == 1 + 2 + 4


def test_the_robot_charges_while_its_battery_is_low_and_then_goes_on(corridor):
    """The battery runs low half way to the goal; it is full after two cycles on the charger."""
    charge = InherentGoal(when=("battery:low",), goal=("on_charge",), priority=2.5)
    costs = dict.fromkeys("NESW", 2.66)
    model = DynamicExpectancyModel(costs, rng=np.random.default_rng(0), inherent=[charge])

    def tokens(*, low=False):
        charger = ["on_charge"] if corridor.at == (0, 0) else []
        return [*corridor.tokens(), *charger, *(["battery:low"] if low else [])]

    for action in "EEEEEWWWWW" * 2:
        model.sense(tokens())
        model.perform(corridor.do(action))
    model.set_goal(["at:5,0"], priority=1.0)
    low, on_charger, story = False, 0, []
    for _ in range(20):
        low = on_charger < 2 and (low or corridor.at == (3, 0))
        sensed = model.sense(tokens(low=low))
        story.append((corridor.at[0], [goal.tokens for goal in sensed.reached]))
        on_charger += low and corridor.at == (0, 0)
        if not model.goals:
            break
        assert (charge.goal in [goal.tokens for goal in model.goals]) == (
            low and corridor.at != (0, 0)
        )
        stays = low and corridor.at == (0, 0)
        model.perform(None if stays else corridor.do(model.choose().action))
    assert [place for place, _ in story] == [0, 1, 2, 3, 2, 1, 0, 0, 0, 1, 2, 3, 4, 5]
    assert [(place, signs) for place, signs in story if signs] == [
        (0, [("on_charge",)]),
        (0, [("on_charge",)]),
        (5, [("at:5,0",)]),
    ]


def test_an_inherent_goal_is_given_up_with_its_trigger(make_model):
    rules = [InherentGoal(when=("dark",), goal=("lamp:on",), priority=1.0)]
    model = DynamicExpectancyModel({"press": 1.0}, rng=np.random.default_rng(0), inherent=rules)
    model.sense(["dark"])
    assert model.goals == (Goal(("lamp:on",), 1.0),)
    model.perform(None)
    assert model.sense(["dawn"]).reached == ()
    assert model.goals == ()


@pytest.fixture
def two_ways(grid):
    """Along the bottom it is 5 moves from the west end to the east end, over the top it is 13."""
    world = type(grid)(
        "....##",
        ".##.##",
        ".##.##",
        ".##.##",
        "......",
    )
    world.at = (0, 0)
    return world


def learn(model, world, actions):
    for action in actions:
        model.sense(world.tokens())
        model.perform(world.do(action))


GOAL = ("at:5,0",)


@pytest.mark.parametrize("seed", range(4))
def test_a_way_blocked_for_good_is_left_to_explore_until_a_detour_is_found(
    make_model, two_ways, seed
):
    """Only the bottom row is known when a rock falls on it; the way round is over the top."""
    model = make_model(seed, recovery=50)
    learn(model, two_ways, "EEEEEWWWWW" * 2)
    two_ways.places.remove((2, 0))
    model.set_goal(GOAL, priority=1.0)
    story, free_choices = [], []
    for _ in range(2000):
        story.append(model.sense(two_ways.tokens()))
        if story[-1].reached:
            break
        choice = model.choose()
        if model.goals[0].suspended:
            free_choices.append(choice)
        model.perform(two_ways.do(choice.action))
    broken = [cycle for cycle, sensed in enumerate(story) if sensed.suspended]
    recovered = [cycle for cycle, sensed in enumerate(story) if sensed.recovered]
    assert [later - earlier for earlier, later in zip(broken, recovered, strict=True)] == [50]
    assert [choice.goal for choice in free_choices] == [None] * 50
    assert {choice.action for choice in free_choices} == set("NESW")
    assert reached(story) == [GOAL]
    assert [sensed.tokens for sensed in story[-3:]] == [("at:3,0",), ("at:4,0",), GOAL]
    model.perform(None)
    two_ways.at = (0, 0)
    model.set_goal(GOAL, priority=1.0)
    again = drive(model, two_ways, patience=20)
    assert len(again) - 1 == two_ways.steps_to((5, 0))[0, 0] == 13
    assert suspended(again) == []


def test_a_long_detour_that_is_known_does_not_suspend_the_goal(make_model, two_ways):
    """Two failures at the rock are enough to turn to it, at more than twice the cost at first."""
    model = make_model(break_multiple=2.0, beta=0.8)
    learn(model, two_ways, "EEEEEWWNNNNWWWSSSS" * 6)
    two_ways.at = (0, 0)
    learn(model, two_ways, "NNNNEEESSSSEEWWWWW" * 6)
    model.set_goal(GOAL, priority=1.0)
    learn(model, two_ways, "E")
    two_ways.places.remove((2, 0))
    at_first = model.policy_path()[0].cost_to_go
    story = drive(model, two_ways, patience=60)
    assert reached(story) == [GOAL]
    assert suspended(story) == []
    assert two_ways.steps_to((5, 0))[1, 0] * 2.66 > 2.0 * at_first


def test_whoever_leads_the_robot_away_from_its_goal_does_not_suspend_it(make_model, cycle):
    """Going east from `bog` works so seldom that the goal is ten times as far from there."""
    model = make_model()
    path = [(["bog"], "E"), (["bank"], "E"), (["goal"], None)]
    for tokens, action in path[1:] * 4 + path:
        cycle(model, tokens, action)
    for _ in range(8):
        cycle(model, ["bog"], "E")
    cycle(model, ["bog"], None)
    cycle(model, ["bank"], None)
    model.set_goal(["goal"], priority=1.0)
    assert cycle(model, ["bank"], "W").suspended == ()
    near = next(row.value for row in model.policy_map() if row.sign == ("bank",))
    assert model.sense(["bog"]).suspended == ()
    far = model.choose()
    assert far.goal == ("goal",)
    assert far.cost_to_go > 4 * near
    assert far.cost_to_go > 4 * 2 * 2.66
