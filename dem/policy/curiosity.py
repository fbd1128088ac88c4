"""Curiosity: the policy map with a way into the unknown from everywhere.

See `farside.dem.Curiosity` for the rule. The map made here is apart from the Dynamic Policy Map,
which never holds an arc that is not a hypothesis.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from farside.dem.learning.learner import Learner
from farside.dem.parameters import Curiosity
from farside.dem.policy.spread import relax


class Lead(NamedTuple):
    """What curiosity would do.

    Attributes:
        sign: the active Sign to act from.
        action: the Action.
        cost: expected cost to the goal or to something new, whichever is cheaper to reach.
        tries: whether the action is taken to try it, and not for what it is known to do.
    """

    sign: int
    action: int
    cost: float
    tries: bool


class CuriousMap:
    """Least cost to the goal or the frontier, whichever is cheaper to reach.

    It is made for one choice, as what was tried long ago grows more tempting with every cycle, and
    only as far as that choice needs: the values of the active Signs and of what is no farther.

    Args:
        learner: the lists.
        curiosity: what the unknown is worth.
        goal: the goal's Sign; `None` where there is none, or it is not known.
        active: the Signs to choose an action for.
    """

    def __init__(
        self, learner: Learner, curiosity: Curiosity, goal: int | None, active: Sequence[int]
    ) -> None:
        self._learner = learner
        self._curiosity = curiosity
        self._active = active
        cost = self._try_costs()
        if goal is not None:
            cost[goal] = 0.0
        self._value: list[float] = cost.tolist()
        if active:
            self._relax(cost)

    def lead(self, last_action: int | None, rng: Generator) -> Lead | None:
        """What to do with these Signs active, `None` without any.

        Least cost first; ties to the older Sign, then to what is known over what is to be tried.
        Of actions that it would as soon try, the one just performed goes on; without that, one of
        them at random.

        Args:
            last_action: what was performed in the cycle before, if anything.
            rng: drawn from once where several actions tie and none of them goes on.
        """
        if not self._active:
            return None
        born = self._learner.signs.born
        sign = min(self._active, key=lambda one: (self._value[one], born[one]))
        return self._known(sign) or self._untried(sign, last_action, rng)

    def _try_costs(self) -> NDArray[np.float64]:
        """The least cost of trying anything, by Sign: of what was tried longest ago or never.

        An id without a Sign has one as well, but nothing leads there.
        """
        learner, curiosity = self._learner, self._curiosity
        sign_count, action_count = len(learner.signs.names), len(learner.actions)
        last = np.full(sign_count * action_count, -1, dtype=np.int64)
        last[: len(learner.trials.last)] = learner.trials.last
        oldest = last.reshape(sign_count, action_count).min(axis=1)
        again = curiosity.optimistic_cost + curiosity.restlessness / (learner.cycle - oldest)
        return np.where(oldest < 0, curiosity.optimistic_cost, again)

    def _relax(self, cost: NDArray[np.float64]) -> None:
        near = np.flatnonzero(cost <= cost[self._active].min())
        near = near[np.argsort(cost[near], kind="stable")]
        frontier = list(zip(cost[near].tolist(), near.tolist(), strict=True))
        lists = self._learner
        relax(self._value, frontier, lists.hypotheses, lists.signs, until=frozenset(self._active))

    def _known(self, sign: int) -> Lead | None:
        """The hypothesis that the Sign owes its value to: its own, or one of a part of it."""
        hypotheses, value = self._learner.hypotheses, self._value[sign]
        arcs = [
            arc
            for context in (sign, *self._learner.signs.parts(sign))
            for arc in hypotheses.from_context(context)
            if hypotheses.cost[arc] + self._value[hypotheses.outcome[arc]] == value
        ]
        if not arcs:
            return None
        best = min(arcs, key=lambda arc: (-hypotheses.cm[arc], hypotheses.born[arc]))
        return Lead(sign, hypotheses.action[best], value, tries=False)

    def _untried(self, sign: int, last_action: int | None, rng: Generator) -> Lead:
        contexts = (sign, *self._learner.signs.parts(sign))
        costs = [
            min(self._cost_of_trying(context, action) for context in contexts)
            for action in range(len(self._learner.actions))
        ]
        least = min(costs)
        tied = [action for action, cost in enumerate(costs) if cost == least]
        if last_action in tied:
            action = last_action
        else:
            action = tied[rng.integers(len(tied))] if len(tied) > 1 else tied[0]
        return Lead(sign, action, least, tries=True)

    def _cost_of_trying(self, sign: int, action: int) -> float:
        """Optimistic cost c of an action never tried here, c + r/n of one tried n cycles ago."""
        learner = self._learner
        last = learner.trials.last_tried(learner.hypotheses.cause(sign, action))
        if last < 0:
            return self._curiosity.optimistic_cost
        ago = learner.cycle - last
        return self._curiosity.optimistic_cost + self._curiosity.restlessness / ago
