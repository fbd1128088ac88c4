"""The Dynamic Policy Map (DPM): the policy value of every Sign towards one goal."""

import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.plan import Plan
from farside.dem.policy.repair import FEW, RepairedValues


class Reason(NamedTuple):
    """Why the best action at a Sign is the best.

    Attributes:
        arc: the hypothesis behind it.
        total: its total cost estimate C_e + P_v(outcome), which is P_v of the Sign.
        rival: the best hypothesis with another action, `None` if none leads to the goal.
        rival_total: its total cost estimate, infinite if there is none.
    """

    arc: int
    total: float
    rival: int | None
    rival_total: float


class PolicyTable(NamedTuple):
    """The Signs that can reach the goal, as columns in order of value, then age.

    Attributes:
        sign: ids.
        value: policy values P_v.
        best: hypotheses to act on, -1 at the goal.
        depth: valence depths, in actions.
    """

    sign: NDArray[np.int64]
    value: NDArray[np.float64]
    best: NDArray[np.int64]
    depth: NDArray[np.int64]


class PolicyMap(RepairedValues):
    """Policy values of all Signs towards one goal, and what follows from them.

    P_v(goal) = 0 and P_v(s) = min over hypotheses (s ∧ a → s′) of C_e + P_v(s′). Source: seed,
    equations 4 and 5. To reach a whole is to reach its parts, so P_v(whole) ≤ P_v(part) for each
    part (project default; `Parameters.whole_implies_parts`).

    Only the values are stored; actions, depths and paths are derived from them on demand. So a
    model that was loaded, or built from telemetry, acts as the original would. Ties go to the
    hypothesis with the higher C_m, then to the older one (project default).
    """

    _plan: Plan

    def update(self, changes: Collection[CostChange], signs: Collection[int] = ()) -> None:
        """Note changes of the lists; see `RepairedValues.update`."""
        super().update(changes, signs)
        if self._moved is not None:
            self._plan.note(changes, signs)
            if len(self._moved) > FEW:
                self._moved = None  # nobody has asked for long

    def planned(self, active: Sequence[int], actions: ActionList) -> float:
        """The cost of the actions on the best path, if each succeeds at once.

        Infinite where no path is known. It takes a walk along the path when it is first asked for,
        and hardly any time after that.
        """
        start = self.entry(active)
        if start is None:
            return self.nearest(active)
        if self._moved is None:
            self._moved, self._plan = [], Plan(self, self._spread, actions)
        self._plan.moved(self._moved)
        self._moved.clear()
        return self._plan.planned(start)

    def best(self, sign: int) -> int | None:
        """The hypothesis to act on at a Sign; its context is the Sign or a part of it.

        `None` if no path leads to the goal, or if the Sign is the goal or implies it.
        """
        value = self.nearest((sign,))
        # Several ask for the same in a cycle.
        if self._recent is None or self._recent[0] != sign:
            self._recent = sign, self._best(sign) if 0.0 < value < math.inf else None
        return self._recent[1]

    def bests(self, start: int) -> list[int]:
        """By Sign, the hypotheses to act on where the value is at most that of `start`; else -1."""
        least = self.nearest((start,))
        value = np.array(self._values)
        value[value > least] = math.inf
        best: list[int] = self._all_best(value).tolist()
        return best

    def _best(self, sign: int) -> int:
        arcs = self._best_arcs(sign)
        nearer = self._first_nearer(arcs)
        return self._through_equals(arcs) if nearer is None else nearer

    def _arcs_from(self, sign: int) -> list[int]:
        """The hypotheses that can be acted on at a Sign: its own and those of its parts."""
        found = list(self._hypotheses.from_context(sign))
        for part in self._implied.parts(sign):
            found += self._hypotheses.from_context(part)
        return found

    def _best_arcs(self, sign: int) -> list[int]:
        """The hypotheses with the least total at a Sign, in order of rank."""
        values, held = self._values, self._values[sign]
        cost, outcome = self._hypotheses.cost, self._hypotheses.outcome
        found = [arc for arc in self._arcs_from(sign) if cost[arc] + values[outcome[arc]] == held]
        if len(found) > 1:
            found.sort(key=self._rank)
        return found

    def _first_nearer(self, arcs: Sequence[int]) -> int | None:
        """The first arc that leads to a strictly lesser value, as arcs normally do."""
        value, context, outcome = self._values, self._hypotheses.context, self._hypotheses.outcome
        return next((arc for arc in arcs if value[outcome[arc]] < value[context[arc]]), None)

    def descends(self, sign: int, arc: int) -> bool:
        """Whether a hypothesis leads from a Sign to one of strictly lesser value."""
        return self._values[self._hypotheses.outcome[arc]] < self._values[sign]

    def _through_equals(self, arcs: Sequence[int]) -> int:
        """The first step to the nearest Sign from which an arc leads to a lesser value.

        A cost that vanishes beside a value makes both ends of an arc equal in value. An arbitrary
        walk among such Signs could loop.
        """
        outcome = self._hypotheses.outcome
        first_step: dict[int, int] = {}
        for arc in arcs:
            first_step.setdefault(outcome[arc], arc)
        # Breadth first: the queue grows while the loop runs over it.
        queue = list(first_step)
        for sign in queue:
            onward = self._best_arcs(sign)
            if self._first_nearer(onward) is not None:
                return first_step[sign]
            for arc in onward:
                if outcome[arc] not in first_step:
                    first_step[outcome[arc]] = first_step[sign]
                    queue.append(outcome[arc])
        raise AssertionError("a finite value without a path to the goal")

    def _total(self, arc: int) -> float:
        return self._hypotheses.cost[arc] + self._values[self._hypotheses.outcome[arc]]

    def _rank(self, arc: int) -> tuple[float, int]:
        return -self._hypotheses.cm[arc], self._hypotheses.born[arc]

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from: least P_v, then higher C_m, then older hypothesis.

        `None` if no active Sign is on the map, or if the goal itself is active.
        """
        least = self.nearest(active)
        if least == 0.0 or least == math.inf:  # noqa: PLR1714 - no set in every cycle
            return None
        tied = [sign for sign in active if self._values[sign] == least]
        if len(tied) == 1:
            return tied[0]
        return min(tied, key=lambda sign: self._rank(self._best(sign)))

    def walk(self, start: int) -> Iterator[int]:
        """The hypotheses along the best path from the Sign `start` to the goal."""
        arc = self.best(start)
        while arc is not None:
            yield arc
            arc = self.best(self._hypotheses.outcome[arc])

    def depth(self, sign: int) -> int | None:
        """Valence depth, the number of actions to the goal; `None` if no path leads there."""
        if self.nearest((sign,)) == math.inf:
            return None
        return sum(1 for _ in self.walk(sign))

    def why(self, sign: int) -> Reason | None:
        """The reason for the best action at a Sign, `None` if there is no action."""
        arc = self.best(sign)
        if arc is None:
            return None
        action = self._hypotheses.action[arc]
        others = [
            other for other in self._arcs_from(sign) if self._hypotheses.action[other] != action
        ]
        outcomes = frozenset(self._hypotheses.outcome[other] for other in others)
        self._settle(lambda: min(map(self._total, others), default=0.0), outcomes)
        ranks = ((self._total(other), self._rank(other), other) for other in others)
        rival_total, _, rival = min(ranks, default=(math.inf, None, None))
        return Reason(
            arc, self._values[sign], rival if rival_total < math.inf else None, rival_total
        )

    def table(self) -> PolicyTable:
        """All Signs that can reach the goal, with `value`, `best` and `depth` of each."""
        value = np.array(self.value)
        best = self._all_best(value)
        sign = np.flatnonzero(value < math.inf)
        sign = sign[np.argsort(value[sign], kind="stable")]
        return PolicyTable(sign, value[sign], best[sign], self._all_depths(best)[sign])

    def _all_best(self, value: NDArray[np.float64]) -> NDArray[np.int64]:
        arcs = self._hypotheses
        context, outcome = np.asarray(arcs.context), np.asarray(arcs.outcome)
        onward = value[outcome]
        held = value[context]
        on_best = (np.asarray(arcs.cost) + onward == held) & (onward < held) & (held < math.inf)
        arc = np.flatnonzero(on_best)
        best = self._best_of(context[arc], arc)
        # A whole acts on the best of its own arcs and those of parts with the same value.
        pairs = self._implied.pairs()
        whole, part = pairs[(value[pairs[:, 0]] == value[pairs[:, 1]]) & (best[pairs[:, 1]] >= 0)].T
        best = self._best_of(np.append(context[arc], whole), np.append(arc, best[part]))
        for sign in np.flatnonzero((best < 0) & (value > 0.0) & (value < math.inf)).tolist():
            best[sign] = self._best(sign)
        return best

    def _best_of(self, sign: NDArray[np.int64], arc: NDArray[np.int64]) -> NDArray[np.int64]:
        """The first by rank of the arcs at each Sign, by Sign id; -1 if there is none.

        Args:
            sign: the Sign of each arc.
            arc: the arcs.
        """
        cm, born = np.asarray(self._hypotheses.cm)[arc], np.asarray(self._hypotheses.born)[arc]
        best = np.full(len(self._values), -1, dtype=np.int64)
        last_first = np.lexsort((born, -cm))[::-1]
        best[sign[last_first]] = arc[last_first]
        return best

    def _all_depths(self, best: NDArray[np.int64]) -> NDArray[np.int64]:
        """Number of steps along `best` from each Sign, by pointer doubling."""
        on_path = best >= 0
        ahead = np.arange(len(best))
        ahead[on_path] = np.asarray(self._hypotheses.outcome)[best[on_path]]
        depth = on_path.astype(np.int64)
        while depth[ahead].any():
            depth += depth[ahead]
            ahead = ahead[ahead]
        return depth
