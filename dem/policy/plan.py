"""Plans: what the best paths of a map cost if every action succeeds at the first attempt.

To know it takes a walk to the goal. What a walk has found is kept, and of that only what changes is
looked at again, so that nobody walks the same path cycle after cycle.
"""

from collections.abc import Iterable
from typing import NamedTuple, Protocol

from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.spread import Spread


class Ways(Protocol):
    """What a plan needs of a policy map; see `farside.dem.policy.policy_map.PolicyMap`."""

    def best(self, sign: int) -> int | None:
        """The hypothesis to act on at a Sign."""

    def is_final(self, sign: int) -> bool:
        """Whether the value of a Sign would be the same if it was asked for."""

    def descends(self, sign: int, arc: int) -> bool:
        """Whether a hypothesis leads from a Sign to one of strictly lesser value."""


class _Step(NamedTuple):
    """What to act on at a Sign, by its serial number, where it leads, and the cost from here on."""

    born: int
    outcome: int
    planned: float


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
        self._steps: dict[int, _Step] = {}
        # By Sign, those that step to it, and those that act on its hypotheses as wholes.
        self._before: dict[int, dict[int, None]] = {}
        self._wholes: dict[int, dict[int, None]] = {}
        self._touched: dict[int, None] = {}

    def note(self, changes: Iterable[CostChange], signs: Iterable[int]) -> None:
        """Note changes of the lists; see `farside.dem.policy.repair.RepairedValues.update`."""
        for arc, before, _, _ in changes:
            self._touch(before)
            self._touch(self._arcs.context[arc])
        for sign in signs:
            self._touch(sign)
            for whole in self._implied.wholes(sign):
                self._touch(whole)

    def moved(self, signs: Iterable[int]) -> None:
        """Note that the values of some Signs changed."""
        context = self._arcs.context
        for sign in signs:
            self._touch(sign)
            for arc in self._arcs.of_outcome(sign):
                self._touch(context[arc])

    def planned(self, start: int) -> float:
        """The cost of the actions on the best path from a Sign, whose value is final."""
        for sign in self._touched:
            self._look_again(sign)
        self._touched.clear()
        walked, sign = [], start
        while sign not in self._steps and (arc := self._ways.best(sign)) is not None:
            walked.append((sign, arc))
            sign = self._arcs.outcome[arc]
        planned, keep = self._steps[sign].planned if sign in self._steps else 0.0, True
        for sign, arc in reversed(walked):
            planned = self._actions.costs[self._arcs.action[arc]] + planned
            # Among equal values, the way depends on more than on what is next.
            keep = keep and self._ways.descends(sign, arc)
            if keep:
                self._keep(sign, _Step(self._arcs.born[arc], self._arcs.outcome[arc], planned))
        return planned

    def _touch(self, sign: int) -> None:
        if sign in self._steps:
            self._touched[sign] = None
        if sign in self._wholes:
            self._touched.update(self._wholes[sign])

    def _look_again(self, sign: int) -> None:
        step = self._steps.get(sign)
        if step is None:
            return
        arc = self._ways.best(sign) if self._ways.is_final(sign) else None
        if arc is None or self._arcs.born[arc] != step.born or not self._ways.descends(sign, arc):
            self._forget(sign)
        else:
            self._be_told(sign)

    def _keep(self, sign: int, step: _Step) -> None:
        self._steps[sign] = step
        self._before.setdefault(step.outcome, {})[sign] = None
        self._be_told(sign)

    def _be_told(self, sign: int) -> None:
        for part in self._implied.parts(sign):
            self._wholes.setdefault(part, {})[sign] = None

    def _forget(self, sign: int) -> None:
        """Forget a Sign, and all whose paths lead through it."""
        gone = [sign]
        for one in gone:
            step = self._steps.pop(one, None)
            if step is not None:
                gone += self._before.pop(one, ())
                self._before.get(step.outcome, {}).pop(one, None)
                for part in self._implied.parts(one):
                    self._wholes.get(part, {}).pop(one, None)
