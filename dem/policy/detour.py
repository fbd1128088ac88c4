"""Detours: the way to a goal if the hypothesis to act on next never came true again."""

import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from copy import copy

from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.expected_map import ExpectedMap
from farside.dem.policy.policy_map import PolicyMap


class Detour:
    """A policy map in which one hypothesis has an infinite cost, kept from cycle to cycle.

    Args:
        policy: the map of the goal.
        hypotheses: H.

    Attributes:
        of: the map of the goal.
    """

    def __init__(self, policy: PolicyMap | ExpectedMap, hypotheses: HypothesisList) -> None:
        self.of = policy
        self._map = copy(policy)
        self._map.part()
        self._hypotheses = hypotheses
        self._blocked: int | None = None

    def update(self, changes: Collection[CostChange], signs: Collection[int]) -> None:
        """Note changes of the lists, as the map of the goal does."""
        with self._unusable():
            self._map.update(changes, signs)

    def outlook(
        self, blocked: int, active: Sequence[int], actions: ActionList
    ) -> tuple[float, float]:
        """P_v of the best active Sign without the hypothesis `blocked`, and its planned cost.

        Both are infinite where no other way is known.
        """
        self._block(blocked)
        with self._unusable():
            return self._map.nearest(active), self._map.planned(active, actions)

    def _block(self, arc: int) -> None:
        if arc == self._blocked:
            return
        arcs, changes = self._hypotheses, []
        if self._blocked is not None:
            free = self._blocked
            changes.append(CostChange(free, arcs.context[free], arcs.outcome[free], math.inf))
        changes.append(CostChange(arc, arcs.context[arc], arcs.outcome[arc], arcs.cost[arc]))
        self._blocked = arc
        self.update(changes, ())

    @contextmanager
    def _unusable(self) -> Iterator[None]:
        """Meanwhile the blocked hypothesis has an infinite cost."""
        arc, cost = self._blocked, self._hypotheses.cost
        if arc is None:
            yield
            return
        held, cost[arc] = cost[arc], math.inf
        try:
            yield
        finally:
            cost[arc] = held
