"""Lists with costs that a test chooses, and their policy map."""

import math
from collections.abc import Sequence
from functools import reduce
from itertools import islice

import pytest

from farside.dem import Parameters
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.lists.signs import SignList
from farside.dem.policy import spread as spread_module
from farside.dem.policy.detour import Detour
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread

TOKENS = "abcd"
DEFAULTS = Parameters()


class Lists:
    """Hypotheses with costs that a test chooses, and the test's own record of them."""

    def __init__(self, tokens: str = TOKENS, parameters: Parameters = DEFAULTS) -> None:
        self.signs = SignList()
        self.parameters = parameters
        self.actions = ActionList({"x": 1.0, "y": 2.66})
        self.hypotheses = HypothesisList(self.actions, parameters)
        self.arcs: dict[int, tuple[int, int]] = {}
        self.changes: list[CostChange] = []
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
        self.changes.append(CostChange(arc, context, outcome, math.inf))
        return arc

    def reprice(self, arc: int, cost: float, cm: float | None = None) -> None:
        context, outcome = self.arcs[arc]
        self.changes.append(CostChange(arc, context, outcome, self.hypotheses.cost[arc]))
        self.hypotheses.cost[arc] = cost
        self.hypotheses.cm[arc] = self.hypotheses.cm[arc] if cm is None else cm

    def cut(self, arc: int) -> None:
        context, outcome = self.arcs.pop(arc)
        self.changes.append(CostChange(arc, context, outcome, self.hypotheses.cost[arc]))
        self.hypotheses.remove(arc)

    def spread(self, kind: type[Spread] = Spread) -> Spread:
        return kind(self.hypotheses, self.signs, self.parameters)

    def map(self, goal: int, spread: Spread | None = None) -> PolicyMap:
        self.changes.clear()
        self.changed_signs.clear()
        return PolicyMap(goal, spread or self.spread())

    def follow(self, *maps: PolicyMap | Detour) -> None:
        for policy in maps:
            policy.update(self.changes, self.changed_signs)
        self.changes.clear()
        self.changed_signs.clear()

    def planned(self, policy: PolicyMap, start: int) -> float:
        """What the actions on the best path cost, by walking it, summed up from the goal."""
        action = self.hypotheses.action
        costs = [self.actions.costs[action[arc]] for arc in islice(policy.walk(start), 100)]
        return reduce(lambda onward, cost: cost + onward, reversed(costs), 0.0)

    def outlook(self, goal: int, active: Sequence[int]) -> tuple[float, float]:
        """The least value of some Signs, and what the actions on the path from there cost."""
        policy = self.map(goal)
        entry = policy.entry(active)
        if entry is None:
            return math.inf, math.inf
        return policy.value[entry], self.planned(policy, entry)

    def detour(self, goal: int, active: Sequence[int]) -> tuple[float, float]:
        """The same without the hypothesis to act on next."""
        policy, cost = self.map(goal), self.hypotheses.cost
        blocked = next(policy.walk(policy.entry(active) or 0))
        held, cost[blocked] = cost[blocked], math.inf
        found = self.outlook(goal, active)
        cost[blocked] = held
        return found

    def bellman_ford(self, goal: int) -> list[float]:
        """P_v from its definition: relax all arcs until no value changes."""
        names = [set(name) for name in self.signs.names]
        ways = [(*ends, self.hypotheses.cost[arc]) for arc, ends in self.arcs.items()]
        ways += [(w, p, 0.0) for w in range(len(names)) for p in range(len(names))
                 if self.implies(w, p)]  # fmt: skip
        value = [math.inf] * len(names)
        value[goal] = 0.0
        for _ in names:
            for before, after, cost in ways:
                value[before] = min(value[before], cost + value[after])
        return value

    def ways(self, policy: PolicyMap, sign: int) -> list[tuple[tuple[float, float, int], int]]:
        """The hypotheses that can be acted on at a Sign, each after (total, -C_m, age)."""
        listed = self.hypotheses
        return sorted(
            ((listed.cost[a] + policy.value[after], -listed.cm[a], listed.born[a]), a)
            for a, (before, after) in self.arcs.items()
            if before == sign or self.implies(sign, before)
        )

    def implies(self, whole: int, part: int) -> bool:
        """Whether a whole implies a part, where that counts."""
        tokens = set(self.signs.names[part])
        counts = self.parameters.whole_implies_parts
        return counts and bool(tokens) and tokens < set(self.signs.names[whole])


def by_scipy(lists: Lists, goal: int) -> PolicyMap:
    """The map as it is built for a model with very many hypotheses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spread_module, "FEW_ARCS", 0)
        return lists.map(goal)


class Persistent(Spread):
    """Always repaired, never built anew."""

    repairable = 1000
