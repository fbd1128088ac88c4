"""Plans: what the best paths of a map cost if every action succeeds at the first attempt.

To know it takes a walk to the goal. What a walk has found is kept, and of that only what changes is
looked at again, so that nobody walks the same path cycle after cycle.
"""

from collections.abc import Iterable
from typing import Protocol

from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.spread import Spread

# A walk step by step takes about so many times as long as for all Signs at once.
_FEW, _AT_ONCE = 500, 64


class Ways(Protocol):
    """What a plan needs of a policy map; see `farside.dem.policy.policy_map.PolicyMap`."""

    def best(self, sign: int) -> int | None:
        """The hypothesis to act on at a Sign."""

    def bests(self, start: int) -> list[int]:
        """By Sign, the hypotheses to act on where the value is at most that of `start`; else -1."""

    def is_final(self, sign: int) -> bool:
        """Whether the value of a Sign would be the same if it was asked for."""

    def descends(self, sign: int, arc: int) -> bool:
        """Whether a hypothesis leads from a Sign to one of strictly lesser value."""


class Plan:
    """The costs of the actions on the best paths from some Signs.

    planned(goal) = 0 and planned(s) = cost of the best action at s + planned(its outcome).

    Args:
        ways: the map.
        spread: the lists.
        actions: A.
    """

    def __init__(self, ways: Ways, spread: Spread, actions: ActionList) -> None:
        self._ways = ways
        self._arcs = spread.hypotheses
        self._implied = spread.implied
        self._actions = actions
        self._costs = actions.costs
        # By Sign: the serial number of what to act on, where that leads, and the cost from here on.
        self._born: dict[int, int] = {}
        self._onward: dict[int, int] = {}
        self._planned: dict[int, float] = {}
        # By Sign, the wholes among these that act on its hypotheses.
        self._wholes: dict[int, dict[int, None]] = {}
        self._touched: dict[int, None] = {}

    def note(self, changes: Iterable[CostChange], signs: Iterable[int]) -> None:
        """Note changes of the lists; see `farside.dem.policy.repair.RepairedValues.update`."""
        for change in changes:
            self._touch(change.context)
        for sign in signs:
            self._touch(sign)
            for whole in self._implied.wholes(sign):
                self._touch(whole)

    def moved(self, signs: Iterable[int]) -> None:
        """Note that the values of some Signs changed."""
        context = self._arcs.context
        for sign in signs:
            for arc in self._arcs.of_outcome(sign):
                self._touch(context[arc])

    def planned(self, start: int) -> float:
        """The cost of the actions on the best path from a Sign, whose value is final."""
        if self._costs is not self._actions.costs:
            self._costs = self._actions.costs
            self._planned.clear()
        for sign in self._touched:
            self._look_again(sign)
        self._touched.clear()
        if start in self._planned:
            return self._planned[start]
        walked = self._walk(start)
        sign = self._arcs.outcome[walked[-1][1]] if walked else start
        planned, keep = self._planned.get(sign, 0.0), True
        for sign, arc in reversed(walked):
            planned = self._costs[self._arcs.action[arc]] + planned
            # Among equal values, the way depends on more than on what is next.
            keep = keep and self._ways.descends(sign, arc)
            if keep:
                self._born[sign], self._onward[sign] = self._arcs.born[arc], self._arcs.outcome[arc]
                self._planned[sign] = planned
                self._be_told(sign)
        return planned

    def _walk(self, start: int) -> list[tuple[int, int]]:
        """The Signs on the way, and what to act on there, as far as that is not known."""
        walked: list[tuple[int, int]] = []
        outcome, known, sign = self._arcs.outcome, self._planned, start
        patience = _FEW + len(self._arcs) // _AT_ONCE
        while sign not in known and len(walked) < patience:
            arc = self._ways.best(sign)
            if arc is None:
                return walked
            walked.append((sign, arc))
            sign = outcome[arc]
        if sign not in known:
            best = self._ways.bests(sign)
            while sign not in known and best[sign] >= 0:
                walked.append((sign, best[sign]))
                sign = outcome[best[sign]]
        return walked

    def _touch(self, sign: int) -> None:
        if sign in self._planned:
            self._touched[sign] = None
        if sign in self._wholes:
            self._touched.update(self._wholes[sign])

    def _look_again(self, sign: int) -> None:
        if sign not in self._planned:
            return
        arc = self._ways.best(sign) if self._ways.is_final(sign) else None
        stands = arc is not None and self._arcs.born[arc] == self._born[sign]
        if arc is not None and stands and self._ways.descends(sign, arc):
            self._be_told(sign)
        else:
            self._forget(sign)

    def _be_told(self, sign: int) -> None:
        for part in self._implied.parts(sign):
            self._wholes.setdefault(part, {})[sign] = None

    def _forget(self, sign: int) -> None:
        """Forget a Sign, and all whose paths lead through it."""
        gone, context = [sign], self._arcs.context
        for one in gone:
            if self._planned.pop(one, None) is None:
                continue
            for part in self._implied.parts(one) if self._wholes else ():
                self._wholes.get(part, {}).pop(one, None)
            # Who leads here by what is no longer so is looked at again by itself.
            for arc in self._arcs.of_outcome(one):
                before = context[arc]
                wholes = self._wholes.get(before, ())
                gone += [other for other in (before, *wholes) if self._leads(other, one)]

    def _leads(self, sign: int, onward: int) -> bool:
        return sign in self._planned and self._onward[sign] == onward
