"""Everything that a model goes by can be read off it: P, P*, the traces, costs and parameters."""

from collections.abc import Sequence

import numpy as np
from hypothesis import given, settings

from farside.dem import DynamicExpectancyModel, Parameters, Sign, Trace
from tests.dem.conftest import MakeModel, RunCycle
from tests.dem.test_plain import Pair, learning, streams

A, B, C = ("at:A",), ("at:B",), ("at:C",)


def told(model: DynamicExpectancyModel) -> list[tuple[int, Sign]]:
    return [(one.due_in, one.outcome) for one in model.predictions]


def test_what_is_predicted_when_and_by_which_hypothesis(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """Led from A to B and on to C, it expects both, one a cycle after the other, when E is done."""
    model = make_model(reach=2)
    for tokens, action in [(A, "E"), (B, "N"), (C, None), (C, None)]:
        cycle(model, tokens, action)
    assert told(model) == []
    cycle(model, A, "E")
    assert told(model) == [(1, B), (2, C)]
    assert [one.outcome for one in model.due] == [B]
    assert [one.hypothesis.delay for one in model.predictions] == [1, 2]
    assert {one.hypothesis for one in model.predictions} <= set(model.hypotheses)
    assert model.sense(B).succeeded == 1
    assert told(model) == [(1, C)]
    model.perform(None)
    assert model.sense(A).failed == 1
    assert told(model) == []


def test_the_traces_are_what_was_active_and_what_was_done_the_latest_first(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model(reach=2)
    for tokens, action in [(A, "E"), ((*B, "dust"), None), (C, "N")]:
        cycle(model, tokens, action)
    assert model.traces == (Trace((C,), "N"), Trace((B, ("dust",)), None))


@settings(max_examples=30)
@given(stream=streams, parameters=learning)
def test_p_and_the_traces_are_those_of_the_twin(
    stream: Sequence[tuple[tuple[set[str], bool], str | None]], parameters: Parameters
) -> None:
    """And of a model that was saved and loaded."""
    pair = Pair(parameters)
    model, twin = pair.model, pair.twin
    for (tokens, wants_goals), action in stream:
        pair.cycle(tokens, action, wants_goals=wants_goals)
        plain = [
            (cycle + 1 - twin.cycle, h.context.tokens, h.action, h.outcome.tokens, h.delay)
            for cycle, h in twin.predictions
            if cycle >= twin.cycle
        ]
        assert sorted(plain) == sorted(
            (one.due_in, one.hypothesis.context, one.hypothesis.action, one.outcome, delay)
            for one in model.predictions
            for delay in [one.hypothesis.delay]
        )
        assert all(one in model.predictions for one in model.due)
        assert model.traces == tuple(
            Trace(tuple(sign.tokens for sign in then.active), then.action) for then in twin.past
        )
    loaded = DynamicExpectancyModel.load(model.save())
    assert (loaded.predictions, loaded.traces) == (model.predictions, model.traces)


def test_a_model_says_in_one_line_what_it_is(make_model: MakeModel, cycle: RunCycle) -> None:
    model = make_model(alpha=0.25)
    cycle(model, A, "E")
    cycle(model, B, None)
    model.set_goal(C)
    assert repr(model) == (
        "<DynamicExpectancyModel: 4 actions, 2 Signs, 1 hypothesis, 1 goal, cycle 2, alpha=0.25>"
    )
    assert repr(DynamicExpectancyModel({}, rng=np.random.default_rng(0))) == (
        "<DynamicExpectancyModel: 0 actions, 0 Signs, 0 hypotheses, 0 goals, cycle 0>"
    )
    plain = make_model(plain=True, exploration="none")
    assert repr(plain).endswith("cycle 0, plain=True, exploration=none>")
