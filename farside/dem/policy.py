"""The Dynamic Policy Map (DPM): what every Sign is worth on the way to one goal."""

import math
from collections.abc import Iterator, Sequence
from heapq import heappop, heappush

import msgspec

from farside.dem.lists import HypothesisList, Sign


class PolicyValue(msgspec.Struct, frozen=True):
    """What the DPM knows of a Sign.

    Attributes:
        sign: the Sign.
        value: policy value P_v, least total cost estimate from here to the goal.
        action: best Action here, `None` for the goal itself.
        depth: valence depth, steps from here to the goal on the best path.
    """

    sign: Sign
    value: float
    action: str | None
    depth: int


class PathStep(msgspec.Struct, frozen=True):
    """One step of the policy path.

    Attributes:
        sign: where the step begins.
        action: what to do there.
        cost_to_go: policy value P_v at `sign`.
        probability: C_m of the hypothesis behind the step.
    """

    sign: Sign
    action: str
    cost_to_go: float
    probability: float


class DynamicPolicyMap:
    """Policy values of all Signs towards one goal, as the hypotheses stand now.

    P_v(goal) = 0 and P_v(s) = min over hypotheses (s ∧ a → s′) of C_e + P_v(s′). Source: seed,
    equations 4 and 5. Equal values fall to the hypothesis with the higher C_m, then to the older
    one (project default).

    The seed spreads activation breadth-first and re-activates what a cheaper path reaches. Taking
    the cheapest frontier Sign first (Dijkstra) gives the same values and never re-activates,
    since no action is free.

    Attributes:
        goal: id of the goal's Sign.
        value: P_v by Sign id, infinite where no path leads to the goal.
        best: the hypothesis to act on by Sign id, -1 for the goal and where there is none.
        depth: valence depth by Sign id, -1 where no path leads to the goal.
    """

    def __init__(self, goal: int, sign_count: int, hypotheses: HypothesisList) -> None:
        self.goal = goal
        self.value = [math.inf] * sign_count
        self.best = [-1] * sign_count
        self.depth = [-1] * sign_count
        self._hypotheses = hypotheses
        self._spread()

    def _spread(self) -> None:
        value, best, depth = self.value, self.best, self.depth
        context, outcome = self._hypotheses.context, self._hypotheses.outcome
        cost, of_outcome = self._hypotheses.cost, self._hypotheses.of_outcome
        value[self.goal] = 0.0
        frontier = [(0.0, self.goal)]
        while frontier:
            reached, sign = heappop(frontier)
            if depth[sign] >= 0:
                continue
            depth[sign] = depth[outcome[best[sign]]] + 1 if best[sign] >= 0 else 0
            for arc in of_outcome(sign):
                before = context[arc]
                # Done already, so no cheaper. Nor may it take a tie: a cost so small that it
                # vanishes when added would close a path into a loop.
                if depth[before] >= 0:
                    continue
                # P_v(s) = C_e + P_v(s′)
                candidate = reached + cost[arc]
                if candidate < value[before]:
                    value[before] = candidate
                    best[before] = arc
                    heappush(frontier, (candidate, before))
                elif candidate == value[before] and self._breaks_tie(arc, best[before]):
                    best[before] = arc

    def _breaks_tie(self, arc: int, rival: int) -> bool:
        cm = self._hypotheses.cm
        return rival >= 0 and (-cm[arc], arc) < (-cm[rival], rival)

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from: least P_v, then higher C_m, then older hypothesis.

        `None` where nothing is to be done for the goal: no active Sign is on the map, or the
        goal itself is active.
        """
        if self.goal in active:
            return None
        on_map = (sign for sign in active if self.best[sign] >= 0)
        return min(on_map, key=self._rank, default=None)

    def _rank(self, sign: int) -> tuple[float, float, int]:
        arc = self.best[sign]
        return self.value[sign], -self._hypotheses.cm[arc], arc

    def walk(self, start: int) -> Iterator[int]:
        """The hypotheses along the best path from the Sign `start` to the goal."""
        sign = start
        while (arc := self.best[sign]) >= 0:
            yield arc
            sign = self._hypotheses.outcome[arc]
