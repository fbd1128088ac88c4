"""Goals that cannot be reached are put aside for others, and taken up again once they can be."""

import msgspec
import numpy as np
import pytest
from goal_runs import drive, reached, reasons

from farside.dem import (
    Aside,
    DynamicExpectancyModel,
    Exploration,
    Goal,
    InherentGoal,
    Parameters,
    Sensed,
)
from tests.dem.conftest import Grid, MakeModel, RunCycle

NOWHERE, WEST, EAST = ("at:nowhere",), ("at:0,0",), ("at:5,0",)
UNKNOWN, UNREACHABLE, BLOCKED = Aside.UNKNOWN, Aside.UNREACHABLE, Aside.BLOCKED


def goal(sign: tuple[str, ...], priority: float, aside: Aside | None = None) -> Goal:
    return Goal(sign, {"operator": priority}, aside)


def learn(model: DynamicExpectancyModel, world: Grid, actions: str) -> None:
    for action in actions:
        model.sense(world.tokens())
        model.perform(world.do(action))


@pytest.fixture
def driven(make_model: MakeModel, corridor: Grid) -> DynamicExpectancyModel:
    """A model that knows a corridor both ways, and an island where it was not led there.

    It stands at the west end.
    """
    model = make_model()
    model.sense(["island"])
    model.perform(None)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    return model


def test_an_unknown_goal_does_not_starve_a_lower_one_that_can_be_reached(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    driven.set_goal(NOWHERE, priority=9.0)
    driven.set_goal(EAST, priority=1.0)
    story = []
    for _ in range(6):
        story.append(driven.sense(corridor.tokens()))
        if not story[-1].reached:
            choice = driven.choose()
            assert (choice.goal, choice.action) == (EAST, "E")
            corridor.do(choice.action)
        driven.perform("E")
    assert reached(story) == [EAST]
    assert driven.goals == (goal(NOWHERE, 9.0, UNKNOWN),)


def test_a_goal_to_which_no_way_is_known_waits_until_there_is_one(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """The robot was carried from `shed` to `yard`, and finds the door between them later."""
    model = make_model()
    for tokens, action in [(["shed"], None), (["yard"], "E"), (["gate"], "W"), (["yard"], None)]:
        cycle(model, tokens, action)
    model.set_goal(["shed"], priority=2.0)
    model.set_goal(["gate"], priority=1.0)
    assert model.goals == (goal(("gate",), 1.0), goal(("shed",), 2.0, UNREACHABLE))

    told = model.sense(["yard"])
    assert told.suspended == (goal(("shed",), 2.0, UNREACHABLE),)
    assert model.choose().goal == ("gate",)
    model.perform("N")
    found = cycle(model, ["shed"], "S")
    assert found.reached == (goal(("shed",), 2.0),)
    assert found.suspended == (goal(("gate",), 1.0, UNREACHABLE),)
    model.set_goal(["shed"], priority=2.0)
    back = model.sense(["yard"])
    assert (back.suspended, back.recovered) == ((), (("gate",),))
    choice = model.choose()
    assert (choice.goal, choice.action) == (("shed",), "N")


def test_a_goal_put_aside_is_told_once_and_so_is_its_return(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """From `bog` no way out is known until the robot has left it by chance."""
    model = make_model()
    cycle(model, ["bank"], "E")
    cycle(model, ["goal"], None)
    model.set_goal(["goal"], priority=1.0)
    places = ["bank", "bog", "bog", "bog", "bank", "bog"]
    actions = ["S", "N", "E", "W", "S", None]
    story = [cycle(model, [p], a) for p, a in zip(places, actions, strict=True)]

    aside = (goal(("goal",), 1.0, UNREACHABLE),)
    assert [sensed.suspended for sensed in story] == [(), aside, (), (), (), ()]
    assert [sensed.recovered for sensed in story] == [(), (), (), (), (("goal",),), ()]


def test_a_goal_that_is_set_again_is_told_again(driven: DynamicExpectancyModel) -> None:
    for _ in range(2):
        driven.set_goal(NOWHERE, priority=1.0)
        assert driven.sense(WEST).suspended == (goal(NOWHERE, 1.0, UNKNOWN),)
        driven.perform(None)
        driven.withdraw_goal(NOWHERE)
        gone = driven.sense(WEST)
        assert (gone.suspended, gone.recovered) == ((), ())
        driven.perform(None)


def test_a_goal_reached_while_aside_is_reached_and_no_more_than_that(
    driven: DynamicExpectancyModel,
) -> None:
    driven.set_goal(NOWHERE, priority=1.0)
    driven.sense(WEST)
    driven.perform("E")
    sensed = driven.sense(NOWHERE)
    assert sensed.reached == (goal(NOWHERE, 1.0),)
    assert (sensed.suspended, sensed.recovered) == ((), ())


def test_setting_and_withdrawing_goals_is_right_at_once(driven: DynamicExpectancyModel) -> None:
    driven.sense(WEST)

    def now() -> list[tuple[str, ...] | None]:
        choice, why, path = driven.choose(explore=False), driven.why(), driven.policy_path()
        assert (choice is None) == (why is None) == (path == ())
        assert choice is None or choice.action == why.action == path[0].action
        return [*(one.tokens for one in driven.goals), choice.goal if choice else None]

    assert now() == [None]
    driven.set_goal(["island"], priority=3.0)
    assert now() == [("island",), None]
    driven.set_goal(EAST, priority=1.0)
    assert now() == [EAST, ("island",), EAST]
    driven.set_goal(["at:2,0"], priority=2.0)
    assert now() == [("at:2,0",), EAST, ("island",), ("at:2,0",)]
    driven.withdraw_goal(["at:2,0"])
    assert now() == [EAST, ("island",), EAST]
    driven.withdraw_goal(EAST)
    assert now() == [("island",), None]


def test_before_the_first_sense_nothing_can_be_said_of_a_goal(make_model: MakeModel) -> None:
    model = make_model()
    model.set_goal(NOWHERE, priority=1.0)
    model.set_goal(["a", "b"], priority=1.0)
    assert [one.aside for one in model.goals] == [None, None]
    told = model.sense([])
    assert reasons([told]) == [UNKNOWN, UNREACHABLE]


def test_a_goal_below_the_top_goal_is_looked_at_when_its_turn_comes(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    """That no way leads to the island is found once the east end is reached."""
    driven.set_goal(EAST, priority=2.0)
    driven.set_goal(["island"], priority=1.0)
    story = []
    for _ in range(6):
        story.append(driven.sense(corridor.tokens()))
        driven.perform(None if story[-1].reached else corridor.do("E"))
    assert reasons(story[:5]) == []
    assert story[5].reached == (goal(EAST, 2.0),)
    assert story[5].suspended == (goal(("island",), 1.0, UNREACHABLE),)


def test_its_turn_comes_as_well_when_the_top_goal_is_withdrawn(
    driven: DynamicExpectancyModel,
) -> None:
    driven.sense(WEST)
    driven.set_goal(EAST, priority=2.0)
    driven.set_goal(["island"], priority=1.0)
    assert [one.aside for one in driven.goals] == [None, None]
    driven.withdraw_goal(EAST)
    assert driven.goals == (goal(("island",), 1.0, UNREACHABLE),)


def test_a_goal_put_aside_stays_so_below_one_that_is_pursued(
    driven: DynamicExpectancyModel,
) -> None:
    driven.set_goal(["island"], priority=1.0)
    driven.sense(WEST)
    driven.set_goal(EAST, priority=2.0)
    assert driven.goals == (goal(EAST, 2.0), goal(("island",), 1.0, UNREACHABLE))
    driven.perform("E")
    assert driven.sense(["at:1,0"]).recovered == ()


def test_of_goals_put_aside_the_highest_comes_first_behind_those_pursued(
    driven: DynamicExpectancyModel,
) -> None:
    driven.sense(WEST)
    for sign, priority in [(["x"], 3.0), (["at:4,0"], 0.0), (["y", "z"], 4.0), (EAST, 1.0)]:
        driven.set_goal(sign, priority)
    assert driven.goals == (
        goal(EAST, 1.0),
        goal(("at:4,0",), 0.0),
        goal(("y", "z"), 4.0, UNREACHABLE),
        goal(("x",), 3.0, UNKNOWN),
    )


def test_a_rule_whose_goal_is_unknown_does_not_starve_the_operators(corridor: Grid) -> None:
    """The rover is low, and was never on a charger."""
    charge = InherentGoal(when=("battery:low",), goal=("on_charge",), priority=9.0)
    costs = dict.fromkeys("NESW", 2.66)
    model = DynamicExpectancyModel(costs, rng=np.random.default_rng(0), inherent=[charge])
    learn(model, corridor, "EEEEEWWWWW" * 2)
    model.set_goal(EAST, priority=1.0)
    told = model.sense([*corridor.tokens(), "battery:low"])
    assert told.suspended == (Goal(("on_charge",), {"rule": 9.0}, UNKNOWN),)
    assert model.choose().goal == EAST


def test_when_a_blocked_goal_gives_way_a_lower_one_is_pursued_past_one_without_a_way(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    """A rock falls in the corridor on the way east, to the island no way is known: west is next."""
    corridor.at = (1, 0)
    corridor.places.remove((2, 0))
    for sign, priority in [(EAST, 3.0), (("island",), 2.0), (WEST, 1.0)]:
        driven.set_goal(sign, priority)
    story: list[Sensed] = []
    while not any(sensed.suspended for sensed in story):
        story.append(driven.sense(corridor.tokens()))
        choice = driven.choose()
        driven.perform(corridor.do(choice.action))
    assert story[-1].suspended == (goal(EAST, 3.0, BLOCKED), goal(("island",), 2.0, UNREACHABLE))
    assert choice.goal == WEST
    assert reached([driven.sense(corridor.tokens())]) == [WEST]


def test_a_loaded_model_knows_what_was_told(driven: DynamicExpectancyModel) -> None:
    driven.set_goal(NOWHERE, priority=1.0)
    driven.sense(WEST)
    driven.perform(None)
    driven.set_goal(["x", "y"], priority=1.0)
    loaded = DynamicExpectancyModel.load(driven.save())
    assert loaded.goals == driven.goals
    assert loaded.sense(WEST) == driven.sense(WEST)
    loaded.perform(None)
    assert reasons([loaded.sense(WEST)]) == []


# --- exploration -------------------------------------------------------------------------------


def drawn(model: DynamicExpectancyModel) -> float:
    """What the model's random generator would give next."""
    return float(DynamicExpectancyModel.load(model.save())._rng.random())


def test_a_model_that_does_not_explore_has_nothing_to_do_without_a_way(
    make_model: MakeModel, corridor: Grid
) -> None:
    model = make_model(exploration=Exploration.NONE)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    model.sense(WEST)
    before = drawn(model)
    assert model.choose() is None
    model.set_goal(NOWHERE, priority=1.0)
    assert model.choose() is None
    assert drawn(model) == before
    model.set_goal(EAST, priority=0.5)
    assert model.choose().goal == EAST


def test_it_goes_to_its_goals_as_any_other(make_model: MakeModel, corridor: Grid) -> None:
    model = make_model(exploration=Exploration.NONE)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    model.set_goal(EAST, priority=1.0)
    assert len(drive(model, corridor, patience=6)) == 6


@pytest.mark.parametrize("exploration", Exploration)
def test_any_model_can_be_asked_not_to_explore(
    make_model: MakeModel, corridor: Grid, exploration: Exploration
) -> None:
    model = make_model(exploration=exploration)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    model.sense(WEST)
    before = drawn(model)
    assert model.choose(explore=False) is None
    model.set_goal(EAST, priority=1.0)
    choice = model.choose(explore=False)
    assert (choice.action, choice.goal, choice.sign) == ("E", EAST, WEST)
    assert choice.cost_to_go == model.policy_path()[0].cost_to_go
    assert drawn(model) == before


def test_asked_not_to_explore_a_curious_model_passes_by_what_was_never_tried(
    make_model: MakeModel, corridor: Grid
) -> None:
    model = make_model(exploration=Exploration.CURIOUS, curiosity={"optimistic_cost": 0.1})
    learn(model, corridor, "EEEEEWWWWW")
    model.set_goal(EAST, priority=1.0)
    model.sense(WEST)
    assert model.choose().goal is None
    assert model.choose(explore=False).goal == EAST


def test_finding_nothing_to_do_leaves_the_cycle_and_the_last_choice_as_they_are(
    make_model: MakeModel, corridor: Grid
) -> None:
    model = make_model(exploration=Exploration.NONE)
    learn(model, corridor, "EEEEEWWWWW" * 2)
    model.set_goal(EAST, priority=1.0)
    model.sense(WEST)
    model.choose()
    model.withdraw_goal(EAST)
    assert model.choose() is None
    model.perform("E")
    assert model._on_course
    assert model.sense(["at:1,0"]).succeeded > 0


@pytest.mark.parametrize("exploration", [Exploration.RANDOM, Exploration.CURIOUS])
def test_a_model_that_explores_does_so_where_no_goal_can_be_reached(
    make_model: MakeModel, exploration: Exploration
) -> None:
    model = make_model(exploration=exploration)
    model.set_goal(NOWHERE, priority=1.0)
    for place in "abcdefgh":
        model.sense([place])
        choice = model.choose()
        assert choice.goal is None
        model.perform(choice.action)


def test_a_curious_model_goes_by_the_frontier_to_the_highest_goal_that_has_no_way_yet(
    make_model: MakeModel, corridor: Grid, cycle: RunCycle
) -> None:
    """Every action was tried often where it stands; the one that was not is at the east end."""
    parameters = {"optimistic_cost": 10.0, "restlessness": 1e9}
    model = make_model(exploration=Exploration.CURIOUS, curiosity=parameters)
    cycle(model, ["island"], None)
    for place in range(5):
        corridor.at = (place, 0)
        for action in "NS":
            learn(model, corridor, action)
    corridor.at = (0, 0)
    learn(model, corridor, "WEEEEWWWWEEEEEWWWWW")
    model.set_goal(["island"], priority=1.0)
    model.sense(WEST)
    choice = model.choose()
    assert model.goals == (goal(("island",), 1.0, UNREACHABLE),)
    assert (choice.action, choice.goal) == ("E", ("island",))


def test_with_a_goal_that_has_a_way_a_curious_model_seeks_that_one(
    make_model: MakeModel, corridor: Grid, cycle: RunCycle
) -> None:
    model = make_model(exploration=Exploration.CURIOUS, curiosity={"optimistic_cost": 1e6})
    cycle(model, ["island"], None)
    learn(model, corridor, "EEEEEWWWWW")
    model.set_goal(["island"], priority=2.0)
    model.set_goal(EAST, priority=1.0)
    model.sense(WEST)
    assert model.choose().goal == EAST


# --- parameters --------------------------------------------------------------------------------


class Careful(Parameters, frozen=True):
    """What a rover may take as its defaults."""

    exploration: Exploration = Exploration.NONE


def test_parameters_can_have_other_defaults_in_a_subclass(corridor: Grid) -> None:
    rng = np.random.default_rng(0)
    model = DynamicExpectancyModel({"E": 1.0}, Careful(alpha=0.3), rng=rng)
    model.sense(WEST)
    assert model.choose() is None
    loaded = DynamicExpectancyModel.load(model.save())
    assert loaded.choose() is None
    assert loaded._parameters == Parameters(alpha=0.3, exploration=Exploration.NONE)
    assert msgspec.convert({"exploration": "curious"}, Careful).exploration is Exploration.CURIOUS
