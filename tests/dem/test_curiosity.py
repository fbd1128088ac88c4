"""The curious map, computed only as far as a choice needs it, against a plain, full one."""

from collections.abc import Sequence

import msgspec
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies._internal.core import DataObject

from farside.dem import Curiosity, DynamicExpectancyModel, Parameters
from farside.dem.policy.curiosity import CuriousMap, Lead
from tests.dem.conftest import Eventful, Live, MakeModel, RunCycle

COSTS = {"go": 2, "turn": 1}


def cost_of_trying(
    model: DynamicExpectancyModel, curiosity: Curiosity, sign: int, action: int
) -> float:
    learner = model._learner
    last = learner.trials.last_tried(sign * len(COSTS) + action)
    ago = learner.cycle - last
    return curiosity.optimistic_cost + (curiosity.restlessness / ago if last >= 0 else 0.0)


def implied(model: DynamicExpectancyModel, sign: int) -> Sequence[int]:
    """The Signs that a Sign implies, where that counts."""
    return model._signs.parts(sign) if model._parameters.whole_implies_parts else []


def plain_values(
    model: DynamicExpectancyModel, curiosity: Curiosity, goal: int | None
) -> dict[int, float]:
    """Cost from every known Sign, by relaxing all arcs until no value changes."""
    signs, hypotheses = model._learner.signs, model._learner.hypotheses
    known = signs.by_age()
    arcs = [
        (hypotheses.context[arc], hypotheses.outcome[arc], hypotheses.cost[arc])
        for arc in hypotheses.by_age()
    ]
    arcs += [(whole, part, 0.0) for whole in known for part in implied(model, whole)]
    value = {
        sign: min(cost_of_trying(model, curiosity, sign, action) for action in range(len(COSTS)))
        for sign in known
    }
    if goal is not None:
        value[goal] = 0.0
    before = None
    while before != value:
        before = dict(value)
        for context, outcome, cost in arcs:
            value[context] = min(value[context], cost + value[outcome])
    return value


def plain_lead(
    model: DynamicExpectancyModel,
    curiosity: Curiosity,
    goal: int | None,
    active: Sequence[int],
    *,
    last_action: int | None,
    rng: np.random.Generator,
) -> Lead:
    """The rules of `CuriousMap.lead`, applied to all values."""
    signs, hypotheses = model._learner.signs, model._learner.hypotheses
    value = plain_values(model, curiosity, goal)
    sign = min(active, key=lambda one: (value[one], signs.born[one]))
    contexts = [sign, *implied(model, sign)]
    ways = [
        (-hypotheses.cm[arc], hypotheses.born[arc], hypotheses.action[arc])
        for arc in hypotheses.by_age()
        if hypotheses.context[arc] in contexts
        and hypotheses.cost[arc] + value[hypotheses.outcome[arc]] == value[sign]
    ]
    if ways:
        return Lead(sign, min(ways)[2], value[sign], tries=False)
    tries = [
        min(cost_of_trying(model, curiosity, context, action) for context in contexts)
        for action in range(len(COSTS))
    ]
    tied = [action for action, cost in enumerate(tries) if cost == min(tries)]
    if last_action in tied:
        action = last_action
    else:
        action = tied[rng.integers(len(tied))] if len(tied) > 1 else tied[0]
    return Lead(sign, action, min(tries), tries=True)


@given(
    curiosity=st.builds(
        Curiosity,
        optimistic_cost=st.sampled_from([1, 4, 10.0]),
        restlessness=st.sampled_from([0, 16, 300.0]),
    ),
    # Powers of two throughout, so that many costs tie.
    parameters=st.builds(
        Parameters,
        alpha=st.just(0.5),
        beta=st.just(0.5),
        own_credit=st.booleans(),
        whole_implies_parts=st.booleans(),
        reach=st.integers(1, 2),
        maturity=st.integers(1, 6),
        ineffective=st.sampled_from([0.02, 0.3]),
    ),
    lived=st.integers(0, 120),
    seed=st.integers(0, 20),
    data=st.data(),
)
def test_the_partial_map_gives_the_same_lead_as_a_full_one(
    eventful: Eventful,
    live: Live,
    *,
    curiosity: Curiosity,
    parameters: Parameters,
    lived: int,
    seed: int,
    data: DataObject,
) -> None:
    model = DynamicExpectancyModel(COSTS, parameters, rng=np.random.default_rng(1))
    curious = msgspec.structs.replace(parameters, curiosity=curiosity)
    live(model, [(["a"], "go", None), (["b"], None, None), *eventful(lived, seed)])
    known = st.sampled_from(model._learner.signs.by_age())
    for _ in range(4):
        goal = data.draw(st.none() | known, "goal")
        active = data.draw(st.lists(known, min_size=1, max_size=4, unique=True), "active")
        for last_action in (None, 0, 1):
            ours, plain = (np.random.default_rng(2) for _ in "ab")
            lead = CuriousMap(model._learner, curious, goal, active).lead(last_action, ours)
            assert lead == plain_lead(
                model, curiosity, goal, active, last_action=last_action, rng=plain
            )
            assert ours.random() == plain.random()


def test_without_an_active_sign_there_is_no_lead(make_model: MakeModel, cycle: RunCycle) -> None:
    model = make_model()
    assert CuriousMap(model._learner, Parameters(), None, []).lead(None, model._rng) is None
    cycle(model, ["a"], "E")
    assert CuriousMap(model._learner, Parameters(), None, []).lead(None, model._rng) is None


def test_a_whole_with_the_value_of_its_part_decides_if_it_is_the_oldest(cycle: RunCycle) -> None:
    """East and west are equally far from the frontier; `dusk west` is known since it was a goal."""
    parameters = Parameters(own_credit=False, removal=False)
    model = DynamicExpectancyModel(COSTS, parameters, rng=np.random.default_rng(0))
    both = ["dusk", "west"]
    model.set_goal(both, priority=1.0)
    for tokens in (["east"], both, ["west"]):
        cycle(model, tokens, "turn")
        cycle(model, [], None)
    for tokens, outcome in ((["east"], ["frontier"]), (both, []), (["west"], ["frontier"])):
        cycle(model, tokens, "go")
        cycle(model, outcome, None)
    east, dusk = (model._signs.find(sign) for sign in [("east",), ("dusk", "west")])
    curious = Parameters(curiosity=Curiosity(optimistic_cost=1.0, restlessness=1e6))
    lead = CuriousMap(model._learner, curious, None, [east, dusk]).lead(None, model._rng)
    assert lead == Lead(dusk, 0, 1.0 + 2 / 0.5, tries=False)
