"""Parameters that change while a model lives: train, then judge."""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, cycles, lists, sent
from restless import parameters as restless_parameters

from farside.dem import DynamicExpectancyModel, Exploration, Parameters, ShadowModel
from tests.dem.conftest import Event, Eventful, Live, MakeModel, RunCycle
from tests.dem.test_plain import Pair, learning, streams

A, B, C = ("at:A",), ("at:B",), ("at:C",)
OTHERS: dict[str, Any] = {
    "alpha": 0.1,
    "beta": 0.9,
    "learning_probability": 0.25,
    "initial_cm": 0.75,
    "plain": True,
    "reach": 5,
    "maturity": 3,
    "ineffective": 0.4,
    "break_multiple": 7.0,
    "recovery": 3,
    "exploration": "none",
    "curiosity": {"optimistic_cost": 3.0},
    "values": "expected",
    "improbable": 0.01,
}


@pytest.mark.parametrize("name", [field.name for field in msgspec.structs.fields(Parameters)])
def test_every_parameter_can_change_while_a_model_lives(
    eventful: Eventful, live: Live, name: str
) -> None:
    """And a model that is loaded, and a shadow that agrees, go on as it does."""
    other = OTHERS.get(name, False)
    assert getattr(PARAMETERS, name) != other, "this is no other value"
    changed = msgspec.structs.replace(PARAMETERS, **{name: other})
    model = DynamicExpectancyModel(COSTS, PARAMETERS, rng=np.random.default_rng(1))
    shadow = ShadowModel(COSTS, PARAMETERS)
    model.record_changes()
    live(model, eventful(120))
    shadow.apply(sent(model.take_delta()))
    model.change(changed)
    shadow.agree(changed)
    assert model.parameters == changed
    loaded = DynamicExpectancyModel.load(model.save())
    assert lists(loaded) == lists(model)
    assert live(loaded, eventful(200)[120:]) == live(model, eventful(200)[120:])
    shadow.apply(sent(model.take_delta()))
    assert lists(shadow) == lists(model)


@settings(max_examples=30)
@given(
    stages=st.lists(st.tuples(restless_parameters, st.lists(cycles, max_size=8)), max_size=4),
    lived=st.integers(0, 80),
)
def test_whatever_changes_a_saved_model_and_a_shadow_hold_the_same(
    eventful: Eventful,
    live: Live,
    stages: Sequence[tuple[Parameters, Sequence[Event]]],
    lived: int,
) -> None:
    model = DynamicExpectancyModel(COSTS, Parameters(), rng=np.random.default_rng(1))
    shadow = ShadowModel(COSTS, Parameters())
    model.record_changes()
    live(model, eventful(lived))
    for parameters, stream in sorted(stages, key=lambda stage: stage[0].reach):
        model.change(parameters)
        shadow.agree(parameters)
        live(model, stream)
        loaded = DynamicExpectancyModel.load(model.save())
        shadow.apply(sent(model.take_delta()))
        assert lists(loaded) == lists(shadow) == lists(model)
        assert loaded.save() == model.save()


@settings(max_examples=30)
@given(stages=st.lists(st.tuples(learning, streams), min_size=2, max_size=3))
def test_after_a_change_it_learns_by_the_rules_as_they_are_then(
    stages: Sequence[tuple[Parameters, Any]],
) -> None:
    """As the twin does, whose lists know no layout."""
    by_reach = sorted(stages, key=lambda stage: stage[0].reach)
    pair = Pair(by_reach[0][0])
    for parameters, stream in by_reach:
        pair.model.change(parameters)
        pair.twin.change(parameters)
        for (tokens, wants_goals), action in stream:
            pair.cycle(tokens, action, wants_goals=wants_goals)
        pair.agree()


def test_it_is_trained_and_then_judged(make_model: MakeModel, cycle: RunCycle) -> None:
    """While it is judged it learns nothing, and does nothing but what it knows."""
    model = make_model()
    for tokens, action in [(A, "E"), (B, "N"), (C, None)]:
        cycle(model, tokens, action)
    judged = Parameters(
        alpha=0,
        beta=0,
        averaging=False,
        learning_probability=0,
        removal=False,
        exploration=Exploration.NONE,
    )
    model.change(judged)
    known = model.hypotheses
    model.set_goal(C)
    model.sense(A)
    assert model.choose().action == "E"
    model.perform("E")
    cycle(model, C, "W")
    model.sense(["nowhere"])
    assert model.choose() is None
    assert [(h.context, h.outcome, h.cm) for h in model.hypotheses] == [
        (h.context, h.outcome, h.cm) for h in known
    ]
    model.change(msgspec.structs.replace(judged, exploration=Exploration.RANDOM))
    assert model.choose().goal is None


def test_values_follow_at_once_when_costs_come_from_c_m_again(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """With `dust` everywhere, credit is less than C_m: the way looks cheaper by C_m."""
    model = make_model(situations=False)
    for tokens, action in [(("dust",), "E"), (("at:A", "dust"), "E"), (B, None)]:
        cycle(model, tokens, action)
    assert model.cost_to(B, ["dust"]) == 2.66 / 0.25
    model.change(Parameters(own_credit=False, situations=False))
    assert model.cost_to(B, ["dust"]) == 2.66 / 0.5


def test_a_shorter_reach_is_refused_and_changes_nothing(make_model: MakeModel) -> None:
    model = make_model(reach=3)
    before = model.parameters
    with pytest.raises(ValueError, match="reach: expected at least 3, as before, found 2"):
        model.change(Parameters(reach=2, alpha=0.1))
    assert model.parameters == before


def test_a_longer_reach_learns_longer_delays_from_then_on(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    cycle(model, A, "E")
    cycle(model, B, "N")
    model.change(Parameters(reach=2))
    cycle(model, C, None)
    cycle(model, ["at:D"], None)
    delays = {(h.context, h.outcome): h.delay for h in model.hypotheses}
    assert delays == {(A, B): 1, (B, C): 1, (B, ("at:D",)): 2}
