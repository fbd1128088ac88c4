"""Actions that are met on the way, and costs that are set later."""

import math
from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, lists, sent, signs

from farside.dem import (
    DeltaError,
    DynamicExpectancyModel,
    Exploration,
    Parameters,
    ShadowModel,
)
from farside.dem.changes import ActionAdded, CostSet
from tests.dem.conftest import Event, Eventful, Live, RunCycle

A, B, C = ("at:A",), ("at:B",), ("at:C",)


def made(costs: dict[str, float], parameters: Parameters = PARAMETERS) -> DynamicExpectancyModel:
    return DynamicExpectancyModel(costs, parameters, rng=np.random.default_rng(1))


def test_a_model_may_begin_with_no_action_and_meets_them_on_the_way(cycle: RunCycle) -> None:
    """It has nothing to do until somebody shows it what can be done."""
    model = made({}, Parameters())
    model.sense(A)
    assert model.choose() is None
    model.perform("E")
    cycle(model, B, "dig")
    cycle(model, C, None)
    assert model.actions == {"E": 1.0, "dig": 1.0}
    model.set_goal(C, priority=1.0)
    model.sense(A)
    assert [step.action for step in model.policy_path()] == ["E", "dig"]
    assert model.choose().action == "E"


def test_a_curious_model_without_actions_has_nothing_to_do_and_then_tries_the_new_one(
    cycle: RunCycle,
) -> None:
    model = made({}, Parameters(exploration=Exploration.CURIOUS))
    model.sense(A)
    model.set_goal(B, priority=1.0)
    assert model.choose() is None
    model.perform("E")
    model.sense(C)
    assert model.choose().action == "E"


def test_a_new_action_costs_as_much_as_the_dearest_known_until_its_cost_is_set(
    cycle: RunCycle,
) -> None:
    model = made({"E": 2.0, "W": 0.5})
    cycle(model, A, "jump")
    cycle(model, B, None)
    assert model.actions == {"E": 2.0, "W": 0.5, "jump": 2.0}
    assert model.cost_to(B, A) == 2.0 / 0.5
    model.set_cost("jump", 7)
    assert model.actions["jump"] == 7.0
    assert model.cost_to(B, A) == 7.0 / 0.5


def test_when_a_cost_is_set_the_way_follows_in_the_same_cycle(cycle: RunCycle) -> None:
    """Two ways lead from A to C: by one dear action, or by two cheap ones over B."""
    model = made({"E": 1.0, "jump": 3.0}, Parameters())
    for tokens, action in [(A, "E"), (B, "E"), (C, None), (A, "jump"), (C, None)]:
        cycle(model, tokens, action)
    model.set_goal(C, priority=1.0)
    model.sense(A)
    assert model.choose().action == "E"
    model.set_cost("jump", 1.5)
    assert model.choose().action == model.why().action == "jump"
    assert model.cost_to(C) == model.why().cost_to_go == 1.5 / 0.5
    model.set_cost("E", 0.1)
    assert model.choose().action == "E"


streams = st.lists(
    st.tuples(
        st.frozensets(st.sampled_from("abcde"), max_size=3).map(sorted),
        st.sampled_from(["go", "turn", "jump", None]),
    ),
    max_size=40,
)


@given(stream=streams, goal=signs)
def test_a_model_that_meets_its_actions_learns_as_one_that_knew_them(
    stream: Sequence[tuple[Sequence[str], str | None]], goal: Sequence[str]
) -> None:
    """In whatever order they are met; only the ids of the actions are others."""
    knew, meets = made(dict.fromkeys(["go", "turn", "jump"], 1.0)), made({})
    for tokens, action in stream:
        assert knew.sense(tokens) == meets.sense(tokens)
        knew.perform(action)
        meets.perform(action)
    for model in (knew, meets):
        model.set_goal(goal, priority=1.0)
    assert lists(knew) == lists(meets)
    assert knew.policy_path() == meets.policy_path()
    assert knew._hypotheses.track_record() == meets._hypotheses.track_record()


changes = st.lists(
    st.tuples(st.sampled_from(["go", "jump", "dig"]), st.sampled_from([0.5, 2.0, 9.0])), max_size=3
)


@settings(max_examples=50)
@given(lived=st.integers(0, 60), changed=changes, after=st.integers(0, 30))
def test_a_shadow_and_a_loaded_model_know_new_actions_and_costs(
    eventful: Eventful, live: Live, lived: int, changed: Sequence[tuple[str, float]], after: int
) -> None:
    """By the changes, and by a whole as well."""
    model = made(COSTS)
    shadow, later = ShadowModel(COSTS, PARAMETERS), ShadowModel(COSTS, PARAMETERS)
    model.record_changes()
    live(model, eventful(lived))
    shadow.apply(sent(model.take_delta()))
    for action, cost in changed:
        meet: Event = (["a", "b"], action, None)
        live(model, [meet])
        model.set_cost(action, cost)
    loaded = DynamicExpectancyModel.load(model.save())
    stream = eventful(lived + after)[lived:]
    assert live(loaded, stream) == live(model, stream)
    assert loaded.save() == model.save()
    shadow.apply(sent(model.take_delta()))
    later.apply(sent(model.whole()))
    for copy in (shadow, later, loaded):
        assert copy.actions == model.actions
        assert lists(copy) == lists(model)
        assert copy.lists_check() == model.lists_check()


@pytest.mark.parametrize(
    "change",
    [ActionAdded("go", 1.0), ActionAdded("new", math.nan), CostSet(2, 1.0), CostSet(0, 0.0)],
)
def test_an_impossible_action_is_refused_by_a_shadow(
    eventful: Eventful, live: Live, change: ActionAdded | CostSet
) -> None:
    model, shadow = made(COSTS), ShadowModel(COSTS, PARAMETERS)
    model.record_changes()
    shadow.apply(model.take_delta())
    live(model, eventful(5))
    delta = msgspec.structs.replace(model.take_delta(), changes=(change,))
    with pytest.raises(DeltaError, match="expected an action at a cost above 0, found"):
        shadow.apply(delta)
    assert shadow.actions == COSTS


def test_a_cost_that_cannot_be_is_refused_and_changes_nothing(cycle: RunCycle) -> None:
    model = made({"E": 2.0})
    with pytest.raises(ValueError, match="unknown action 'W': expected one of 'E'"):
        model.set_cost("W", 1.0)
    with pytest.raises(ValueError, match="cost of action 'E': expected above 0, found 0"):
        model.set_cost("E", 0)
    assert model.actions == {"E": 2.0}


def test_of_many_known_actions_a_message_names_a_few() -> None:
    model = made({f"a{number:03}": 1.0 for number in range(500)})
    model.sense(A)
    with pytest.raises(ValueError, match=r"expected one of 'a000', .* and 480 more$"):
        model.expected("b")
