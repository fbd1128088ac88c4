"""Aversion: what is to be avoided costs more, whoever goes there for whatever goal."""

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from farside.dem import (
    Aversion,
    Curiosity,
    DeltaError,
    DynamicExpectancyModel,
    Exploration,
    Parameters,
    ShadowModel,
    UnreadableMemoryError,
    Values,
)
from farside.dem.lists.aversions import AversionList
from farside.dem.lists.signs import SignList

COSTS = {"E": 1.0, "N": 1.0, "W": 1.0}

# A hollow lies on the straight way from the start to the goal; the way round has one step more.
# Whoever goes through the hollow is tilted there.
WAYS = {
    ("start", "E"): ["hollow", "tilted"],
    ("hollow", "E"): ["goal"],
    ("start", "N"): ["ridge"],
    ("ridge", "E"): ["peak"],
    ("peak", "E"): ["goal"],
}


@pytest.fixture
def taught() -> Callable[..., DynamicExpectancyModel]:
    """A model that has gone every way a few times, with a goal at the end of them."""

    def teach(**parameters: object) -> DynamicExpectancyModel:
        model = DynamicExpectancyModel(
            COSTS, msgspec.convert(parameters, Parameters), rng=np.random.default_rng(0)
        )
        model.record_changes()
        for _ in range(8):
            for (place, action), outcomes in WAYS.items():
                model.sense([place])
                model.perform(action)
                model.sense(outcomes)
                model.perform(None)
        model.set_goal(["goal"])
        model.sense(["start"])
        return model

    return teach


def way(model: DynamicExpectancyModel) -> list[str]:
    """The actions on the policy path, after checking that the model chooses the first of them."""
    actions = [step.action for step in model.policy_path()]
    choice = model.choose(explore=False)
    assert choice is not None
    assert choice.action == actions[0]
    return actions


@pytest.mark.parametrize("values", list(Values))
@pytest.mark.parametrize("averted", ["hollow", "tilted"])
def test_a_place_or_what_is_sensed_there_is_avoided_at_its_cost_and_no_more(
    taught: Callable[..., DynamicExpectancyModel], values: Values, averted: str
) -> None:
    model = taught(values=values)
    straight = model.cost_to(["goal"])
    assert way(model) == ["E", "E"]
    model.avert([averted], 0.5)
    assert way(model) == ["E", "E"]
    assert model.cost_to(["goal"]) == pytest.approx(straight + 0.5, rel=0.1)
    model.avert([averted], 50.0)
    assert way(model) == ["N", "E", "E"]
    assert model.accept([averted])
    assert way(model) == ["E", "E"]
    assert model.cost_to(["goal"]) == straight


def test_the_highest_cost_that_any_source_gives_counts(
    taught: Callable[..., DynamicExpectancyModel],
) -> None:
    model = taught()
    model.avert(["hollow"], 50.0, source="mission")
    model.avert(["hollow"], 0.0)
    assert model.aversions == (Aversion(("hollow",), {"mission": 50.0, "operator": 0.0}),)
    assert model.aversions[0].cost == 50.0
    assert way(model) == ["N", "E", "E"]
    assert not model.accept(["hollow"], source="rule")
    assert model.accept(["hollow"], source="mission")
    assert way(model) == ["E", "E"]


def test_what_one_active_sign_knows_of_a_risk_counts_for_all() -> None:
    """A Sign that is active everywhere must not show a way that the place knows to be bad."""
    model = DynamicExpectancyModel(
        COSTS,
        Parameters(own_credit=False, removal=False, situations=False),
        rng=np.random.default_rng(0),
    )
    for _ in range(20):
        for place, action, outcome in (("a", "E", "pit"), ("b", "E", "goal"), ("a", "N", "b")):
            model.sense([place] if outcome == "pit" else [place, "always"])
            model.perform(action)
            model.sense([outcome])
            model.perform(None)
    model.set_goal(["goal"])
    model.avert(["pit"], 1000.0)
    model.sense(["a", "always"])
    assert way(model)[0] == "N"


def test_what_is_only_known_as_a_part_of_different_situations_is_as_likely_as_all_of_them() -> None:
    signs = SignList()
    pits = [signs.add(("deep", "pit")), signs.add(("pit", "wet"))]
    aversions = AversionList(signs)
    aversions.avert(("pit",), 10.0, "operator")
    assert aversions.risk([(pit, 0.3) for pit in pits]) == pytest.approx(6.0)
    assert aversions.risk([(pit, 0.8) for pit in pits]) == 10.0
    alone = signs.add(("pit",))
    assert aversions.risk([(alone, 0.7), (pits[0], 0.3)]) == pytest.approx(7.0)


@pytest.mark.parametrize("exploration", [Exploration.RANDOM, Exploration.CURIOUS])
def test_whoever_explores_takes_no_known_risk_as_long_as_there_is_anything_else(
    taught: Callable[..., DynamicExpectancyModel], exploration: Exploration
) -> None:
    """For curiosity, the risk is as dear as any cost: it is worth less than trying elsewhere."""
    model = taught(exploration=exploration, curiosity=Curiosity(restlessness=1e5))
    model.withdraw_goal(["goal"])
    model.perform(None)
    model.avert(["tilted"], 1e6)
    done = set()
    for _ in range(60):
        model.sense(["start"])
        choice = model.choose()
        assert choice is not None
        done.add(choice.action)
        model.perform(choice.action)
    assert done == {"N", "W"}


def test_a_conjunction_becomes_known_by_being_averted_and_stays_so(
    taught: Callable[..., DynamicExpectancyModel],
) -> None:
    model = taught()
    model.avert(["hollow", "tilted"], 50.0)
    assert ("hollow", "tilted") in model.signs
    for _ in range(8):
        model.perform("E")
        model.sense(["hollow", "tilted"])
        model.perform(None)
        model.sense(["start"])
    assert way(model) == ["N", "E", "E"]
    assert ("hollow", "tilted") in model.signs


@pytest.mark.parametrize("values", list(Values))
def test_a_loaded_model_and_a_shadow_avoid_the_same(
    taught: Callable[..., DynamicExpectancyModel], values: Values
) -> None:
    model = taught(values=values)
    shadow = ShadowModel(COSTS, Parameters(values=values))
    shadow.apply(model.take_delta())
    model.avert(["tilted"], 50.0, source="mission")
    delta = model.take_delta()
    assert delta.aversions == model.aversions
    shadow.apply(delta)
    assert model.take_delta().aversions is None, "told once"
    for _ in range(2):
        loaded = DynamicExpectancyModel.load(model.save())
        assert loaded.aversions == shadow.aversions == model.aversions
        assert loaded.lists_check() == shadow.lists_check() == model.lists_check()
        path = model.policy_path()
        assert loaded.policy_path() == shadow.policy_path(["start"]) == path
        assert loaded.policy_map() == shadow.policy_map() == model.policy_map()
        model.accept(["tilted"], source="mission")
        shadow.apply(model.whole())


@pytest.mark.parametrize("cost", [-1.0, math.inf, math.nan])
def test_costs_that_are_none_are_refused_wherever_they_come_from(
    taught: Callable[..., DynamicExpectancyModel], cost: float
) -> None:
    model = taught()
    with pytest.raises(ValueError, match="expected 0 or more, found"):
        model.avert(["hollow"], cost)
    with pytest.raises(ValueError, match="expected one Token at least"):
        model.avert([], 1.0)
    with pytest.raises(TypeError, match="expected a number, found 'much'"):
        model.avert(["hollow"], "much")  # type: ignore[arg-type]
    assert model.aversions == ()
    odd = msgspec.structs.replace(
        model.take_delta(), aversions=(Aversion(("hollow",), {"operator": cost}),)
    )
    with pytest.raises(DeltaError, match="expected an aversion at a cost of 0 or more"):
        ShadowModel(COSTS, Parameters()).apply(odd)
    model._learner.aversions.become([Aversion(("hollow",), {"operator": cost})])
    with pytest.raises(UnreadableMemoryError, match="expected an aversion at a cost of 0 or more"):
        DynamicExpectancyModel.load(model.save())
