"""Spreading activation: least total costs to a goal, computed in full or from a frontier.

In floating point too, `a + b` never decreases when `a` or `b` increases. So the least total costs
do not depend on the order in which Signs are visited: the priority queue here, scipy, and the
repair in `policy_map` agree to the last bit.
"""

import math
from collections.abc import Callable, Container, Sequence
from heapq import heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.signs import SignList
from farside.dem.parameters import Parameters

FEW_ARCS = 50_000
"""The number of arcs from which scipy is used (project default): importing scipy takes 0.7 s,
once, and the priority queue 25 ms for so many arcs."""


class Implications:
    """The arcs from whole to part, at no cost; none without `Parameters.whole_implies_parts`.

    Args:
        signs: the Sign List.
        parameters: those of the model.

    Attributes:
        parts: the Signs that a Sign implies.
        wholes: the Signs that imply a Sign.
    """

    def __init__(self, signs: SignList, parameters: Parameters) -> None:
        self._signs = signs
        self._hold = parameters.whole_implies_parts
        self.parts: Callable[[int], Sequence[int]] = signs.parts if self._hold else _none
        self.wholes: Callable[[int], Sequence[int]] = signs.wholes if self._hold else _none

    def pairs(self) -> NDArray[np.int64]:
        """All pairs of a Sign and a Sign that it implies, one in each row."""
        pairs = [
            (whole, part)
            for whole, tokens in enumerate(self._signs.names if self._hold else ())
            if len(tokens) > 1
            for part in self.parts(whole)
        ]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _none(_: int) -> Sequence[int]:
    return ()


def relax(
    value: list[float],
    frontier: list[tuple[float, int]],
    hypotheses: HypothesisList,
    implied: Implications,
    *,
    limit: float = math.inf,
    until: Container[int] = (),
) -> bool:
    """Relax arcs from `frontier` on until no value can be lowered any more.

    The seed spreads activation breadth-first, and again from each Sign that a cheaper path
    reaches. Cheapest first (Dijkstra) gives the same values with hardly any repetition.

    Args:
        value: total cost from each Sign to the goal, changed in place.
        frontier: heap of (value, Sign) with the values that were lowered; emptied.
        hypotheses: arcs from context to outcome, at their cost estimates.
        implied: arcs from whole to part, at no cost.
        limit: greatest number of Signs to spread from.
        until: stop at the nearest of these Signs, when it and all Signs at the same value are
            final. Values of Signs farther from the goal may then be too high.

    Returns:
        False if `limit` was exceeded, in which case `value` is only partly relaxed.
    """
    context, cost, wholes = hypotheses.context, hypotheses.cost, implied.wholes
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
        # Not `of_outcome`: a generator would take half as long again.
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
    """Policy values of all Signs for any goal. Caches what does not depend on goal and costs.

    Args:
        hypotheses, signs: the lists.
        parameters: those of the model.

    Attributes:
        hypotheses, signs: the lists.
        implied: the arcs beside the hypotheses.
    """

    def __init__(self, hypotheses: HypothesisList, signs: SignList, parameters: Parameters) -> None:
        self.hypotheses = hypotheses
        self.signs = signs
        self.implied = Implications(signs, parameters)
        self._graph: _Graph | None = None

    @property
    def repairable(self) -> int:
        """The number of changed values from which a new map is about as fast as a repair.

        Project default, as measured: for each Sign, a repair takes 4 times as long as a new map
        with the priority queue, and 32 times as long as with scipy.
        """
        return len(self.signs.names) // (4 if self._is_small else 32)

    @property
    def _is_small(self) -> bool:
        return len(self.hypotheses) < FEW_ARCS

    def values(self, goal: int) -> list[float]:
        """P_v by Sign id, infinite if no path leads to `goal`. Source: seed, equations 4 and 5.

        Dijkstra's algorithm, in Python for few arcs and with scipy for many; the values are equal.
        """
        if self._is_small:
            value = [math.inf] * len(self.signs.names)
            value[goal] = 0.0
            relax(value, [(0.0, goal)], self.hypotheses, self.implied)
            return value
        structure = (self.hypotheses.structure, self.signs.structure)
        if self._graph is None or self._graph.structure != structure:
            self._graph = _Graph(self)
        return self._graph.values(goal, self.hypotheses)


class _Graph:
    """The arcs as a sparse matrix for scipy, from outcome to context; only the costs vary.

    scipy is imported here because few runs need it.
    """

    def __init__(self, spread: Spread) -> None:
        from scipy.sparse import csr_array  # type: ignore[import-untyped] # noqa: PLC0415
        from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped] # noqa: PLC0415

        hypotheses, signs = spread.hypotheses, spread.signs
        self.structure = (hypotheses.structure, signs.structure)
        self._dijkstra = dijkstra
        sign_count = len(signs.names)
        implied = spread.implied.pairs()
        self._free = np.zeros(len(implied))
        context = np.concatenate((np.asarray(hypotheses.context), implied[:, 0]))
        outcome = np.concatenate((np.asarray(hypotheses.outcome), implied[:, 1]))
        # Loops are left out. Parallel arcs share one entry of the matrix, with the least of their
        # costs: scipy by itself would add them up.
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
