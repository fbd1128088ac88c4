"""The Aversion List: the Signs that are to be avoided, by whom, at what cost, and what risks them.

Whoever performs an action pays its cost, and what it brings about that is to be avoided, each as
often as it follows. So the attempt itself becomes dearer, by

    risk(s, a) = Σ over the Signs X to be avoided of cost(X) · w(X)

where w(X) is the measure of the outcome X, or the sum of those of its wholes, 1 at most, if that is
more: a situation that X is part of may be known as an outcome where X alone is not.

So does every hypothesis of the same context and action, whatever its own outcome is: a place that
is often entered tilted is dear, though only the Token of the tilt is to be avoided.
"""

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol

import msgspec

from farside.dem.lists import given
from farside.dem.lists.signs import Sign, SignList, to_sign


class Aversion(msgspec.Struct, frozen=True):
    """A Sign to be avoided, by one source or more. Source: project default, not in the seed.

    Attributes:
        tokens: the Sign.
        costs: what it costs each source to have the Sign become active, in the unit of the action
            costs, finite and 0 or more; one at least. The source that said so first comes first.
    """

    tokens: Sign
    costs: Mapping[str, float]

    @property
    def cost(self) -> float:
        """The cost that counts: the highest that any source gives."""
        return max(self.costs.values())


class AversionList:
    """The Signs that are to be avoided, in the order in which they came.

    Args:
        signs: the Sign List, for the names of outcomes.

    Attributes:
        ordered: the aversions, the oldest first.
        signs: their Signs; false if there is none.
    """

    def __init__(self, signs: SignList) -> None:
        self._names = signs.names
        self._costs: dict[Sign, dict[str, float]] = {}
        self._order()

    def avert(self, sign: Sign, cost: float, source: str) -> None:
        """Avoid a Sign on behalf of `source`, or change the cost that the source gives it.

        Raises:
            TypeError: if the cost is no number.
            ValueError: if `sign` has no Tokens, or the cost is not finite and 0 or more.
        """
        cost = given.number(cost, "cost of an aversion to {}", sign)
        if not sign:
            raise ValueError("an aversion: expected one Token at least, found none")
        if not 0.0 <= cost < math.inf:
            raise ValueError(
                f"cost of an aversion to {given.shown(sign)}: expected 0 or more, found {cost}"
            )
        self._costs.setdefault(sign, {})[given.name("source of an aversion", source)] = cost
        self._order()

    def accept(self, sign: Sign, source: str) -> bool:
        """Take back what `source` said; False if it said nothing of this Sign."""
        costs = self._costs.get(sign, {})
        if given.name("source of an aversion", source) not in costs:
            return False
        del costs[source]
        if not costs:
            del self._costs[sign]
        self._order()
        return True

    def become(self, aversions: Iterable[Aversion]) -> None:
        """Avoid exactly these."""
        self._costs = {aversion.tokens: dict(aversion.costs) for aversion in aversions}
        self._order()

    def _order(self) -> None:
        self.ordered = tuple(Aversion(sign, dict(costs)) for sign, costs in self._costs.items())
        self.signs = {aversion.tokens: aversion.cost for aversion in self.ordered}
        self._tokens = {token for sign in self.signs for token in sign}

    def implied_by(self, outcome: int) -> list[Sign]:
        """The Signs to be avoided that are active where the Sign of this id is."""
        name = self._names[outcome]
        if self._tokens.isdisjoint(name):
            return []
        return [sign for sign in self.signs if set(sign).issubset(name)]

    def risk(self, outcomes: Iterable[tuple[int, float]]) -> float:
        """What an attempt risks that leads to these outcomes, each with its measure."""
        own: dict[Sign, float] = {}
        wholes: dict[Sign, float] = {}
        for outcome, measure in outcomes:
            name = self._names[outcome]
            for sign in self.implied_by(outcome):
                if sign == name:
                    own[sign] = max(measure, own.get(sign, 0.0))
                else:
                    wholes[sign] = min(1.0, measure + wholes.get(sign, 0.0))
        likely = {
            sign: max(own.get(sign, 0.0), wholes.get(sign, 0.0)) for sign in own.keys() | wholes
        }
        # In the order of the list, so that the sum is the same to the last bit in every copy.
        return sum(cost * likely[sign] for sign, cost in self.signs.items() if sign in likely)


class Estimated(Protocol):
    """What is needed of the Hypothesis List; see `farside.dem.lists.hypotheses`."""

    context: "array[int]"
    action: "array[int]"
    outcome: "array[int]"
    delay: "array[int]"
    measure: "array[float]"

    def of_cause(self, context: int, action: int) -> Iterator[int]:
        """The hypotheses with this context and action, oldest first."""
        ...

    def estimate_costs(self, hypotheses: Iterable[int]) -> None:
        """Estimate the costs of these anew."""
        ...


class Risks:
    """What an attempt risks, by context and action, kept up to date with the Hypothesis List.

    Args:
        aversions: what is to be avoided.
        hypotheses: the list. It tells of every hypothesis whose measure has changed.

    Attributes:
        by_cause: the risk of each context and action that has any.
    """

    def __init__(self, aversions: AversionList, hypotheses: Estimated) -> None:
        self._aversions, self._hypotheses = aversions, hypotheses
        self.by_cause: dict[tuple[int, int], float] = {}

    def follow(self, hypothesis: int) -> None:
        """A hypothesis was created or removed, or its measure has changed."""
        arcs = self._hypotheses
        if self._aversions.signs and self._aversions.implied_by(arcs.outcome[hypothesis]):
            self._assess(arcs.context[hypothesis], arcs.action[hypothesis])

    def follow_all(self) -> None:
        """Anything may have changed."""
        arcs = self._hypotheses
        risky = {
            (arcs.context[one], arcs.action[one])
            for one, delay in enumerate(arcs.delay)
            if delay and self._aversions.implied_by(arcs.outcome[one])
        }
        for context, action in sorted(risky.union(self.by_cause)):
            self._assess(context, action)

    def _assess(self, context: int, action: int) -> None:
        """Reckon anew what an action risks, and with it the costs of all hypotheses of it."""
        arcs = list(self._hypotheses.of_cause(context, action))
        outcome, measure = self._hypotheses.outcome, self._hypotheses.measure
        risk = self._aversions.risk((outcome[arc], measure[arc]) for arc in arcs)
        if risk == self.by_cause.get((context, action), 0.0):
            return
        self.by_cause[context, action] = risk
        if not risk:
            del self.by_cause[context, action]
        self._hypotheses.estimate_costs(arcs)


def checked(aversions: Iterable[Aversion]) -> tuple[Aversion, ...]:
    """Aversions from a disk or link, if a model can have them.

    Raises:
        ValueError: if one is impossible, or there twice.
    """
    found = tuple(aversions)
    for aversion in found:
        possible = bool(aversion.tokens) and aversion.tokens == to_sign(aversion.tokens)
        costs = aversion.costs.values()
        if not possible or not costs or not all(0.0 <= cost < math.inf for cost in costs):
            raise ValueError(f"expected an aversion at a cost of 0 or more, found {aversion}")
    if len({aversion.tokens for aversion in found}) < len(found):
        raise ValueError("expected no aversion twice")
    return found
