"""Learning in the whole model: hypotheses created, strengthened and weakened."""

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.dem import DynamicExpectancyModel
from tests.dem.conftest import Grid, MakeModel, RunCycle, Tour

A, B, C = ("at:A",), ("at:B",), ("at:C",)

place = st.sampled_from([A, B, C])
beside = st.sampled_from([(), ("battery:low",), ("dust",)])
cycles = st.tuples(
    st.tuples(place, beside).map(lambda pair: pair[0] + pair[1]),
    st.sampled_from(["N", "E", None]),
)
streams = st.lists(cycles, max_size=40)

Stream = list[tuple[tuple[str, ...], str | None]]
"""Cycles with Tokens and action."""

Cause = tuple[tuple[str, ...], str, tuple[str, ...], int]
"""Context, action, outcome and delay of a hypothesis."""


def causes(model: DynamicExpectancyModel) -> list[Cause]:
    return [(h.context, h.action, h.outcome, h.delay) for h in model.hypotheses]


def cm_of(model: DynamicExpectancyModel) -> dict[Cause, float]:
    return {(h.context, h.action, h.outcome, h.delay): h.cm for h in model.hypotheses}


def follow(
    model: DynamicExpectancyModel,
    stream: Sequence[tuple[Sequence[str], str | None]],
) -> DynamicExpectancyModel:
    for tokens, action in stream:
        model.sense(tokens)
        model.perform(action)
    return model


def test_a_novel_sign_gets_a_hypothesis_from_the_last_action(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    first = cycle(model, A, "E")
    assert (first.active, first.novel, first.created) == ((A,), (A,), 0)
    second = cycle(model, B, None)
    assert (second.novel, second.unexpected, second.created) == ((B,), (), 1)
    (hypothesis,) = model.hypotheses
    assert (hypothesis.context, hypothesis.action, hypothesis.outcome) == (A, "E", B)
    assert (hypothesis.delay, hypothesis.cm) == (1, 0.5)
    assert (hypothesis.predictions, hypothesis.successes) == (0, 0)


def test_a_known_sign_that_nothing_predicted_gets_a_hypothesis_too(make_model: MakeModel) -> None:
    model = follow(make_model(), [(A, "E"), (B, "W")])
    sensed = model.sense(A)
    assert (sensed.novel, sensed.unexpected, sensed.created) == ((), (A,), 1)
    assert causes(model)[-1] == (B, "W", A, 1)


def test_a_prediction_that_comes_true_strengthens_its_hypothesis_and_creates_none(
    make_model: MakeModel,
) -> None:
    model = follow(make_model(), [(A, "E"), (B, "W"), (A, "E")])
    sensed = model.sense(B)
    assert (sensed.succeeded, sensed.failed) == (1, 0)
    assert (sensed.unexpected, sensed.created) == ((), 0)
    trained, untried = model.hypotheses
    assert (trained.cm, trained.predictions, trained.successes) == (0.75, 1, 1)
    assert (untried.cm, untried.predictions, untried.successes) == (0.5, 0, 0)


def test_a_failed_prediction_weakens_its_hypothesis_and_the_actual_outcome_is_learned(
    make_model: MakeModel,
) -> None:
    model = follow(make_model(), [(A, "E"), (B, "W"), (A, "E")])
    sensed = model.sense(C)
    assert (sensed.succeeded, sensed.failed, sensed.created) == (0, 1, 1)
    assert cm_of(model)[A, "E", B, 1] == 0.25
    assert cm_of(model)[A, "E", C, 1] == 0.5


def test_an_action_that_changes_nothing_is_learned_like_any_other(make_model: MakeModel) -> None:
    model = follow(make_model(), [(A, "N"), (A, "N")])
    sensed = model.sense(A)
    assert (sensed.succeeded, sensed.created) == (1, 0)
    assert cm_of(model) == {(A, "N", A, 1): 0.75}


def test_standing_still_is_not_an_action(make_model: MakeModel) -> None:
    """Tokens may change while nothing is done: no hypothesis is created and none is tested."""
    model = follow(make_model(), [(A, "E"), (B, None), (A, None)])
    sensed = model.sense(B)
    assert (sensed.succeeded, sensed.failed, sensed.created) == (0, 0, 0)
    assert sensed.unexpected == (B,)
    assert causes(model) == [(A, "E", B, 1)]


def test_every_sign_active_before_is_a_context_for_every_unexpected_sign(
    make_model: MakeModel,
) -> None:
    model = follow(make_model(), [((*A, "dust"), "E")])
    assert model.sense((*B, "battery:low")).created == 4
    assert sorted(causes(model)) == sorted(
        (context, "E", outcome, 1)
        for context in [A, ("dust",)]
        for outcome in [B, ("battery:low",)]
    )


def test_with_a_reach_of_2_the_last_two_actions_are_candidates(make_model: MakeModel) -> None:
    model = follow(make_model(reach=2), [(A, "E"), (B, "N")])
    model.sense(C)
    assert sorted(causes(model)) == [(A, "E", B, 1), (A, "E", C, 2), (B, "N", C, 1)]


def test_a_delayed_prediction_is_settled_in_the_cycle_it_is_due_and_no_other(
    make_model: MakeModel,
) -> None:
    model = follow(make_model(reach=2), [(A, "E"), (B, "N"), (C, None), (A, "E"), (B, None)])
    sensed = model.sense(C)
    assert (sensed.succeeded, sensed.failed) == (1, 0)
    assert cm_of(model)[A, "E", C, 2] == 0.75


def test_a_hypothesis_is_not_created_twice(make_model: MakeModel) -> None:
    """In cycle 3 A is unexpected, although A ∧ N → A after 2 exists since cycle 2."""
    model = follow(make_model(reach=2), [(A, "N"), (A, "E"), (A, "N"), (B, "N"), (A, "N")])
    model.sense(A)
    assert len(set(causes(model))) == len(causes(model))


def test_with_learning_probability_0_no_hypothesis_is_created(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    model = make_model(learning_probability=0.0)
    tour(model, grid, 100)
    assert model.hypothesis_count == 0
    assert model.sign_count > 1


def test_learning_probability_is_the_fraction_of_opportunities_taken(make_model: MakeModel) -> None:
    """400 places in a row, each novel once, so 399 opportunities."""
    model = make_model(learning_probability=0.25)
    follow(model, [([f"at:{place}"], "E") for place in range(400)])
    assert 60 < model.hypothesis_count < 140


def test_learning_does_not_depend_on_who_chose_the_action(
    make_model: MakeModel, grid: Grid
) -> None:
    driven, alone = make_model(), make_model(seed=5)
    stream = []
    goals = ["at:4,3", "at:0,0", "at:4,0", "at:2,2"]
    for number in range(400):
        if not alone.goals:
            alone.set_goal([goals[number % 4]], priority=1.0)
        tokens = grid.tokens()
        alone.sense(tokens)
        action = grid.do(alone.choose().action)
        alone.perform(action)
        stream.append((tokens, action))
    assert follow(driven, stream).hypotheses == alone.hypotheses


def test_counts_and_mean_describe_the_lists(make_model: MakeModel, grid: Grid, tour: Tour) -> None:
    model = make_model()
    assert model.mean_cm == 0.0
    tour(model, grid, 300)
    assert model.sign_count == len(model.signs) == len(grid.places)
    assert model.hypothesis_count == len(model.hypotheses)
    mean = sum(h.cm for h in model.hypotheses) / model.hypothesis_count
    assert model.mean_cm == pytest.approx(mean)


def plain_learning(
    stream: Sequence[tuple[tuple[str, ...], str | None]], reach: int, alpha: float, beta: float
) -> dict[Cause, float]:
    """The rules in their plainest form: examine everything in every cycle, remove nothing."""
    cm: dict[Cause, float] = {}
    born: dict[Cause, int] = {}
    known: set[tuple[str, ...]] = set()
    for now, (tokens, _) in enumerate(stream):
        active = {(token,) for token in tokens}
        lags = [(t, stream[now - t]) for t in range(1, min(reach, now) + 1)]
        traces = {(t, action, (token,)) for t, (then, action) in lags if action for token in then}
        due = [
            (context, action, outcome, t)
            for context, action, outcome, t in cm
            if (t, action, context) in traces and born[context, action, outcome, t] <= now - t
        ]
        for key in due:
            cm[key] += alpha * (1 - cm[key]) if key[2] in active else -beta * cm[key]
        for surprise in active - (known & {outcome for _, _, outcome, _ in due}):
            for t, action, context in traces:
                if (context, action, surprise, t) not in cm:
                    cm[context, action, surprise, t] = 0.5
                    born[context, action, surprise, t] = now
        known |= active
    return cm


@settings(max_examples=200)
@given(stream=streams, reach=st.integers(1, 3), alpha=st.floats(0, 1), beta=st.floats(0, 1))
def test_learning_follows_the_plain_rules_of_the_seed(
    make_model: MakeModel, stream: Stream, reach: int, alpha: float, beta: float
) -> None:
    """Without any rule of ours, that is; for some of these see `test_plain`."""
    model = follow(make_model(reach=reach, alpha=alpha, beta=beta, plain=True), stream)
    assert cm_of(model) == pytest.approx(plain_learning(stream, reach, alpha, beta))


@given(stream=streams, reach=st.integers(1, 3))
def test_the_lists_are_consistent(make_model: MakeModel, stream: Stream, reach: int) -> None:
    model = follow(make_model(reach=reach), stream)
    signs = set(model.signs)
    assert len(set(causes(model))) == model.hypothesis_count
    for hypothesis in model.hypotheses:
        assert {hypothesis.context, hypothesis.outcome} <= signs
        assert 1 <= hypothesis.delay <= reach
        assert 0.0 <= hypothesis.cm <= 1.0
        assert 0 <= hypothesis.successes <= hypothesis.predictions


@given(stream=streams, seed=st.integers(0, 9))
def test_the_same_seed_gives_the_same_lists_in_any_order_of_tokens(
    make_model: MakeModel, stream: Stream, seed: int
) -> None:
    model = follow(make_model(seed, learning_probability=0.5, reach=2), stream)
    turned = [(tokens[::-1], action) for tokens, action in stream]
    twin = follow(make_model(seed, learning_probability=0.5, reach=2), turned)
    assert (model.signs, model.hypotheses) == (twin.signs, twin.hypotheses)


def test_sense_is_refused_before_perform(make_model: MakeModel) -> None:
    model = make_model()
    model.sense(A)
    with pytest.raises(RuntimeError, match=r"end the cycle with perform\(action\)"):
        model.sense(A)


@pytest.mark.parametrize("early", [lambda m: m.choose(), lambda m: m.perform("N")])
def test_choose_and_perform_are_refused_before_sense(
    make_model: MakeModel, early: Callable[[DynamicExpectancyModel], object]
) -> None:
    with pytest.raises(RuntimeError, match=r"\(\) before sense\(\)"):
        early(make_model())
