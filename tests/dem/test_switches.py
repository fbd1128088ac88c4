"""The rules of ours that concern goals and the map, each switched off alone and on again."""

import math

import msgspec
import pytest
from goal_runs import reasons
from policy_lists import Lists

from farside.dem import Aside, DynamicExpectancyModel, Parameters, ShadowModel
from tests.dem.conftest import COST, MOVES, Grid, MakeModel, RunCycle

BOTH, A, B, GOAL, NOWHERE = ("a", "b"), ("a",), ("b",), ("goal",), ("nowhere",)


def changed(model: DynamicExpectancyModel, **switches: bool) -> None:
    model.change(msgspec.structs.replace(model._parameters, **switches))


def learn(model: DynamicExpectancyModel, world: Grid, actions: str) -> None:
    for action in actions:
        model.sense(world.tokens())
        model.perform(world.do(action))


# --- whole implies parts -----------------------------------------------------------------------


def test_without_the_rule_a_map_is_the_bare_dijkstra_of_the_hypotheses() -> None:
    """E leads from `start` to `a b`, and from `a` to `goal`: a way if a whole is its parts."""
    lists = Lists(parameters=Parameters(whole_implies_parts=False))
    whole = lists.know(("a", "b"))
    lists.link(2, whole)
    lists.link(0, 3)
    assert lists.map(3).value == [1.0, math.inf, math.inf, 0.0, math.inf]
    assert lists.map(whole).value == [math.inf, math.inf, 1.0, math.inf, 0.0]


@pytest.fixture
def through_a_whole(make_model: MakeModel, cycle: RunCycle) -> DynamicExpectancyModel:
    """E led from `start` to `a b`, which is known, and from `a` to `goal`."""
    model = make_model(own_credit=False, removal=False)
    model.record_changes()
    model.set_goal(BOTH, priority=1.0)
    for tokens, action in [(["start"], "E"), (BOTH, None), (A, "E"), (GOAL, None), (["far"], "E")]:
        cycle(model, tokens, action)
    cycle(model, ["start"], None)
    # Only the way through the whole is to count.
    hypotheses = model._hypotheses
    for one in hypotheses.by_age():
        if model._signs.names[hypotheses.outcome[one]] in {A, B}:
            hypotheses.remove(one)
    return model


def test_changed_while_a_model_lives_it_holds_at_once_and_on_the_shadow(
    through_a_whole: DynamicExpectancyModel,
) -> None:
    model = through_a_whole
    model.set_goal(GOAL, priority=1.0)
    model.sense(["start"])
    shadow = ShadowModel(dict.fromkeys(MOVES, COST), model._parameters)
    for implies in (True, False, True):
        changed(model, whole_implies_parts=implies)
        shadow.agree(model._parameters)
        shadow.apply(model.take_delta())
        cost = 2 * COST / 0.5 if implies else math.inf
        assert model.cost_to(GOAL, ["start"]) == shadow.cost_to(GOAL, ["start"]) == cost
        assert model.cost_to(GOAL, BOTH) == shadow.cost_to(GOAL, BOTH) == COST / 0.5
        assert [goal.aside for goal in model.goals] == [None if implies else Aside.UNREACHABLE]
        assert (model.choose(explore=False) is None) == (not implies)
        assert model.policy_map() == shadow.policy_map()
        assert model.policy_path() == shadow.policy_path(["start"])


# --- goals put aside ---------------------------------------------------------------------------


def test_without_the_rule_a_goal_that_cannot_be_reached_is_the_top_goal(
    make_model: MakeModel, corridor: Grid
) -> None:
    model = make_model(put_aside=False)
    learn(model, corridor, "EEEEEWWWWW")
    model.set_goal(NOWHERE, priority=2.0)
    model.set_goal(["at:5,0"], priority=1.0)
    told = model.sense(corridor.tokens())
    assert told.suspended == ()
    assert [goal.aside for goal in model.goals] == [None, None]
    assert model.goals[0].tokens == NOWHERE
    assert model.choose().goal is None

    changed(model, put_aside=True)
    assert [goal.aside for goal in model.goals] == [None, Aside.UNKNOWN]
    assert model.choose().goal == ("at:5,0",)
    changed(model, put_aside=False)
    assert [goal.aside for goal in model.goals] == [None, None]
    assert model.choose().goal is None


def test_a_goal_waiting_without_a_way_is_told_as_taken_up_when_the_rule_goes(
    driven: DynamicExpectancyModel,
) -> None:
    driven.set_goal(NOWHERE, priority=2.0)
    assert reasons([driven.sense(["at:0,0"])]) == [Aside.UNKNOWN]
    changed(driven, put_aside=False)
    driven.perform(None)
    assert driven.sense(["at:0,0"]).recovered == (NOWHERE,)


@pytest.fixture
def driven(make_model: MakeModel, corridor: Grid) -> DynamicExpectancyModel:
    """A model that knows a corridor both ways; it stands at the west end."""
    model = make_model(recovery=1000, removal=False)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    return model


# --- the break point ---------------------------------------------------------------------------


def walled(model: DynamicExpectancyModel, corridor: Grid, cycles: int) -> list[Aside | None]:
    """Pursue the east end past a rock that fell in the corridor, and why it is aside."""
    model.set_goal(["at:5,0"], priority=1.0)
    corridor.places.discard((2, 0))
    aside = []
    for _ in range(cycles):
        model.sense(corridor.tokens())
        choice = model.choose()
        aside.append(model.goals[0].aside)
        model.perform(corridor.do(choice.action))
    return aside


def test_without_a_break_point_a_blocked_goal_is_pursued_for_ever(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    changed(driven, break_point=False)
    assert set(walled(driven, corridor, 40)) == {None}
    changed(driven, break_point=True)
    assert walled(driven, corridor, 3)[-1] is Aside.BLOCKED


def test_a_blocked_goal_is_taken_up_when_the_break_point_goes(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    assert walled(driven, corridor, 40)[-1] is Aside.BLOCKED
    driven.sense(corridor.tokens())
    for break_point in (False, True):
        changed(driven, break_point=break_point)
        assert [goal.aside for goal in driven.goals] == [None]
