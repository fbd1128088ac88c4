"""Spreading activation: least total costs to a goal over the hypotheses, whole or from a frontier.

Costs are added in floating point, where `a + b` never falls when `a` or `b` rises. So least total
costs do not depend on the order in which Signs are visited: the heap here, scipy and the repair
in `policy` agree to the last bit.
"""

import math
from collections.abc import Container
from heapq import heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.signs import SignList

FEW_ARCS = 50_000
"""Below this the heap is used (project default): importing scipy takes 0.7 s, once, and the heap
needs 25 ms for so many arcs."""


def implications(signs: SignList) -> NDArray[np.int64]:
    """Every pair of a Sign and a Sign that it implies, a row each."""
    pairs = [
        (whole, part)
        for whole, tokens in enumerate(signs.names)
        if len(tokens) > 1
        for part in signs.parts(whole)
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def relax(
    value: list[float],
    frontier: list[tuple[float, int]],
    hypotheses: HypothesisList,
    signs: SignList,
    *,
    limit: float = math.inf,
    until: Container[int] = (),
) -> bool:
    """Lower `value` until nothing is gained any more, beginning at `frontier`.

    The seed spreads activation breadth-first and re-activates what a cheaper path reaches. Taking
    the cheapest Sign first (Dijkstra) gives the same values and hardly ever re-activates.

    Args:
        value: total cost from each Sign, changed in place.
        frontier: heap of (value, Sign) whose values were lowered; used up.
        hypotheses: arcs from context to outcome, at their cost estimates.
        signs: arcs from whole to part, at no cost.
        limit: number of Signs to spread from.
        until: the nearest of these Signs ends it, once all as near as it have their values. What
            is farther may be left too high, but above the value of that Sign.

    Returns:
        False if `limit` was reached, with `value` halfway.
    """
    context, cost, wholes = hypotheses.context, hypotheses.cost, signs.wholes
    first, following = hypotheses.by_outcome.first, hypotheses.by_outcome.following
    spread_from, farthest = 0, math.inf
    while frontier:
        reached, sign = heappop(frontier)
        if reached > farthest:
            break
        if reached > value[sign]:
            continue
        if sign in until:
            farthest = reached
        spread_from += 1
        if spread_from > limit:
            return False
        # Walked in place: a generator would take half as long again.
        arc = first[sign] if sign < len(first) else -1
        while arc >= 0:
            # P_v(s) = min over (s ∧ a → s′) of C_e + P_v(s′)
            candidate = cost[arc] + reached
            before = context[arc]
            if candidate < value[before]:
                value[before] = candidate
                heappush(frontier, (candidate, before))
            arc = following[arc]
        for whole in wholes(sign):
            if reached < value[whole]:
                value[whole] = reached
                heappush(frontier, (reached, whole))
    return True


class Spread:
    """Policy values of all Signs for any goal. Keeps what is the same for every goal and cost.

    Attributes:
        hypotheses, signs: the lists to spread over.
    """

    def __init__(self, hypotheses: HypothesisList, signs: SignList) -> None:
        self.hypotheses = hypotheses
        self.signs = signs
        self._graph: _Graph | None = None

    @property
    def repairable(self) -> int:
        """How many values may change before new ones are as quick as a repair, about.

        Project default, as measured: a repair takes 4 times as long for each Sign as the heap,
        and 32 times as long as scipy.
        """
        return len(self.signs.names) // (4 if self._is_small else 32)

    @property
    def _is_small(self) -> bool:
        return len(self.hypotheses) < FEW_ARCS

    def values(self, goal: int) -> list[float]:
        """P_v by Sign id, infinite where no path leads to `goal`. Source: seed, equations 4 and 5.

        Dijkstra's algorithm, in Python on few arcs and by scipy on many. Both find the same.
        """
        if self._is_small:
            value = [math.inf] * len(self.signs.names)
            value[goal] = 0.0
            relax(value, [(0.0, goal)], self.hypotheses, self.signs)
            return value
        structure = (self.hypotheses.structure, self.signs.structure)
        if self._graph is None or self._graph.structure != structure:
            self._graph = _Graph(self.hypotheses, self.signs)
        return self._graph.values(goal, self.hypotheses)


class _Graph:
    """The arcs as scipy takes them, from outcome to context; only their costs are taken anew.

    scipy is imported here, for few runs need it.
    """

    def __init__(self, hypotheses: HypothesisList, signs: SignList) -> None:
        from scipy.sparse import csr_array  # type: ignore[import-untyped] # noqa: PLC0415
        from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped] # noqa: PLC0415

        self.structure = (hypotheses.structure, signs.structure)
        self._dijkstra = dijkstra
        sign_count = len(signs.names)
        implied = implications(signs)
        self._free = np.zeros(len(implied))
        context = np.concatenate((np.asarray(hypotheses.context), implied[:, 0]))
        outcome = np.concatenate((np.asarray(hypotheses.outcome), implied[:, 1]))
        # Arcs that lead nowhere are left out, and parallel ones take one place: the least of
        # their costs counts, where scipy by itself would sum them.
        ends = outcome * np.int64(sign_count) + context
        order = np.argsort(ends)
        self._order = order[context[order] != outcome[order]]
        ends = ends[self._order]
        self._first = np.flatnonzero(np.diff(ends, prepend=-1))
        row, column = np.divmod(ends[self._first], sign_count)
        starts = np.concatenate(([0], np.cumsum(np.bincount(row, minlength=sign_count))))
        self._matrix: Any = csr_array(
            (np.empty(len(column)), column.astype(np.int32), starts.astype(np.int32)),
            shape=(sign_count, sign_count),
        )

    def values(self, goal: int, hypotheses: HypothesisList) -> list[float]:
        cost = np.concatenate((np.asarray(hypotheses.cost), self._free))[self._order]
        if len(cost):
            self._matrix.data = np.minimum.reduceat(cost, self._first)
        value: NDArray[np.float64] = self._dijkstra(self._matrix, indices=goal)
        listed: list[float] = value.tolist()
        return listed
