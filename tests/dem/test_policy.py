"""The Dynamic Policy Map against worked numbers, special cases and a plain reference."""

import math
from itertools import islice

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule
from hypothesis.strategies._internal.core import DataObject

from farside.dem import Parameters
from farside.dem.lists.hypotheses import ActionList, Change, HypothesisList
from farside.dem.lists.signs import SignList
from farside.dem.policy import spread as spread_module
from farside.dem.policy.map import PolicyMap
from farside.dem.policy.spread import Spread

TOKENS = "abcd"
# Whole numbers tie, and tie to the last bit. The others vanish beside each other, and an infinite
# cost is that of a hypothesis that never came true.
COSTS = [1.0, 2.0, 3.0, 1e-300, 1e300, math.inf]

costs = st.sampled_from(COSTS)
cms = st.sampled_from([0.25, 0.5, 1.0])
compounds = st.sets(st.sampled_from(TOKENS), min_size=2, max_size=3).map(sorted).map(tuple)


class Lists:
    """Hypotheses at costs of the test's choice, and what the test itself knows of them."""

    def __init__(self, tokens: str = TOKENS) -> None:
        self.signs = SignList()
        actions = ActionList({"x": 1.0, "y": 1.0})
        self.hypotheses = HypothesisList(actions, Parameters())
        self.arcs: dict[int, tuple[int, int]] = {}
        self.changes: list[Change] = []
        self.changed_signs: list[int] = []
        for token in tokens:
            self.know((token,))

    def know(self, tokens: tuple[str, ...]) -> int:
        known = self.signs.find(tokens)
        if known is None:
            known = self.signs.add(tokens)
            self.changed_signs.append(known)
        return known

    def forget(self, sign: int) -> None:
        self.changed_signs += [sign, *self.signs.wholes(sign)]
        self.signs.remove(sign)

    def link(
        self, context: int, outcome: int, cost: float = 1.0, cm: float = 0.5, action: int = 0
    ) -> int:
        arc = self.hypotheses.add(context, action, outcome, 1, 0.5)
        self.hypotheses.cost[arc], self.hypotheses.cm[arc] = cost, cm
        self.arcs[arc] = (context, outcome)
        self.changes.append(Change(arc, context, outcome, math.inf))
        return arc

    def reprice(self, arc: int, cost: float) -> None:
        context, outcome = self.arcs[arc]
        self.changes.append(Change(arc, context, outcome, self.hypotheses.cost[arc]))
        self.hypotheses.cost[arc] = cost

    def cut(self, arc: int) -> None:
        context, outcome = self.arcs.pop(arc)
        self.changes.append(Change(arc, context, outcome, self.hypotheses.cost[arc]))
        self.hypotheses.remove(arc)

    def map(self, goal: int, spread: "Persistent | Spread | None" = None) -> PolicyMap:
        self.changes.clear()
        self.changed_signs.clear()
        return PolicyMap(goal, spread or Spread(self.hypotheses, self.signs))

    def follow(self, policy: PolicyMap) -> None:
        policy.update(self.changes, self.changed_signs)
        self.changes.clear()
        self.changed_signs.clear()

    def bellman_ford(self, goal: int) -> list[float]:
        """P_v straight from its definition: improve every Sign until none improves."""
        names = [set(name) for name in self.signs.names]
        ways = [(*ends, self.hypotheses.cost[arc]) for arc, ends in self.arcs.items()]
        ways += [(w, p, 0.0) for w in range(len(names)) for p in range(len(names))
                 if names[p] and names[p] < names[w]]  # fmt: skip
        value = [math.inf] * len(names)
        value[goal] = 0.0
        for _ in names:
            for before, after, cost in ways:
                value[before] = min(value[before], cost + value[after])
        return value

    def ways(self, policy: PolicyMap, sign: int) -> list[tuple[tuple[float, float, int], int]]:
        """What can be done at a Sign: (total, -C_m, age) and the hypothesis."""
        name, listed = set(self.signs.names[sign]), self.hypotheses
        return sorted(
            ((listed.cost[a] + policy.value[after], -listed.cm[a], listed.born[a]), a)
            for a, (before, after) in self.arcs.items()
            if set(self.signs.names[before]) <= name
        )


def by_scipy(lists: Lists, goal: int) -> PolicyMap:
    """The same map as for a model of very many hypotheses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spread_module, "FEW_ARCS", 0)
        return lists.map(goal)


class Persistent(Spread):
    """Never held to be not worth a repair."""

    repairable = 1000


class LearningChangesTheMap(RuleBasedStateMachine):
    """Whatever comes, changes and goes, the map is that of the definition, to the last bit."""

    spread: type[Persistent | Spread] = Persistent

    @initialize(goal=st.sampled_from([("a",), ("a", "b")]))
    def begin(self, goal: tuple[str, ...]) -> None:
        self.lists = Lists()
        self.goal = self.lists.know(goal)
        lists = self.lists
        self.policy = lists.map(self.goal, self.spread(lists.hypotheses, lists.signs))

    @rule(data=st.data(), cost=costs, cm=cms, action=st.integers(0, 1))
    def make(self, data: DataObject, cost: float, cm: float, action: int) -> None:
        known = st.sampled_from([sign for sign, name in enumerate(self.lists.signs.names) if name])
        self.lists.link(data.draw(known), data.draw(known), cost, cm, action)

    @precondition(lambda self: self.lists.arcs)
    @rule(data=st.data(), cost=costs)
    def reprice(self, data: DataObject, cost: float) -> None:
        self.lists.reprice(data.draw(st.sampled_from(sorted(self.lists.arcs))), cost)

    @precondition(lambda self: self.lists.arcs)
    @rule(data=st.data())
    def remove(self, data: DataObject) -> None:
        self.lists.cut(data.draw(st.sampled_from(sorted(self.lists.arcs))))

    @rule(tokens=compounds)
    def make_compound(self, tokens: tuple[str, ...]) -> None:
        self.lists.know(tokens)

    @rule(token=st.sampled_from("ef"))
    def make_sign(self, token: str) -> None:
        self.lists.know((token,))

    @rule(data=st.data())
    def forget_sign(self, data: DataObject) -> None:
        kept = {self.goal}.union(*self.lists.arcs.values())
        names = self.lists.signs.names
        idle = [sign for sign, name in enumerate(names) if len(name) > 1 and sign not in kept]
        if idle:
            self.lists.forget(data.draw(st.sampled_from(idle)))

    @rule()
    def update(self) -> None:
        self.lists.follow(self.policy)
        self.check()

    def teardown(self) -> None:
        if hasattr(self, "lists"):
            self.update()

    def check(self) -> None:
        lists, policy = self.lists, self.policy
        assert policy.value == lists.bellman_ford(self.goal)
        assert policy.value == lists.map(self.goal).value
        assert policy.value == by_scipy(lists, self.goal).value
        for sign, value in enumerate(policy.value):
            if 0.0 < value < math.inf:
                self.check_way(sign, value)
            else:
                assert policy.best(sign) is None
                assert policy.why(sign) is None
        self.check_table()

    def check_way(self, sign: int, value: float) -> None:
        """The best by rank is taken, unless it leads round in circles; and the walk arrives."""
        lists, policy = self.lists, self.policy
        best = policy.best(sign)
        ways = lists.ways(policy, sign)
        nearer = [
            arc for (total, *_), arc in ways
            if total == value and policy.value[lists.arcs[arc][1]] < value
        ]  # fmt: skip
        assert best == nearer[0] if nearer else best in [arc for (t, *_), arc in ways if t == value]
        walk = list(islice(policy.walk(sign), 100))
        assert len(walk) == policy.depth(sign) < 100
        assert policy.value[lists.arcs[walk[-1]][1]] == 0.0
        action = lists.hypotheses.action
        rivals = [(t, a) for (t, *_), a in ways if action[a] != action[best] and t < math.inf]
        rival_total, rival = rivals[0] if rivals else (math.inf, None)
        assert policy.why(sign) == (best, value, rival, rival_total)

    def check_table(self) -> None:
        policy = self.policy
        table = policy.table()
        signs = table.sign.tolist()
        assert sorted(signs) == [s for s, value in enumerate(policy.value) if value < math.inf]
        assert table.value.tolist() == sorted(policy.value[sign] for sign in signs)
        bests = [policy.best(sign) for sign in signs]
        assert table.best.tolist() == [-1 if best is None else best for best in bests]
        assert table.depth.tolist() == [policy.depth(sign) for sign in signs]


class LearningChangesTheMapOrMakesItAnew(LearningChangesTheMap):
    """The same where a large change makes the map anew halfway through a repair."""

    spread = Spread


TestRepairedMap = LearningChangesTheMap.TestCase
TestRepairedMap.settings = settings(max_examples=100, stateful_step_count=40, deadline=None)
TestRepairedOrNewMap = LearningChangesTheMapOrMakesItAnew.TestCase
TestRepairedOrNewMap.settings = settings(max_examples=50, stateful_step_count=40, deadline=None)


A, B, C, D = range(4)


@pytest.fixture
def lists() -> Lists:
    return Lists()


def test_a_sure_detour_beats_a_doubtful_short_cut(lists: Lists) -> None:
    """Here a → c costs 8; a → b → c costs 1 + 1."""
    short_cut = lists.link(A, C, 8.0)
    detour = [lists.link(A, B), lists.link(B, C)]
    policy = lists.map(C)
    assert policy.value == [2.0, 1.0, 0.0, math.inf]
    assert list(policy.walk(A)) == detour
    assert [policy.depth(sign) for sign in (A, B, C, D)] == [2, 1, 0, None]
    assert short_cut not in detour


def test_of_equally_cheap_ways_the_surer_is_taken_and_then_the_older(lists: Lists) -> None:
    lists.link(A, B, cm=0.25)
    older, younger = lists.link(A, C, cm=0.5), lists.link(A, D, cm=0.5)
    policy = lists.map(B)
    lists.link(C, B, 2.0)
    lists.link(D, B, 2.0)
    lists.reprice(0, 3.0)
    lists.follow(policy)
    assert policy.value[A] == 3.0
    assert policy.best(A) == older
    lists.hypotheses.cm[younger] = 1.0
    assert policy.best(A) == younger


def test_age_counts_from_when_a_hypothesis_was_made_and_not_by_its_row(lists: Lists) -> None:
    lists.cut(lists.link(D, D))
    older = lists.link(A, B, cm=0.5)
    spare = lists.link(D, D)
    lists.cut(older)
    middle = lists.link(A, B, cm=0.5)
    lists.cut(spare)
    youngest = lists.link(A, B, cm=0.5, action=1)
    assert lists.map(B).best(A) == middle
    lists.cut(middle)
    reused = lists.link(A, B, cm=0.5)
    assert reused == middle
    assert lists.map(B).best(A) == youngest


def test_of_equally_near_active_signs_the_surer_is_left_and_then_the_older(lists: Lists) -> None:
    lists.link(A, D, cm=0.25)
    lists.link(C, D, cm=0.5)
    lists.link(B, D, cm=0.5)
    policy = lists.map(D)
    assert policy.entry([A, B]) == B
    assert policy.entry([A, B, C]) == C


def test_there_is_no_entry_off_the_map_nor_at_the_goal(lists: Lists) -> None:
    lists.link(A, B)
    policy = lists.map(B)
    assert policy.entry([]) is None
    assert policy.entry([C, D]) is None
    assert policy.entry([A, B]) is None
    assert policy.entry([D, A]) == A


def test_why_names_the_best_way_of_another_action_too(lists: Lists) -> None:
    best = lists.link(A, D, 2.0)
    lists.link(A, D, 3.0)
    lists.link(A, D, 5.0, action=1)
    rival = lists.link(A, B, 1.0, action=1)
    lists.link(B, D, 3.0)
    assert lists.map(D).why(A) == (best, 2.0, rival, 4.0)


def test_why_does_without_a_rival_where_no_other_action_leads_to_the_goal(lists: Lists) -> None:
    best = lists.link(A, D, 2.0)
    lists.link(A, B, 1.0, action=1)
    assert lists.map(D).why(A) == (best, 2.0, None, math.inf)


def test_whoever_reaches_a_compound_has_reached_its_parts(lists: Lists) -> None:
    """Here a → {b, c} at 1, and b → d at 2: b is reached with {b, c}, and acted from."""
    whole = lists.know(("b", "c"))
    to_whole, onward = lists.link(A, whole), lists.link(B, D, 2.0)
    policy = lists.map(D)
    assert (policy.value[whole], policy.value[A]) == (2.0, 3.0)
    assert list(policy.walk(A)) == [to_whole, onward]
    assert policy.depth(A) == 2


def test_a_compound_acts_on_the_surer_way_of_its_part_where_its_own_is_as_cheap(
    lists: Lists,
) -> None:
    whole = lists.know(("b", "c"))
    lists.link(whole, D, 2.0, cm=0.25)
    surer = lists.link(B, D, 2.0, cm=1.0)
    policy = lists.map(D)
    table = policy.table()
    assert policy.best(whole) == surer
    assert dict(zip(table.sign.tolist(), table.best.tolist(), strict=True))[whole] == surer


def test_a_compound_of_the_goal_is_the_goal_reached(lists: Lists) -> None:
    whole = lists.know(("b", "d"))
    to_whole = lists.link(A, whole)
    policy = lists.map(D)
    assert policy.value[whole] == 0.0
    assert list(policy.walk(A)) == [to_whole]


def test_a_compound_loses_what_its_part_loses(lists: Lists) -> None:
    whole = lists.know(("b", "c"))
    lists.link(A, whole)
    onward = lists.link(B, D, 2.0)
    policy = lists.map(D, Persistent(lists.hypotheses, lists.signs))
    lists.cut(onward)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0, math.inf]


def test_a_compound_loses_what_a_part_had_that_was_itself_forgotten(lists: Lists) -> None:
    """All of {a, b, c} that leads to d is what {a, b} knows; both go before the map hears."""
    part, whole = lists.know(("a", "b")), lists.know(("a", "b", "c"))
    onward = lists.link(part, D)
    policy = lists.map(D, Persistent(lists.hypotheses, lists.signs))
    assert policy.value[whole] == 1.0
    lists.cut(onward)
    lists.forget(part)
    lists.follow(policy)
    assert policy.value[whole] == math.inf


def test_costs_too_small_to_count_do_not_close_a_walk_into_a_loop(lists: Lists) -> None:
    """Here a → b and b → a cost 1 beside 10³⁰⁰, so that both ends tie; only b → d leads out."""
    there, _, out = lists.link(A, B, cm=1.0), lists.link(B, A, cm=1.0), lists.link(B, D, 1e300)
    policy = lists.map(D)
    assert policy.value[A] == policy.value[B] == 1e300
    assert list(islice(policy.walk(A), 5)) == [there, out]


def test_among_equals_the_walk_takes_the_nearest_way_out(lists: Lists) -> None:
    """Here c → a → b → d: surer ways lead back from a to c and from c to itself, all at 10³⁰⁰."""
    lists.link(A, C, cm=1.0)
    lists.link(C, C, cm=1.0)
    walk = [lists.link(C, A, cm=0.5), lists.link(A, B, cm=0.25), lists.link(B, D, 1e300)]
    policy = lists.map(D)
    assert list(islice(policy.walk(C), 5)) == walk
    assert policy.table().depth.tolist() == [0, 2, 1, 3]


def test_signs_that_tie_do_not_hold_each_other_up_when_the_way_out_is_gone(lists: Lists) -> None:
    lists.link(A, B)
    lists.link(B, A)
    out = lists.link(B, D, 1e300)
    policy = lists.map(D, Persistent(lists.hypotheses, lists.signs))
    lists.cut(out)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0]


def test_a_way_that_grew_cheaper_goes_with_what_it_led_to(lists: Lists) -> None:
    to_b, onward = lists.link(A, B, 3.0), lists.link(B, D)
    policy = lists.map(D, Persistent(lists.hypotheses, lists.signs))
    lists.reprice(to_b, 2.0)
    lists.cut(onward)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0]


@pytest.mark.parametrize("cost", [1.0, 9.0, math.inf])
def test_a_change_that_reaches_every_sign_reaches_it_though_the_repair_gives_way(
    cost: float,
) -> None:
    """Of six Signs one may lose its value, and two may spread, before the map is made anew."""
    lists = Lists("abcdef")
    *_, last = [lists.link(sign, sign + 1, 5.0) for sign in range(5)]
    policy = lists.map(5)
    lists.reprice(last, cost)
    lists.follow(policy)
    assert policy.value == [cost + 20.0, cost + 15.0, cost + 10.0, cost + 5.0, cost, 0.0]


def test_an_arc_whose_row_was_used_again_is_gone(lists: Lists) -> None:
    """Here a → d is removed and c → d takes its row at the same cost before the map hears."""
    gone = lists.link(A, D)
    policy = lists.map(D, Persistent(lists.hypotheses, lists.signs))
    lists.cut(gone)
    assert lists.link(C, D) == gone
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, 1.0, 0.0]


def test_a_goal_is_not_lost_with_a_way_round_from_it(lists: Lists) -> None:
    lists.know(("a", "d"))
    policy = lists.map(4, Persistent(lists.hypotheses, lists.signs))
    lists.changed_signs.append(4)
    lists.follow(policy)
    assert policy.value[4] == 0.0


def test_very_many_parallel_arcs_count_as_the_cheapest(lists: Lists) -> None:
    for cost in (3.0, 2.0, 4.0):
        lists.link(A, D, cost)
    assert by_scipy(lists, D).value == [2.0, math.inf, math.inf, 0.0]


def test_one_spread_serves_goal_after_goal_as_the_lists_change(lists: Lists) -> None:
    spread = Spread(lists.hypotheses, lists.signs)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spread_module, "FEW_ARCS", 0)
        arc = lists.link(A, B, 2.0)
        assert lists.map(B, spread).value == [2.0, 0.0, math.inf, math.inf]
        lists.reprice(arc, 3.0)
        assert lists.map(B, spread).value == [3.0, 0.0, math.inf, math.inf]
        lists.link(C, A)
        assert lists.map(A, spread).value == [0.0, math.inf, 1.0, math.inf]
        lists.know(("a", "b"))
        assert lists.map(A, spread).value == [0.0, math.inf, 1.0, math.inf, 0.0]
