"""The Dynamic Policy Map against a worked number, special cases and a plain reference."""

import math
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem import Parameters
from farside.dem.lists import ActionList, HypothesisList
from farside.dem.policy import DynamicPolicyMap

SIGNS = 7
# Halves and wholes are exact in floating point, so equal costs are equal to the last bit, and
# C_m of 1/2 and 1 makes costs 1, 2 and 4 tie with unequal C_m.
COSTS = {"a": 1.0, "b": 2.0}
EXACT = Parameters(alpha=1.0, beta=0.5, initial_cm=0.5)

sign = st.integers(0, SIGNS - 1)
rows = st.tuples(sign, st.integers(0, 1), sign, st.just(1))
arcs = st.lists(rows, max_size=30, unique=True)
trials = st.lists(st.tuples(st.integers(0, 29), st.booleans()), max_size=30)


def hypotheses_of(arcs, trials=(), parameters=EXACT):
    hypotheses = HypothesisList(ActionList(COSTS), parameters)
    for row in arcs:
        hypotheses.add(*row)
    for hypothesis, success in trials:
        if hypothesis < len(hypotheses):
            hypotheses.corroborate(hypothesis, success=success)
    return hypotheses


def bellman_ford(hypotheses, goal):
    """P_v straight from its definition: improve every Sign until none improves."""
    value = [math.inf] * SIGNS
    value[goal] = 0.0
    for _ in range(SIGNS):
        for context, outcome, cost in zip(
            hypotheses.context, hypotheses.outcome, hypotheses.cost, strict=True
        ):
            value[context] = min(value[context], cost + value[outcome])
    return value


@given(arcs, trials, sign)
def test_values_are_those_of_a_plain_bellman_ford_even_where_costs_tie(arcs, trials, goal):
    hypotheses = hypotheses_of(arcs, trials)
    assert DynamicPolicyMap(goal, SIGNS, hypotheses).value == bellman_ford(hypotheses, goal)


@given(arcs, trials, sign)
def test_best_is_the_least_value_then_the_higher_cm_then_the_older(arcs, trials, goal):
    hypotheses = hypotheses_of(arcs, trials)
    policy = DynamicPolicyMap(goal, SIGNS, hypotheses)
    for context in range(SIGNS):
        ways = [
            (hypotheses.cost[h] + policy.value[hypotheses.outcome[h]], -hypotheses.cm[h], h)
            for h in range(len(hypotheses))
            if hypotheses.context[h] == context
        ]
        value, _, best = min(ways, default=(math.inf, 0.0, -1))
        lost = context == goal or math.isinf(value)
        assert policy.best[context] == (-1 if lost else best)


@given(arcs, trials, sign)
def test_walks_reach_the_goal_in_valence_depth_steps_and_cost_their_value(arcs, trials, goal):
    hypotheses = hypotheses_of(arcs, trials)
    policy = DynamicPolicyMap(goal, SIGNS, hypotheses)
    for start in range(SIGNS):
        walk = list(islice(policy.walk(start), SIGNS + 1))
        if math.isinf(policy.value[start]):
            assert (walk, policy.depth[start]) == ([], -1)
        else:
            assert len(walk) == policy.depth[start]
            assert sum(hypotheses.cost[h] for h in walk) == policy.value[start]
            assert [start, *(hypotheses.outcome[h] for h in walk)][-1] == goal


@given(arcs, trials, sign, st.lists(sign, unique=True))
def test_the_entry_is_the_active_sign_nearest_to_the_goal(arcs, trials, goal, active):
    hypotheses = hypotheses_of(arcs, trials)
    policy = DynamicPolicyMap(goal, SIGNS, hypotheses)
    entry = policy.entry(active)
    near = [s for s in active if policy.value[s] < math.inf]
    if goal in active or not near:
        assert entry is None
    else:
        best = policy.best
        assert entry == min(near, key=lambda s: (policy.value[s], -hypotheses.cm[best[s]], best[s]))


def test_a_sure_detour_beats_a_doubtful_short_cut():
    """0 → 2 at C_m 1/8 costs 1/(1/8) = 8; 0 → 1 → 2 at C_m 1 costs 1 + 1."""
    hypotheses = hypotheses_of(
        [(0, 0, 2, 1), (0, 0, 1, 1), (1, 0, 2, 1)],
        trials=[(0, False), (0, False), (1, True), (2, True)],
    )
    policy = DynamicPolicyMap(2, SIGNS, hypotheses)
    assert policy.value[:3] == [2.0, 1.0, 0.0]
    assert list(policy.walk(0)) == [1, 2]


def test_a_chain_of_equal_steps_costs_their_number():
    hypotheses = hypotheses_of([(s, 1, s + 1, 1) for s in range(SIGNS - 1)])
    policy = DynamicPolicyMap(SIGNS - 1, SIGNS, hypotheses)
    assert policy.value == [4.0 * steps for steps in range(SIGNS - 1, -1, -1)]
    assert policy.depth == list(range(SIGNS - 1, -1, -1))


def test_of_equally_cheap_ways_the_surer_is_taken_though_younger():
    """0 → 1 → 3 and 0 → 2 → 3 both cost 6: a at C_m 1/4 or b at C_m 1/2, then a at 1/2."""
    hypotheses = hypotheses_of(
        [(0, 0, 1, 1), (0, 1, 2, 1), (1, 0, 3, 1), (2, 0, 3, 1)], trials=[(0, False)]
    )
    assert list(DynamicPolicyMap(3, SIGNS, hypotheses).walk(0)) == [1, 3]


def test_of_equally_cheap_and_sure_ways_the_older_is_taken_though_found_later():
    hypotheses = hypotheses_of([(0, 0, 2, 1), (0, 0, 1, 1), (1, 0, 3, 1), (2, 0, 3, 1)])
    assert list(DynamicPolicyMap(3, SIGNS, hypotheses).walk(0)) == [0, 3]


def test_of_equally_near_active_signs_the_surer_is_left_and_then_the_older():
    """0, 1 and 2 are all 4 from the goal; 0 by a at C_m 1/4, the others by b at C_m 1/2."""
    hypotheses = hypotheses_of([(0, 0, 3, 1), (2, 1, 3, 1), (1, 1, 3, 1)], trials=[(0, False)])
    policy = DynamicPolicyMap(3, SIGNS, hypotheses)
    assert policy.entry([0, 1]) == 1
    assert policy.entry([0, 1, 2]) == 2


def test_an_arc_that_never_works_is_no_arc():
    never = Parameters(initial_cm=0.0)
    policy = DynamicPolicyMap(1, SIGNS, hypotheses_of([(0, 0, 1, 1)], parameters=never))
    assert policy.value[0] == math.inf
    assert policy.entry([0]) is None


def test_costs_too_small_to_count_do_not_close_a_walk_into_a_loop():
    """1 → 0 and 0 → 1 cost 1 beside 10³⁰⁰, so that both ends tie; only 0 → 2 leads out."""
    hypotheses = hypotheses_of(
        [(0, 0, 2, 1), (1, 0, 0, 1), (0, 0, 1, 1)],
        trials=[(1, True), (2, True)],
        parameters=Parameters(alpha=1.0, initial_cm=1e-300),
    )
    policy = DynamicPolicyMap(2, SIGNS, hypotheses)
    assert policy.value[0] == policy.value[1] == pytest.approx(1e300)
    assert list(islice(policy.walk(1), 5)) == [1, 0]
