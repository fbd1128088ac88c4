"""Policy values that follow the lists: repaired after changes, only as far as they are asked for.

Whoever goes to a goal leaves the changes behind: what was just learned changes the values of all
Signs whose best path leads through here, and of none on the way ahead. So changes are noted as they
come, and worked off in order of value until the values asked for are final.
"""

import math
from collections.abc import Callable, Collection, Container, Sequence
from heapq import heapify, heappop, heappush

from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.spread import Spread

_DOUBT, _OFFER, _SPREAD = range(3)  # at equal values in this order, so that less is done in vain

FEW = 1000
"""So many changes are kept in any case (project default)."""


class RepairedValues:
    """Policy values of all Signs towards one goal.

    They are the same to the last bit however they came about. After any change to the lists, call
    `update` before any other method.

    Args:
        goal: id of the goal's Sign.
        spread: the lists.

    Attributes:
        goal: id of the goal's Sign.
    """

    def __init__(self, goal: int, spread: Spread) -> None:
        self.goal = goal
        self._spread = spread
        self._hypotheses = spread.hypotheses
        self._signs = spread.signs
        self._implied = spread.implied
        self._build()

    def _build(self) -> None:
        # Where an entry (v, …, s) is pending, the values from v on are not final.
        #   _DOUBT: s has the value v, but may have lost what it rests on.
        #   _OFFER: s lost its value; v is the least that it may have now.
        #   _SPREAD: s has the value v, which is lower than before; who leads to it does not know.
        self._pending: list[tuple[float, int, int]] = []
        self._values = self._spread.values(self.goal)
        self._compact_at = FEW
        # The Signs whose values have changed, where somebody wants to know; not known here.
        self._moved: list[int] | None = None
        # The Sign that was asked for last, and what to act on there.
        self._recent: tuple[int, int | None] | None = None

    def part(self) -> None:
        """Go on apart from the map that this one was copied from."""
        self._values, self._pending = list(self._values), list(self._pending)
        self._moved = None

    @property
    def value(self) -> list[float]:
        """P_v by Sign id, infinite if no path leads to the goal."""
        self._settle(lambda: math.inf)
        return self._values

    def is_final(self, sign: int) -> bool:
        """Whether the value of a Sign would be the same if it was asked for."""
        return not self._pending or self._pending[0][0] > self._values[sign]

    def nearest(self, signs: Sequence[int]) -> float:
        """The least P_v of some Signs, infinite if no path leads from them to the goal.

        All lesser values are final too.
        """
        values, least = self._values, math.inf
        for sign in signs:
            if values[sign] < least:  # noqa: PLR1730 - half the time of `min`
                least = values[sign]
        pending = self._pending
        if not pending or pending[0][0] > least:
            return least

        def bound() -> float:
            return min([self._values[sign] for sign in signs], default=math.inf)

        self._settle(bound, frozenset(signs))
        return bound()

    def update(self, changes: Collection[CostChange], signs: Collection[int] = ()) -> None:
        """Note changes of the lists.

        Args:
            changes: hypotheses created, removed or changed in cost, in any order.
            signs: Signs added or removed, and those that implied a removed one.
        """
        self._recent = None
        values, pending, names = self._values, self._pending, self._signs.names
        if len(values) < len(names):
            values.extend([math.inf] * (len(names) - len(values)))
        arcs = self._hypotheses
        context, outcome, cost = arcs.context, arcs.outcome, arcs.cost
        doubted: set[int] = set()  # a hub may be the context of very many
        for arc, before, after, old_cost in changes:
            # The id may have been reused for another hypothesis.
            here = context[arc]
            total = cost[arc] + values[outcome[arc]]
            if total < values[here]:
                values[here] = total
                heappush(pending, (total, _SPREAD, here))
            if old_cost + values[after] <= values[before] < math.inf:
                stands = cost[arc] <= old_cost and here == before and outcome[arc] == after
                if not stands and before not in doubted:
                    doubted.add(before)
                    heappush(pending, (values[before], _DOUBT, before))
        for sign in signs:
            if not names[sign]:
                values[sign] = math.inf
                continue
            if values[sign] < math.inf:
                heappush(pending, (values[sign], _DOUBT, sign))
            self._await(self._offer(sign), sign)
        if len(pending) > self._compact_at:
            self._compact()

    def _compact(self) -> None:
        """Drop what is pending twice, or for values that are others by now."""
        values = self._values
        self._pending = [
            (value, what, sign)
            for value, what, sign in dict.fromkeys(self._pending)
            if (values[sign] > value if what == _OFFER else values[sign] == value)
        ]
        heapify(self._pending)
        self._compact_at = 2 * len(self._pending) + FEW

    def _settle(self, bound: Callable[[], float], watched: Container[int] = ()) -> None:
        """Work off what is pending up to a value, cheapest first (after Ramalingam and Reps).

        Takes time in proportion to the number of values up to there that change, and at most about
        twice as long as a new map, which is built where that is faster.

        Args:
            bound: the value, which may depend on those of `watched`.
            watched: Signs.
        """
        self._recent = None
        pending, limit = self._pending, self._spread.repairable
        within = bound()
        while pending and pending[0][0] <= within:
            value, what, sign = entry = heappop(pending)
            if what == _DOUBT:
                while pending and pending[0] == entry:
                    heappop(pending)
                is_new = self._is_raised(sign, value)
            elif what == _OFFER:
                is_new = self._is_offered(sign, value)
            else:
                is_new = self._values[sign] == value
            if not is_new:
                continue
            if what != _DOUBT:
                self._relax_from(sign)
            if self._moved is not None:
                self._moved.append(sign)
            limit -= 1
            if limit < 0:
                self._build()
                return
            if sign in watched:
                within = bound()

    def _is_raised(self, sign: int, held: float) -> bool:
        """Raise the value that a Sign holds, or take it away, if it rests on nothing any more."""
        values, arcs = self._values, self._hypotheses
        if values[sign] != held or sign == self.goal:
            return False
        outcome, cost = arcs.outcome, arcs.cost
        least = through = math.inf
        for arc in arcs.from_context(sign):
            onward = values[outcome[arc]]
            total = cost[arc] + onward
            # Only a Sign strictly nearer to the goal supports another. Signs of equal value could
            # support each other, along implications or where a cost vanishes beside a value.
            if onward < held and total <= held:
                return False
            if total < least:
                least, through = total, onward
        for part in self._implied.parts(sign):
            if values[part] < least:
                least = through = values[part]
        self._doubt_before(sign)
        if through < held:  # and so it is final
            values[sign] = least
            heappush(self._pending, (least, _SPREAD, sign))
        else:
            values[sign] = math.inf
            self._await(least, sign)
        return True

    def _is_offered(self, sign: int, offer: float) -> bool:
        """Give a Sign that lost its value the least that it can have, if it is still that."""
        if self._values[sign] <= offer:
            return False
        # Of what it was offered, some may have been lost since.
        least = self._offer(sign)
        if least > offer:
            self._await(least, sign)
            return False
        self._values[sign] = least
        return True

    def _relax_from(self, sign: int) -> None:
        values, pending, reached = self._values, self._pending, self._values[sign]
        arcs = self._hypotheses
        context, cost, following = arcs.context, arcs.cost, arcs.by_outcome.following
        arc = arcs.by_outcome.head(sign)
        while arc >= 0:
            # P_v(s) = min over (s ∧ a → s′) of C_e + P_v(s′)
            candidate, before = cost[arc] + reached, context[arc]
            if candidate < values[before]:
                values[before] = candidate
                heappush(pending, (candidate, _SPREAD, before))
            arc = following[arc]
        for whole in self._implied.wholes(sign):
            if reached < values[whole]:
                values[whole] = reached
                heappush(pending, (reached, _SPREAD, whole))

    def _doubt_before(self, sign: int) -> None:
        """Doubt the values that may rest on that of a Sign."""
        values, pending, held = self._values, self._pending, self._values[sign]
        arcs = self._hypotheses
        context, cost, following = arcs.context, arcs.cost, arcs.by_outcome.following
        arc = arcs.by_outcome.head(sign)
        while arc >= 0:
            before = context[arc]
            if cost[arc] + held <= values[before] < math.inf:
                heappush(pending, (values[before], _DOUBT, before))
            arc = following[arc]
        for whole in self._implied.wholes(sign):
            if held <= values[whole] < math.inf:
                heappush(pending, (values[whole], _DOUBT, whole))

    def _await(self, offer: float, sign: int) -> None:
        if offer < self._values[sign]:
            heappush(self._pending, (offer, _OFFER, sign))

    def _offer(self, sign: int) -> float:
        """The least that a Sign's value can be by the others as they are."""
        arcs, values = self._hypotheses, self._values
        outcome, cost = arcs.outcome, arcs.cost
        onward = [cost[arc] + values[outcome[arc]] for arc in arcs.from_context(sign)]
        implied = [values[part] for part in self._implied.parts(sign)]
        return min(onward + implied, default=math.inf)
