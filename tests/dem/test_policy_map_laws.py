"""The Dynamic Policy Map against its definition, whatever the changes of the lists."""

import math
from itertools import islice

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule
from hypothesis.strategies._internal.core import DataObject
from policy_lists import TOKENS, Lists, Persistent, by_scipy

from farside.dem import Parameters
from farside.dem.policy.detour import Detour
from farside.dem.policy.spread import Spread

# Integers produce exact ties. 1e-300 and 1e300 vanish or dominate beside others, and an infinite
# cost is that of a hypothesis that never came true.
COSTS = [1.0, 2.0, 3.0, 1e-300, 1e300, math.inf]

costs = st.sampled_from(COSTS)
cms = st.sampled_from([0.25, 0.5, 1.0])
compounds = st.sets(st.sampled_from(TOKENS), min_size=2, max_size=3).map(sorted).map(tuple)


class RepairedMap(RuleBasedStateMachine):
    """After any changes the map equals its definition, to the last bit."""

    spread: type[Spread] = Persistent
    parameters = Parameters()

    @initialize(goal=st.sampled_from([("a",), ("a", "b")]))
    def begin(self, goal: tuple[str, ...]) -> None:
        self.lists = Lists(parameters=self.parameters)
        self.goal = self.lists.know(goal)
        self.policy = self.lists.map(self.goal, self.lists.spread(self.spread))
        self.detour = Detour(self.policy, self.lists.hypotheses)

    @rule(data=st.data(), cost=costs, cm=cms, action=st.integers(0, 1))
    def make(self, data: DataObject, cost: float, cm: float, action: int) -> None:
        known = st.sampled_from([sign for sign, name in enumerate(self.lists.signs.names) if name])
        self.lists.link(data.draw(known), data.draw(known), cost, cm, action)

    @precondition(lambda self: self.lists.arcs)
    @rule(data=st.data(), cost=costs, cm=cms)
    def reprice(self, data: DataObject, cost: float, cm: float) -> None:
        self.lists.reprice(data.draw(st.sampled_from(sorted(self.lists.arcs))), cost, cm)

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
        self.lists.follow(self.policy, self.detour)
        self.check()

    @rule()
    def note(self) -> None:
        """Nothing is asked: what is pending grows."""
        self.lists.follow(self.policy, self.detour)

    @rule(data=st.data())
    def ask(self, data: DataObject) -> None:
        """Only as far as somebody asks are the values to be right."""
        self.lists.follow(self.policy, self.detour)
        lists, policy = self.lists, self.policy
        known = [sign for sign, name in enumerate(lists.signs.names) if name]
        active = data.draw(st.lists(st.sampled_from(known), max_size=3))
        value = lists.bellman_ford(self.goal)
        least = min((value[sign] for sign in active), default=math.inf)
        entry, fresh = policy.entry(active), lists.map(self.goal)
        assert policy.nearest(active) == least
        assert entry == fresh.entry(active)
        if entry is not None:
            assert policy.why(entry) == fresh.why(entry)
            assert list(islice(policy.walk(entry), 100)) == list(fresh.walk(entry))
            assert policy.planned(active, lists.actions) == lists.planned(fresh, entry)
            without = self.detour.outlook(policy.best(entry), active, lists.actions)
            assert without == lists.detour(self.goal, active)

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
        """The best arc by rank is taken unless it could loop, and the walk reaches the goal."""
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


class RepairedOrNewMap(RepairedMap):
    """The same where a large change leads to a new map halfway through a repair."""

    spread = Spread


class PlainMap(RepairedMap):
    """The seed's map: nothing but hypotheses."""

    parameters = Parameters(plain=True)


TestPlainMap = PlainMap.TestCase
TestPlainMap.settings = settings(max_examples=15, stateful_step_count=40, deadline=None)
TestRepairedMap = RepairedMap.TestCase
TestRepairedMap.settings = settings(max_examples=100, stateful_step_count=40, deadline=None)
TestRepairedOrNewMap = RepairedOrNewMap.TestCase
TestRepairedOrNewMap.settings = settings(max_examples=50, stateful_step_count=40, deadline=None)
