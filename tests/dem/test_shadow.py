"""A shadow is sent the changes of a model's lists, and holds the same lists."""

from collections import Counter
from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, cuts, cycles, lists, recorded, sent
from restless import parameters as restless_parameters

from farside.dem import (
    Aside,
    DeltaError,
    DynamicExpectancyModel,
    Hypothesis,
    InherentGoal,
    Parameters,
    ShadowModel,
    UnreadableMemoryError,
)
from farside.dem.changes import HypothesisAdded, HypothesisRemoved, SignAdded, SignRemoved
from tests.dem.conftest import COST, MOVES, Event, Eventful, Grid, Live, MakeModel, Tour


@given(
    parameters=restless_parameters,
    lived=st.integers(0, 120),
    after=st.lists(st.tuples(cycles, cuts)),
)
def test_a_shadow_holds_the_same_lists_after_any_stream_cut_into_any_deltas(
    eventful: Eventful,
    live: Live,
    parameters: Parameters,
    lived: int,
    after: Sequence[tuple[Event, str]],
) -> None:
    rules = [InherentGoal(when=("a",), goal=("b",), priority=1)]
    rules += [InherentGoal(when=("c",), goal=("d", "e"), priority=2)]
    rng = np.random.default_rng(1)
    model = DynamicExpectancyModel(COSTS, parameters, rng=rng, inherent=rules)
    shadow = ShadowModel(COSTS, parameters)
    live(model, eventful(lived))
    model.record_changes()
    for cycle, cut in after:
        live(model, [cycle])
        if cut != "nothing":
            shadow.apply(sent(model.take_delta() if cut == "delta" else model.whole()))
            assert lists(shadow) == lists(model)
    shadow.apply(sent(model.take_delta()))
    assert lists(shadow) == lists(model)


@pytest.mark.parametrize("cycles_per_delta", [1, 7, 100])
def test_over_a_long_stream_a_shadow_holds_the_same_lists(
    eventful: Eventful, live: Live, cycles_per_delta: int
) -> None:
    model, shadow = recorded()
    stream, suspensions = eventful(500), 0
    for begin in range(0, len(stream), cycles_per_delta):
        live(model, stream[begin : begin + cycles_per_delta])
        shadow.apply(sent(model.take_delta()))
        assert lists(shadow) == lists(model)
        assert shadow._hypotheses.cm_sum == model._hypotheses.cm_sum
        suspensions += any(goal.aside is Aside.BLOCKED for goal in shadow.goals)
    assert suspensions or cycles_per_delta > 1, "a goal is blocked, if only briefly"


def test_that_long_stream_exercises_every_kind_of_change(eventful: Eventful, live: Live) -> None:
    model, _ = recorded()
    model.take_delta()
    told: Counter[type] = Counter()
    for cycle in eventful(500):
        live(model, [cycle])
        told.update(type(change) for change in model.take_delta().changes)

    assert told.keys() == {int, SignAdded, SignRemoved, HypothesisAdded, HypothesisRemoved}
    assert told[HypothesisRemoved] > 50
    assert max(len(one.context) for one in model.hypotheses) > 1
    assert {one.delay for one in model.hypotheses} == {1, 2}


def test_recording_changes_nothing_else(eventful: Eventful, live: Live) -> None:
    model, _ = recorded()
    other = DynamicExpectancyModel(COSTS, PARAMETERS, rng=np.random.default_rng(1))
    assert live(model, eventful(200)) == live(other, eventful(200))
    assert model.save() == other.save()


def test_a_shadow_starts_with_everything_learned_before_recording(
    eventful: Eventful, live: Live
) -> None:
    model = DynamicExpectancyModel(COSTS, PARAMETERS, rng=np.random.default_rng(1))
    live(model, eventful(50))
    shadow = ShadowModel(COSTS, PARAMETERS)
    model.record_changes()
    shadow.apply(sent(model.take_delta()))

    assert lists(shadow) == lists(model)
    assert (shadow.number, len(shadow.hypotheses)) == (1, model.hypothesis_count)


def test_the_first_delta_of_a_loaded_model_is_a_whole(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    live(model, eventful(20))
    shadow.apply(model.take_delta())
    loaded = DynamicExpectancyModel.load(model.save())
    loaded.record_changes()
    live(loaded, eventful(20))
    shadow.apply(loaded.take_delta())

    assert lists(shadow) == lists(loaded)


def test_the_values_of_a_shadow_are_those_of_the_model(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    live(model, eventful(30))
    model.set_goal(["a"], 1)
    shadow.apply(model.take_delta())

    for row in model.policy_map():
        assert shadow.value(row.sign) == row.value
    assert shadow.value(["z"]) == float("inf")
    with pytest.raises(TypeError, match="write"):
        shadow.value("z")


def test_without_a_goal_nothing_has_a_value(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    live(model, eventful(30))
    shadow.apply(model.take_delta())

    assert shadow.policy_map() == ()
    assert shadow.value(["a"]) == float("inf")


@given(parameters=restless_parameters, stream=st.lists(cycles, min_size=1))
def test_what_a_shadow_says_of_the_tokens_sensed_is_what_the_model_says(
    eventful: Eventful, live: Live, parameters: Parameters, stream: Sequence[Event]
) -> None:
    model, shadow = recorded(parameters)
    live(model, eventful(80))
    for tokens, action, change in stream:
        sensed = model.sense(tokens)
        if change is not None:
            model.set_goal(change[1], change[2])
        shadow.apply(sent(model.take_delta()))
        # What became known in this very cycle is active on board from the next one on.
        implied = {sign for sign in shadow.signs if set(sign) <= set(sensed.tokens)}
        if implied == set(sensed.active):
            said = [shadow.policy_path(tokens), shadow.why(tokens)]
            assert said == [model.policy_path(), model.why()]
            for goal in (["a"], ["b", "c"], ["e"]):
                assert shadow.cost_to(goal, tokens) == model.cost_to(goal)
            for name in COSTS:
                assert shadow.expected(tokens, name) == model.expected(name)
        for start in shadow.signs:
            assert shadow.cost_to(["e"], start) == model.cost_to(["e"], start)
        model.perform(action if action in COSTS else None)


def test_a_shadow_tells_the_way_from_any_place_that_the_model_knows(
    make_model: MakeModel, tour: Tour, corridor: Grid
) -> None:
    model = make_model()
    tour(model, corridor, 200)
    model.set_goal(["at:5,0"], 1)
    model.record_changes()
    shadow = ShadowModel(dict.fromkeys(MOVES, COST), Parameters())
    shadow.apply(model.take_delta())

    assert [step.action for step in shadow.policy_path(["at:1,0", "battery:low"])] == ["E"] * 4
    why = shadow.why(["at:1,0"])
    assert why is not None
    assert (why.context, why.action, why.outcome) == (("at:1,0",), "E", ("at:2,0",))
    assert why.cost_to_go == shadow.value(["at:1,0"]) == shadow.cost_to(["at:5,0"], ["at:1,0"])
    expected = shadow.expected(["at:1,0"], "W")
    assert expected is not None
    assert expected.outcome == ("at:0,0",)


def test_a_shadow_says_nothing_of_what_nobody_has_sensed(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    live(model, eventful(30))
    model.set_goal(["a"], 1)
    shadow.apply(model.take_delta())

    assert (shadow.policy_path(["z"]), shadow.why([])) == ((), None)
    assert shadow.expected(["z"], "go") is None
    assert shadow.cost_to(["a"], ["z"]) == shadow.cost_to(["z"], ["a"]) == float("inf")
    assert shadow.cost_to(["a"], ["a", "z"]) == 0.0
    for ask in (shadow.policy_path, shadow.why):
        with pytest.raises(TypeError, match="write"):
            ask("a")
    with pytest.raises(ValueError, match="one Token at least"):
        shadow.cost_to([], ["a"])
    with pytest.raises(ValueError, match="fly"):
        shadow.expected(["a"], "fly")


def test_no_delta_is_accepted_before_a_whole() -> None:
    model, shadow = recorded()
    model.take_delta()
    with pytest.raises(DeltaError, match="expected a whole first, found delta 2: ask for a whole"):
        shadow.apply(model.take_delta())


def test_a_gap_is_refused_without_effect_and_a_whole_closes_it(
    eventful: Eventful, live: Live
) -> None:
    model, shadow = recorded()
    shadow.apply(model.take_delta())
    live(model, eventful(10))
    lost = model.take_delta()
    live(model, eventful(10))
    with pytest.raises(DeltaError, match="expected delta 2, found delta 3: ask for a whole"):
        shadow.apply(model.take_delta())
    assert (shadow.number, shadow.signs) == (1, ())

    live(model, eventful(10))
    shadow.apply(sent(model.whole()))
    assert lists(shadow) == lists(model)
    with pytest.raises(DeltaError, match="expected delta 5, found delta 2"):
        shadow.apply(lost)
    live(model, eventful(10))
    shadow.apply(sent(model.take_delta()))
    assert lists(shadow) == lists(model)


def test_no_delta_is_accepted_twice(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    shadow.apply(model.take_delta())
    live(model, eventful(10))
    delta = model.take_delta()
    shadow.apply(delta)
    with pytest.raises(DeltaError, match="expected delta 3, found delta 2"):
        shadow.apply(delta)
    assert lists(shadow) == lists(model)


def test_a_delta_of_another_model_is_refused_even_with_the_right_number(
    eventful: Eventful, live: Live
) -> None:
    model, shadow = recorded()
    other, _ = recorded()
    live(other, eventful(10))
    shadow.apply(model.take_delta())
    other.take_delta()
    live(other, eventful(10))
    with pytest.raises(DeltaError, match="delta 2 is of another model"):
        shadow.apply(other.take_delta())
    assert shadow.signs == ()


def test_a_whole_of_a_model_with_other_actions_or_parameters_is_refused() -> None:
    model, _ = recorded()
    whole = model.take_delta()
    with pytest.raises(DeltaError, match=r"another model: expected the actions \['jump'\]"):
        ShadowModel({"jump": 3}, PARAMETERS).apply(whole)
    with pytest.raises(DeltaError, match=r"expected .*reach=1.* found .*reach=2"):
        ShadowModel(COSTS, Parameters()).apply(whole)


def test_parameters_of_a_subclass_are_those_that_they_say() -> None:
    class Eager(Parameters, frozen=True):
        alpha: float = 0.9

    model, _ = recorded(Eager())
    whole = sent(model.take_delta())
    ShadowModel(COSTS, Eager()).apply(whole)
    ShadowModel(COSTS, Parameters(alpha=0.9)).apply(whole)
    with pytest.raises(DeltaError, match="another model"):
        ShadowModel(COSTS, Parameters()).apply(whole)


def test_a_damaged_whole_is_refused_and_changes_nothing(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    live(model, eventful(10))
    shadow.apply(model.take_delta())
    held = lists(shadow)
    damaged = msgspec.structs.replace(model.whole(), whole=b"damaged")
    with pytest.raises(UnreadableMemoryError):
        shadow.apply(damaged)
    assert lists(shadow) == held


@pytest.mark.parametrize("count", [0, 1, 10, 100, 400])
def test_the_track_record_is_that_of_the_most_credible_of_each_cause(
    eventful: Eventful, live: Live, count: int
) -> None:
    model, shadow = recorded()
    live(model, eventful(count))
    shadow.apply(model.take_delta())
    best: dict[tuple[object, str], Hypothesis] = {}
    for one in shadow.hypotheses:
        known = best.get((one.context, one.action))
        if one.delay == 1 and (known is None or one.cm > known.cm):
            best[one.context, one.action] = one
    came_true = sum(one.successes for one in best.values())
    fell_due = sum(one.predictions for one in best.values())

    assert shadow.track_record() == (came_true, fell_due)
    assert fell_due > 0 or count < 100


def test_nothing_is_recorded_before_it_is_asked_for() -> None:
    model = DynamicExpectancyModel(COSTS, rng=np.random.default_rng(1))
    for take in (model.take_delta, model.whole):
        with pytest.raises(RuntimeError, match=r"call record_changes\(\) first"):
            take()
    assert model._signs.recorded is None


def test_asking_for_recording_again_loses_nothing(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    shadow.apply(model.take_delta())
    live(model, eventful(10))
    model.record_changes()
    shadow.apply(model.take_delta())
    assert lists(shadow) == lists(model)


def test_goals_are_sent_only_when_they_change() -> None:
    model, _ = recorded()
    model.take_delta()
    model.set_goal(["a"], 2)
    assert model.take_delta().goals == model.goals
    assert model.take_delta().goals is None
    model.withdraw_goal(["a"])
    assert model.take_delta().goals == ()


def test_wholes_of_all_parameters_that_were_agreed_on_are_accepted(
    eventful: Eventful, live: Live
) -> None:
    """Two changes follow each other faster than a whole arrives."""
    model, shadow = recorded()
    wholes = []
    for alpha in (PARAMETERS.alpha, 0.2, 0.9):
        parameters = msgspec.structs.replace(PARAMETERS, alpha=alpha)
        model.change(parameters)
        shadow.agree(parameters)
        live(model, eventful(10))
        wholes.append((model.take_delta(), lists(model)))

    for whole, then in wholes:
        shadow.apply(sent(whole))
        assert lists(shadow) == then
    live(model, eventful(10))
    shadow.apply(sent(model.take_delta()))
    assert lists(shadow) == lists(model)
