"""Whatever happens: the goal pursued is the highest with a way, and costs are those of the lists.

The expected values are worked out anew in every cycle, from the lists that anybody can read.
"""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from restless import COSTS, cycles, signs
from restless import parameters as restless_parameters

from farside.dem import Aside, DynamicExpectancyModel, Goal, InherentGoal, Parameters, Sensed, Sign
from farside.dem.policy.planning import WATCHED
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread
from tests.dem.conftest import Event, Eventful, MakeModel, RunCycle

RULE = InherentGoal(when=("c",), goal=("d", "e"), priority=2)
A, B, C = ("at:A",), ("at:B",), ("at:C",)


def plain_values(model: DynamicExpectancyModel, goal: Sign) -> dict[Sign, float]:
    """P_v of every Sign from its definition: relax all arcs until no value changes."""
    credited = model._parameters.own_credit
    arcs = []
    for one in model.hypotheses:
        measure = one.credit if credited else one.cm
        arcs.append((one.context, COSTS[one.action] / measure, one.outcome))
    implies = model._parameters.whole_implies_parts
    wholes = model.signs if implies else ()
    arcs += [(s, 0.0, part) for s in wholes for part in model.signs if set(part) < set(s)]
    value, before = dict.fromkeys(model.signs, math.inf), None
    if goal in value:
        value[goal] = 0.0
    while value != before:
        before = dict(value)
        for context, cost, outcome in arcs:
            value[context] = min(value[context], cost + value[outcome])
    return value


class Witness:
    """Follows a model, and knows what it senses, wants and told."""

    def __init__(self, model: DynamicExpectancyModel) -> None:
        self.model = model
        self.active: Sequence[Sign] | None = None
        self.ages: dict[Sign, None] = {}
        self.told: dict[Sign, Aside | None] = {}
        self.owed: dict[Sign, float] = {}  # satisfied as they were set

    def set(self, sign: Sign, priority: float) -> None:
        """Set a goal: it is satisfied at once if it is active, and otherwise on the list."""
        satisfied = self.model.set_goal(sign, priority)
        is_here = self.active is not None and self.is_here(sign)
        assert satisfied == (Goal(sign, {"operator": priority}) if is_here else None)
        assert bool(self.model.goal_priorities(sign)) is not is_here
        if is_here:
            self.owed[sign] = priority

    def sensed(self, sensed: Sensed) -> None:
        self.active = sensed.active
        reached = {goal.tokens: goal.priorities for goal in sensed.reached}
        assert len(reached) == len(sensed.reached)
        for sign, priority in self.owed.items():
            assert reached[sign]["operator"] == priority or self.is_here(sign)
        for sign in reached:
            assert self.is_here(sign) or sign in self.owed
        self.owed.clear()
        for goal in sensed.reached:
            self.ages.pop(goal.tokens, None)
            self.told.pop(goal.tokens, None)
        self.keep_up()
        for sign in sensed.recovered:
            assert self.told.pop(sign) is not None
        for goal in sensed.suspended:
            assert self.told.get(goal.tokens) is not goal.aside
            self.told[goal.tokens] = goal.aside
        assert self.told == {g.tokens: g.aside for g in self.model.goals if g.aside}

    def keep_up(self) -> None:
        """Note the goals that came, and forget those that went."""
        wanted = [goal.tokens for goal in self.model.goals]
        for gone in [sign for sign in self.ages if sign not in wanted]:
            del self.ages[gone]
            self.told.pop(gone, None)
        for sign in sorted(set(wanted) - set(self.ages)):
            self.ages[sign] = None

    def cost(self, goal: Sign) -> float:
        value = plain_values(self.model, goal)
        least = min((value[sign] for sign in self.active), default=math.inf)
        return 0.0 if self.is_here(goal) else least

    def is_here(self, goal: Sign) -> bool:
        """Whether it is sensed."""
        return set(goal) <= {token for sign in self.active for token in sign}

    def agrees(self) -> None:
        self.keep_up()
        goals = self.model.goals
        if self.active is None:
            assert [goal.aside for goal in goals] == [None] * len(goals)
            return
        assert not any(self.is_here(goal.tokens) for goal in goals)
        by_rank = sorted(goals, key=lambda g: (-g.priority, list(self.ages).index(g.tokens)))
        assert list(goals) == sorted(by_rank, key=lambda goal: goal.aside is not None)
        cost = {goal.tokens: self.cost(goal.tokens) for goal in goals}
        waits = self.model._parameters.put_aside
        can_be = [
            goal
            for goal in by_rank
            if goal.aside is not Aside.BLOCKED and (cost[goal.tokens] < math.inf or not waits)
        ]
        top = goals[0] if goals and goals[0].aside is None else None
        assert top == (can_be[0] if can_be else None)
        for goal in goals:
            if goal.aside in {Aside.UNKNOWN, Aside.UNREACHABLE}:
                assert cost[goal.tokens] == math.inf
            unknown = waits and goal.tokens not in self.model.signs
            assert (goal.aside is Aside.UNKNOWN) == unknown
            assert self.model._parameters.break_point or goal.aside is not Aside.BLOCKED
        self.goes_to(top, 0.0 if top is None else cost[top.tokens])

    def goes_to(self, top: Goal | None, cost: float) -> None:
        path, why = self.model.policy_path(), self.model.why()
        assert (path != ()) == (why is not None) == (top is not None and 0 < cost < math.inf)
        if path:
            assert path[0].cost_to_go == why.cost_to_go == cost
            assert path[0].action == why.action
        choice = self.model.choose(explore=False)
        assert (choice and choice.goal) == (top.tokens if top and path else None)

    def asks(self, goal: Sign, start: Sign) -> None:
        value = plain_values(self.model, goal)
        here = [name for name in value if set(name) <= set(start)] if start in value else []
        least = min((value[name] for name in here), default=math.inf)
        expected = 0.0 if set(goal) <= set(start) else least
        assert self.model.cost_to(goal, start) == expected
        known = self.model._signs.find(goal)
        if known is not None:
            spread = Spread(self.model._hypotheses, self.model._signs, self.model._parameters)
            fresh = PolicyMap(known, spread).value
            assert fresh == [value.get(name, math.inf) for name in self.model._signs.names]
            assert self.active is None or self.model.cost_to(goal) == self.cost(goal)


Questions = Sequence[tuple[Sequence[str], Sequence[str]]]
questions = st.lists(st.tuples(signs, signs), max_size=3)


@given(
    parameters=restless_parameters,
    lived=st.integers(0, 100),
    stream=st.lists(st.tuples(cycles, questions), max_size=12),
    early=st.lists(signs, max_size=2),
)
def test_the_goal_pursued_is_the_highest_with_a_way_and_costs_are_exact(
    eventful: Eventful,
    *,
    parameters: Parameters,
    lived: int,
    stream: Sequence[tuple[Event, Questions]],
    early: Sequence[Sequence[str]],
) -> None:
    model = DynamicExpectancyModel(COSTS, parameters, rng=np.random.default_rng(1), inherent=[RULE])
    witness = Witness(model)
    for sign in early:
        model.set_goal(sign, priority=1.0)
        witness.agrees()
    beforehand: list[tuple[Event, Questions]] = [(event, []) for event in eventful(lived)]
    for number, ((tokens, action, change), asked) in enumerate([*beforehand, *stream]):
        is_checked = number >= lived
        witness.sensed(model.sense(tokens))
        if is_checked:
            witness.agrees()
        for goal, start in asked:
            witness.asks(tuple(goal), tuple(start))
        match change:
            case "set", sign, priority:
                witness.set(tuple(sign), priority)
            case "withdraw", sign, _:
                model.withdraw_goal(sign)
        witness.keep_up()
        if is_checked:
            witness.agrees()
        if action == "as it chooses":
            choice = model.choose()
            action = choice.action if choice else None  # noqa: PLW2901 - which is performed
        model.perform(action)
        for goal, start in asked:
            witness.asks(tuple(goal), tuple(start))


# --- the cost to any Sign ----------------------------------------------------------------------


@pytest.fixture
def led(make_model: MakeModel, cycle: RunCycle) -> DynamicExpectancyModel:
    """A model that was led from A by E to B, and on by N to C, where it is."""
    model = make_model()
    for tokens, action in [(A, "E"), (B, "N"), (C, None)]:
        cycle(model, tokens, action)
    return model


def test_the_cost_to_a_sign_needs_no_goal(led: DynamicExpectancyModel) -> None:
    assert led.cost_to(C, A) == 2 * 2.66 / 0.5
    assert led.cost_to(C, B) == 2.66 / 0.5
    assert led.cost_to(A, B) == math.inf
    assert led.cost_to(A) == math.inf
    led.sense(A)
    assert led.cost_to(C) == 2 * 2.66 / 0.5
    assert led.goals == ()


def test_what_is_active_or_implied_costs_nothing(led: DynamicExpectancyModel) -> None:
    assert led.cost_to(C) == 0.0
    assert led.cost_to(B, [*B, "dust"]) == 0.0
    led.sense([*A, "dust"])
    assert led.cost_to([*A, "dust"]) == 0.0


def test_what_is_unknown_cannot_be_reached_and_nothing_leads_from_it(
    led: DynamicExpectancyModel,
) -> None:
    assert led.cost_to(["at:nowhere"]) == math.inf
    assert led.cost_to(["at:nowhere"], A) == math.inf
    assert led.cost_to(C, ["at:nowhere"]) == math.inf
    assert led.cost_to(C, []) == math.inf


def test_before_the_first_sense_every_cost_is_infinite(make_model: MakeModel) -> None:
    assert make_model().cost_to(A) == math.inf


def test_the_cost_to_nothing_and_to_a_string_is_refused(led: DynamicExpectancyModel) -> None:
    with pytest.raises(ValueError, match="goal: expected one Token at least, found none"):
        led.cost_to([])
    with pytest.raises(TypeError, match="write"):
        led.cost_to("at:A")
    with pytest.raises(TypeError, match="write"):
        led.cost_to(A, "at:A")


def test_costs_follow_what_is_learned_in_the_same_cycle(
    led: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    assert led.cost_to(C, A) == 2 * 2.66 / 0.5
    cycle(led, A, "E")
    led.sense(C)
    assert led.cost_to(C, A) == 2.66 / 0.5


def test_the_maps_of_the_last_few_signs_asked_for_are_kept_and_no_others(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    known = [(f"at:{place:02}",) for place in range(WATCHED + 4)]
    for seen in [*known, ("elsewhere",)]:
        cycle(model, seen, "E")
    for place in known:
        model.cost_to(place)
    model.cost_to(known[-WATCHED])
    model.cost_to(known[0])
    cycle(model, ["elsewhere"], "E")
    kept = dict(model._planner._maps)
    assert sorted(kept) == [known[0], known[-WATCHED], *known[-WATCHED + 2 :]]
    cycle(model, known[1], "E")
    for asked, policy in kept.items():
        model.cost_to(asked)
        assert model._planner._maps[asked] is policy


def test_a_sign_that_was_removed_and_became_known_again_is_asked_for_anew(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    both = ("at:A", "drill:out")
    model = make_model()
    for _ in range(2):
        model.set_goal(both, priority=1.0)
        for tokens, action in [(A, "E"), (both, None), (["dust"], None), (["dust"], None)]:
            cycle(model, tokens, action)
            model.set_goal(both, priority=1.0)
        assert 0 < model.cost_to(both, A) < math.inf
        model.withdraw_goal(both)
        assert both not in model.signs
        assert model.cost_to(both, A) == math.inf
        cycle(model, ["takes its id"], None)


# --- what an action leads to, and why ----------------------------------------------------------


def test_what_is_expected_is_the_most_credible_outcome(
    led: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    led.sense(A)
    expected = led.expected("E")
    assert (expected.context, expected.action, expected.outcome, expected.cm) == (A, "E", B, 0.5)
    assert led.expected("W") is None
    led.perform("E")
    cycle(led, C, None)
    led.sense(A)
    assert led.expected("E").outcome == C
    assert led.expected("E") in led.hypotheses


def test_of_equally_credible_ones_the_longest_context_counts_then_the_oldest(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """E led from A at dusk to B and to C, once each time, and never from A alone."""
    dusk = ("at:A", "dusk")
    model = make_model(own_credit=False, averaging=False, beta=0.0, alpha=0.0)
    model.set_goal(dusk, priority=1.0)
    for tokens, action in [(A, "E"), (B, None), (dusk, "E"), (C, None), (dusk, "E"), (B, None)]:
        cycle(model, tokens, action)
    model.sense(dusk)
    expected = model.expected("E")
    assert {one.cm for one in model.hypotheses} == {0.5}
    assert (expected.context, expected.outcome) == (dusk, C)
    model.perform(None)
    model.sense(A)
    assert model.expected("E").outcome == B


def test_nothing_is_expected_before_the_first_sense(make_model: MakeModel) -> None:
    assert make_model().expected("E") is None


def test_an_unknown_action_is_refused(led: DynamicExpectancyModel) -> None:
    with pytest.raises(ValueError, match="unknown action 'jump': expected one of 'E', 'N', 'S'"):
        led.expected("jump")


def test_a_reason_tells_c_m_and_by_how_much_the_runner_up_is_dearer(
    led: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    led.set_goal(C, priority=1.0)
    led.sense(A)
    why = led.why()
    assert (why.cm, why.runner_up, why.margin) == (0.5, None, None)
    led.perform("E")
    for tokens, action in [(B, "N"), (C, None), (A, "W"), (C, None)]:
        cycle(led, tokens, action)
        led.set_goal(C, priority=1.0)
    led.sense(A)
    why = led.why()
    assert (why.action, why.runner_up.action) == ("W", "E")
    assert why.margin == why.runner_up.cost_to_go - why.cost_to_go > 0
    assert why.cm in {one.cm for one in led.hypotheses if one.context == A and one.action == "W"}
    assert why.runner_up.margin is None
