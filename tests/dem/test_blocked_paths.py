"""Goals whose path is blocked: abandoned, or reached by a detour."""

import math
from collections.abc import Sequence
from functools import reduce

import numpy as np
import pytest
from goal_runs import drive, reached, reasons, suspended

from farside.dem import Aside, DynamicExpectancyModel
from farside.dem.lists.goals import Outlook
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread
from tests.dem.conftest import Grid, MakeModel, RunCycle


@pytest.fixture
def two_ways(grid: Grid) -> Grid:
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


def learn(model: DynamicExpectancyModel, world: Grid, actions: str) -> None:
    for action in actions:
        model.sense(world.tokens())
        model.perform(world.do(action))


GOAL = ("at:5,0",)


@pytest.mark.parametrize("seed", range(4))
def test_a_path_blocked_for_good_is_abandoned_and_exploration_finds_a_detour(
    make_model: MakeModel, two_ways: Grid, seed: int
) -> None:
    """Only the bottom row is known when a rock falls on it; the detour is over the top."""
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
        if model.goals[0].aside is Aside.BLOCKED:
            free_choices.append(choice)
        model.perform(two_ways.do(choice.action))
    # Blocked once; then it enters places from which no way is known, until it has found one.
    assert reasons(story)[0] is Aside.BLOCKED
    assert set(reasons(story)[1:]) == {Aside.UNREACHABLE}
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


def test_with_a_known_detour_even_a_long_one_the_goal_is_not_suspended(
    make_model: MakeModel, two_ways: Grid
) -> None:
    model = make_model()
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


def test_a_detour_many_times_as_long_as_the_path_is_still_taken(
    make_model: MakeModel, grid: Grid, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The neighbouring goal can no longer be entered from here, only from around a ring of 14."""
    ring = type(grid)("....", ".##.", ".##.", ".##.", "....")
    model = make_model()
    learn(model, ring, ("EEENNNNWWWSSSS" + "NNNNEEESSSSWWW") * 3)
    model.set_goal(["at:1,0"], priority=1.0)
    beside = ring.beside
    monkeypatch.setattr(
        ring,
        "beside",
        lambda place, action: place if (place, action) == ((0, 0), "E") else beside(place, action),
    )
    story = drive(model, ring, patience=60)
    assert reached(story) == [("at:1,0",)]
    assert suspended(story) == []
    assert len(story) - 1 > 13


class Walking:
    """What `Planner` tells of goals, by walking along the path of a new map each time."""

    def __init__(self, model: DynamicExpectancyModel, monkeypatch: pytest.MonkeyPatch) -> None:
        self._model = model
        monkeypatch.setattr(model._planner, "outlook", self.outlook)
        monkeypatch.setattr(model._planner, "detour", self.detour)

    def outlook(self, goal: tuple[str, ...], active: Sequence[int]) -> Outlook:
        model = self._model
        policy = PolicyMap(
            model._signs.find(goal),
            Spread(model._hypotheses, model._signs, model._parameters),
        )
        entry, action, costs = policy.entry(active), model._hypotheses.action, model._actions.costs
        steps = [] if entry is None else list(policy.walk(entry))
        self.next_step = steps[0] if steps else None
        # Summed up from the goal, as the policy value is.
        plan = reduce(lambda onward, arc: costs[action[arc]] + onward, reversed(steps), 0.0)
        return Outlook(policy.nearest(active), lambda: plan if steps else math.inf)

    def detour(self, goal: tuple[str, ...], active: Sequence[int]) -> Outlook:
        self.outlook(goal, active)
        cost, blocked = self._model._hypotheses.cost, self.next_step
        held, cost[blocked] = cost[blocked], math.inf
        found = self.outlook(goal, active)
        cost[blocked] = held
        return found


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_the_same_goals_are_blocked_in_the_same_cycles_as_by_walking_every_time(
    make_model: MakeModel, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Rocks fall and are taken away, goals are set anywhere, and at times the robot is led."""
    yard = Grid("....", ".##.", ".##.", ".##.", "....")
    rng, free = np.random.default_rng(seed), sorted(yard.places)
    models = [
        make_model(seed, break_multiple=1.5, recovery=7, ineffective=0.0, averaging=False)
        for _ in range(2)
    ]
    Walking(models[1], monkeypatch)
    blocked = asked = 0
    detour_of = models[0]._planner.detour

    def counted(goal: tuple[str, ...], active: Sequence[int]) -> Outlook:
        nonlocal asked
        asked += 1
        return detour_of(goal, active)

    monkeypatch.setattr(models[0]._planner, "detour", counted)
    for model in models:
        learn(model, yard, ("EEENNNNWWWSSSS" + "NNNNEEESSSSWWW") * 3)
    for _ in range(600):
        if rng.random() < 0.15:
            yard.places.symmetric_difference_update([free[rng.integers(len(free))], yard.at])
            yard.places.add(yard.at)
        goal, led = yard.token(free[rng.integers(len(free))]), rng.random() < 0.2
        if rng.random() < 0.2:
            for model in models:
                model.set_goal([goal], priority=1.0)
        told, walked = (model.sense(yard.tokens()) for model in models)
        assert told == walked
        blocked += reasons([told]).count(Aside.BLOCKED)
        chosen, by_walking = (model.choose() for model in models)
        assert chosen == by_walking
        action = str(rng.choice(list("NESW"))) if led else chosen.action
        yard.do(action)
        for model in models:
            model.perform(action)
    assert asked > blocked > 2


def test_leading_the_robot_away_from_its_goal_does_not_suspend_the_goal(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """Going east from `bog` works so rarely that the goal is ten times as far from there."""
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
