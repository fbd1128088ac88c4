"""The Dynamic Policy Map (DPM): what every Sign is worth on the way to one goal."""

import math
from collections.abc import Iterable, Iterator, Sequence
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.dem.lists.hypotheses import Change
from farside.dem.policy.spread import Spread, implications, relax


class Reason(NamedTuple):
    """Why the best action at a Sign is the best.

    Attributes:
        arc: the hypothesis behind it.
        total: its total cost estimate C_e + P_v(outcome), the policy value of the Sign.
        rival: the best hypothesis with another action, `None` where there is none of use.
        rival_total: its total cost estimate, infinite where there is none.
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
        best: hypotheses to act on, -1 where the goal is reached.
        depth: valence depths, in actions.
    """

    sign: NDArray[np.int64]
    value: NDArray[np.float64]
    best: NDArray[np.int64]
    depth: NDArray[np.int64]


class PolicyMap:
    """Policy values of all Signs towards one goal, repaired as hypotheses come, change and go.

    P_v(goal) = 0 and P_v(s) = min over hypotheses (s ∧ a → s′) of C_e + P_v(s′). Source: seed,
    equations 4 and 5. Whoever reaches a whole has reached its parts, so that P_v(whole) is P_v of
    the least of its parts at most (project default).

    Only the values are kept. They are the same to the last bit however the map came about, and
    actions, depths and paths are read from them when asked for. So a model that was loaded, or
    built from telemetry, acts as the one that learned. Equal totals fall to the hypothesis with
    the higher C_m, then to the older one (project default).

    After any change to the lists, call `update` before asking anything.

    Args:
        goal: id of the goal's Sign.
        spread: the lists.

    Attributes:
        goal: id of the goal's Sign.
        value: P_v by Sign id, infinite where no path leads to the goal.
    """

    def __init__(self, goal: int, spread: Spread) -> None:
        self.goal = goal
        self.value = spread.values(goal)
        self._spread = spread
        self._hypotheses = spread.hypotheses
        self._signs = spread.signs

    # --- keeping up ----------------------------------------------------------------------------

    def update(self, changes: Iterable[Change], signs: Iterable[int] = ()) -> None:
        """Bring the values up to date with what has changed since the last time.

        Takes time in proportion to the Signs whose values change by it, and no more than about
        twice as long as a new map.

        Args:
            changes: hypotheses made, removed or changed in cost, in any order.
            signs: Signs made or removed, and those that implied a removed one.
        """
        value, names = self.value, self._signs.names
        value.extend([math.inf] * (len(names) - len(value)))
        improved, doubtful = self._concerning(changes)
        for sign in signs:
            if names[sign]:
                doubtful.append(sign)
            else:
                value[sign] = math.inf
        if (improved or doubtful) and not self._repair(improved, doubtful):
            self.value = self._spread.values(self.goal)

    def _concerning(self, changes: Iterable[Change]) -> tuple[list[int], list[int]]:
        """Of all changes the hypotheses that improve a value, and the Signs that lost a best."""
        arcs, value = self._hypotheses, self.value
        context, outcome, cost = arcs.context, arcs.outcome, arcs.cost
        improved, doubtful = [], []
        for arc, before, after, old_cost in changes:
            # The row may be another hypothesis by now.
            if cost[arc] + value[outcome[arc]] < value[context[arc]]:
                improved.append(arc)
            stands = cost[arc] <= old_cost and (context[arc], outcome[arc]) == (before, after)
            if not stands and old_cost + value[after] <= value[before] < math.inf:
                doubtful.append(before)
        return improved, doubtful

    def _repair(self, improved: Iterable[int], doubtful: list[int]) -> bool:
        """Repair the values, unless that takes as long as a new map: whether it is done."""
        value, limit = self.value, self._spread.repairable
        lost = self._lose(doubtful, limit)
        if lost is None:
            return False
        offers = [(self._offer(sign), sign) for sign in (*lost, *doubtful)]
        offers += [(self._total(arc), self._hypotheses.context[arc]) for arc in improved]
        frontier = []
        for offer, sign in offers:
            if offer < value[sign]:
                value[sign] = offer
                frontier.append((offer, sign))
        heapify(frontier)
        limit += len(frontier)
        return relax(value, frontier, self._hypotheses, self._signs, limit=limit)

    def _lose(self, doubtful: Iterable[int], limit: int) -> list[int] | None:
        """Make infinite every value that may have grown; which, or `None` if above `limit`.

        Nearest to the goal first (after Ramalingam and Reps). What is left is supported: from Sign
        to Sign along unbroken arcs it still falls to 0 at the goal.
        """
        arcs, value = self._hypotheses, self.value
        context, cost = arcs.context, arcs.cost
        queue = [(value[sign], sign) for sign in doubtful if sign != self.goal]
        heapify(queue)
        lost: list[int] = []
        while queue:
            held, sign = heappop(queue)
            if value[sign] != held or held == math.inf or self._is_supported(sign):
                continue
            value[sign] = math.inf
            lost.append(sign)
            if len(lost) > limit:
                return None
            for arc in arcs.of_outcome(sign):
                before = context[arc]
                if cost[arc] + held <= value[before] < math.inf:
                    heappush(queue, (value[before], before))
            for whole in self._signs.wholes(sign):
                if held <= value[whole] < math.inf:
                    heappush(queue, (value[whole], whole))
        return lost

    def _is_supported(self, sign: int) -> bool:
        # Only what is truly nearer to the goal supports. Where a cost is too small to count
        # beside a value, and along implications, Signs of equal value could support each other.
        arcs, value = self._hypotheses, self.value
        outcome, cost, held = arcs.outcome, arcs.cost, value[sign]
        return any(
            value[outcome[arc]] < held and cost[arc] + value[outcome[arc]] <= held
            for arc in arcs.from_context(sign)
        )

    def _offer(self, sign: int) -> float:
        arcs, value = self._hypotheses, self.value
        onward = [arcs.cost[arc] + value[arcs.outcome[arc]] for arc in arcs.from_context(sign)]
        implied = [value[part] for part in self._signs.parts(sign)]
        return min(onward + implied, default=math.inf)

    # --- looking at it -------------------------------------------------------------------------

    def best(self, sign: int) -> int | None:
        """The hypothesis to act on at a Sign. Its context is the Sign or a part of it.

        `None` where no path leads to the goal, and where the Sign is the goal or implies it.
        """
        return self._best(sign) if 0.0 < self.value[sign] < math.inf else None

    def _best(self, sign: int) -> int:
        ways = self._best_arcs(sign)
        nearer = self._first_nearer(ways)
        return self._through_equals(ways) if nearer is None else nearer

    def _arcs_from(self, sign: int) -> list[int]:
        """The hypotheses that can be acted on at a Sign: its own and those of its parts."""
        found = list(self._hypotheses.from_context(sign))
        for part in self._signs.parts(sign):
            found += self._hypotheses.from_context(part)
        return found

    def _best_arcs(self, sign: int) -> list[int]:
        """The hypotheses with the least total at a Sign, surest and oldest first."""
        held = self.value[sign]
        return sorted(
            (arc for arc in self._arcs_from(sign) if self._total(arc) == held), key=self._rank
        )

    def _first_nearer(self, ways: Sequence[int]) -> int | None:
        """The first that leads to a lesser value than it starts from, as every arc should."""
        value, context, outcome = self.value, self._hypotheses.context, self._hypotheses.outcome
        return next((arc for arc in ways if value[outcome[arc]] < value[context[arc]]), None)

    def _through_equals(self, ways: Sequence[int]) -> int:
        """The first step to the nearest Sign from which an arc leads nearer to the goal.

        A cost too small to count beside a value leaves the value as it is. Walking between such
        equals as one likes could lead round in circles.
        """
        outcome = self._hypotheses.outcome
        first_step: dict[int, int] = {}
        for arc in ways:
            first_step.setdefault(outcome[arc], arc)
        # The dictionary grows at its end while the loop goes over it: it is the queue as well.
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
        return self._hypotheses.cost[arc] + self.value[self._hypotheses.outcome[arc]]

    def _rank(self, arc: int) -> tuple[float, int]:
        return -self._hypotheses.cm[arc], self._hypotheses.born[arc]

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from: least P_v, then higher C_m, then older hypothesis.

        `None` where nothing is to be done for the goal: no active Sign is on the map, or the goal
        itself is active.
        """
        least = min((self.value[sign] for sign in active), default=math.inf)
        if least in {0.0, math.inf}:
            return None
        tied = [sign for sign in active if self.value[sign] == least]
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
        """Valence depth, actions from here to the goal; `None` where no path leads to it."""
        if self.value[sign] == math.inf:
            return None
        return sum(1 for _ in self.walk(sign))

    def why(self, sign: int) -> Reason | None:
        """What speaks for the best action at a Sign, `None` where there is none."""
        arc = self.best(sign)
        if arc is None:
            return None
        action = self._hypotheses.action[arc]
        others = [
            (self._total(way), self._rank(way), way)
            for way in self._arcs_from(sign)
            if self._hypotheses.action[way] != action and self._total(way) < math.inf
        ]
        rival_total, _, rival = min(others, default=(math.inf, None, None))
        return Reason(arc, self.value[sign], rival, rival_total)

    def table(self) -> PolicyTable:
        """All Signs that can reach the goal at once: `value`, `best` and `depth` of each."""
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
        way = np.flatnonzero(on_best)
        best = self._best_of(context[way], way)
        # A whole acts from the surest of its own arcs and of those of its equal parts.
        pairs = implications(self._signs)
        whole, part = pairs[(value[pairs[:, 0]] == value[pairs[:, 1]]) & (best[pairs[:, 1]] >= 0)].T
        best = self._best_of(np.append(context[way], whole), np.append(way, best[part]))
        for sign in np.flatnonzero((best < 0) & (value > 0.0) & (value < math.inf)).tolist():
            best[sign] = self._best(sign)
        return best

    def _best_of(self, sign: NDArray[np.int64], way: NDArray[np.int64]) -> NDArray[np.int64]:
        """The first by rank of the ways at each Sign, -1 where there is none."""
        cm, born = np.asarray(self._hypotheses.cm)[way], np.asarray(self._hypotheses.born)[way]
        best = np.full(len(self.value), -1, dtype=np.int64)
        last_first = np.lexsort((born, -cm))[::-1]
        best[sign[last_first]] = way[last_first]
        return best

    def _all_depths(self, best: NDArray[np.int64]) -> NDArray[np.int64]:
        """Steps along `best` from each Sign: each round doubles how far the Signs have looked."""
        on_way = best >= 0
        ahead = np.arange(len(best))
        ahead[on_way] = np.asarray(self._hypotheses.outcome)[best[on_way]]
        depth = on_way.astype(np.int64)
        while depth[ahead].any():
            depth += depth[ahead]
            ahead = ahead[ahead]
        return depth
