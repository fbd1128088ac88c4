"""A map that is asked a little in every cycle, against one that is built anew each time."""

from collections.abc import Sequence
from itertools import islice

import numpy as np
import pytest
from policy_lists import Lists, Persistent

from farside.dem import Parameters
from farside.dem.policy import plan
from farside.dem.policy.detour import Detour
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread

SIGNS = "abcdefghijkl"
GOAL = 0
# Small numbers tie often; beside the greatest, all others vanish.
COSTS = [1.0, 1.0, 2.0, 3.0, 8.0, 20.0, 1e17]
DEAR = [1.0, 1e17, 1e17]
CMS = [0.25, 0.5, 1.0]


class Stream:
    """Random changes of lists with some ten Signs, a few between two questions."""

    def __init__(self, seed: int, spread: type[Spread], parameters: Parameters) -> None:
        self.rng = np.random.default_rng(seed)
        self._costs = DEAR if seed % 3 == 2 else COSTS
        self.lists = Lists(SIGNS, parameters)
        for sign in range(1, len(SIGNS)):
            self.lists.link(sign, sign - 1)
        for _ in range(10):
            self._link()
        self.policy = self.lists.map(GOAL, self.lists.spread(spread))
        self.detour = Detour(self.policy, self.lists.hypotheses)

    def change(self) -> None:
        arcs = sorted(self.lists.arcs)
        match int(self.rng.integers(10)):
            case 0 | 1:
                self._link()
            case 2 if len(arcs) > 22:
                self.lists.cut(self._one_of(arcs))
            case 3:
                count = int(self.rng.integers(2, 4))
                tokens = self.rng.choice(list(SIGNS[:5]), count, replace=False)
                self.lists.know(tuple(sorted(tokens)))
            case 4:
                used = {GOAL}.union(*self.lists.arcs.values())
                idle = [sign for sign in self._known() if sign not in used and sign >= len(SIGNS)]
                if idle:
                    self.lists.forget(self._one_of(idle))
            case _ if arcs:
                arc = self._one_of(arcs)
                cost = self.lists.hypotheses.cost[arc] if self.rng.random() < 0.2 else None
                self.lists.reprice(arc, cost or self._cost(), float(self.rng.choice(CMS)))

    def active(self) -> list[int]:
        return [self._any() for _ in range(self.rng.integers(1, 3))]

    def _link(self) -> None:
        context, outcome, action = self._any(), self._any(), int(self.rng.integers(2))
        self.lists.link(context, outcome, self._cost(), float(self.rng.choice(CMS)), action)

    def _any(self) -> int:
        """A Sign, of several Tokens more often than not if there are any."""
        known = self._known()
        wholes = [sign for sign in known if len(self.lists.signs.names[sign]) > 1]
        return self._one_of(wholes if wholes and self.rng.random() < 0.6 else known)

    def _known(self) -> list[int]:
        return [sign for sign, name in enumerate(self.lists.signs.names) if name]

    def _cost(self) -> float:
        return float(self.rng.choice(self._costs))

    def _one_of(self, choices: Sequence[int]) -> int:
        return choices[int(self.rng.integers(len(choices)))]


@pytest.mark.parametrize(
    ("spread", "parameters"),
    [(Persistent, Parameters()), (Spread, Parameters()), (Persistent, Parameters(plain=True))],
)
@pytest.mark.parametrize("seed", [0, 9, 19])
def test_what_a_map_is_asked_it_answers_as_a_new_one_would(
    monkeypatch: pytest.MonkeyPatch, seed: int, spread: type[Spread], parameters: Parameters
) -> None:
    """Value, entry, reason, way, planned cost and detour, from one or two Signs in every cycle."""
    # Whether all Signs of a way are looked at at once.
    monkeypatch.setattr(plan, "_FEW", 500 * (seed % 2))
    stream = Stream(seed, spread, parameters)
    lists, policy = stream.lists, stream.policy
    detours = 0
    for _ in range(300):
        for _ in range(stream.rng.integers(4)):
            stream.change()
        lists.follow(policy, stream.detour)
        active, fresh = stream.active(), lists.map(GOAL)
        entry = policy.entry(active)
        assert policy.nearest(active) == min(fresh.value[sign] for sign in active)
        assert entry == fresh.entry(active)
        if entry is not None:
            agrees(policy, fresh, entry)
            if stream.rng.random() < 0.7:
                assert policy.planned(active, lists.actions) == lists.planned(fresh, entry)
            if stream.rng.random() < 0.7:
                without = stream.detour.outlook(fresh.best(entry), active, lists.actions)
                assert without == lists.detour(GOAL, active)
                detours += without[0] < float("inf")
    assert detours > 0


def agrees(policy: PolicyMap, fresh: PolicyMap, entry: int) -> None:
    assert policy.why(entry) == fresh.why(entry)
    assert list(islice(policy.walk(entry), 30)) == list(islice(fresh.walk(entry), 30))
