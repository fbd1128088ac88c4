"""Curiosity: a policy map with an arc into the unknown from every Sign.

See `farside.dem.Curiosity` for the rule. This map is separate from the Dynamic Policy Map, whose
arcs are hypotheses only.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from farside.dem.learning.learner import Learner
from farside.dem.parameters import Parameters
from farside.dem.policy.spread import Implications, relax


class Lead(NamedTuple):
    """The action that curiosity would take.

    Attributes:
        sign: the active Sign to act from.
        action: the Action.
        cost: expected cost to the goal or the frontier, whichever is less.
        tries: whether the action is taken to try it out, and not for a known outcome.
    """

    sign: int
    action: int
    cost: float
    tries: bool


class CuriousMap:
    """Least cost from each Sign to the goal or the frontier, whichever is less.

    A map serves one choice only, because the costs of trying fall with every cycle. It is computed
    only as far as that choice needs: for the active Signs and those with lesser values.

    Args:
        learner: the lists.
        parameters: those of the model, with the costs of trying.
        goal: the goal's Sign; `None` if there is no goal, or it is not known.
        active: the active Signs.
    """

    def __init__(
        self, learner: Learner, parameters: Parameters, goal: int | None, active: Sequence[int]
    ) -> None:
        self._learner = learner
        self._curiosity = parameters.curiosity
        self._implied = Implications(learner.signs, parameters)
        self._active = active
        cost = self._try_costs()
        if goal is not None:
            cost[goal] = 0.0
        self._value: list[float] = cost.tolist()
        if active:
            self._relax(cost)

    @property
    def least(self) -> float:
        """The least value of the active Signs, infinite without any."""
        return min((self._value[sign] for sign in self._active), default=math.inf)

    def lead(self, last_action: int | None, rng: Generator) -> Lead | None:
        """The action to take, `None` if no Sign is active.

        The active Sign with the least value decides, ties to the older. A known arc is preferred
        to a trial at the same cost. Of equally cheap trials, the last action is repeated; if it
        is not among them, one is drawn at random.

        Args:
            last_action: the action performed in the last cycle, if any.
            rng: drawn from once if several trials tie and the last action is not among them.
        """
        if not self._active:
            return None
        born = self._learner.signs.born
        sign = min(self._active, key=lambda one: (self._value[one], born[one]))
        return self._known(sign) or self._untried(sign, last_action, rng)

    def _try_costs(self) -> NDArray[np.float64]:
        """The least cost of trying any action, by Sign: that of the action tried longest ago.

        Free ids have a cost too, but no arc leads to them.
        """
        learner, curiosity = self._learner, self._curiosity
        sign_count, action_count = len(learner.signs.names), len(learner.actions)
        last = np.full(sign_count * action_count, -1, dtype=np.int64)
        last[: len(learner.trials.last)] = learner.trials.last
        oldest = last.reshape(sign_count, action_count).min(axis=1)
        again = curiosity.optimistic_cost + curiosity.restlessness / (learner.cycle - oldest)
        cost = np.where(oldest < 0, curiosity.optimistic_cost, again)
        for sign in {sign for sign, _ in learner.hypotheses.risks}:
            cost[sign] = min(
                self._cost_of_trying(sign, action)
                + learner.hypotheses.risks.get((sign, action), 0.0)
                for action in range(action_count)
            )
        return cost

    def _relax(self, cost: NDArray[np.float64]) -> None:
        near = np.flatnonzero(cost <= cost[self._active].min())
        near = near[np.argsort(cost[near], kind="stable")]
        frontier = list(zip(cost[near].tolist(), near.tolist(), strict=True))
        lists = self._learner
        relax(self._value, frontier, lists.hypotheses, self._implied, until=frozenset(self._active))

    def _known(self, sign: int) -> Lead | None:
        """The hypothesis behind the value of a Sign: one of its own, or of one of its parts."""
        hypotheses, value = self._learner.hypotheses, self._value[sign]
        arcs = [
            arc
            for context in (sign, *self._implied.parts(sign))
            for arc in hypotheses.from_context(context)
            if hypotheses.cost[arc] + self._value[hypotheses.outcome[arc]] == value
        ]
        if not arcs:
            return None
        best = min(arcs, key=lambda arc: (-hypotheses.cm[arc], hypotheses.born[arc]))
        return Lead(sign, hypotheses.action[best], value, tries=False)

    def _untried(self, sign: int, last_action: int | None, rng: Generator) -> Lead:
        contexts = (sign, *self._implied.parts(sign))
        costs = [
            min(self._cost_of_trying(context, action) for context in contexts) + self._risk(action)
            for action in range(len(self._learner.actions))
        ]
        least = min(costs)
        tied = [action for action, cost in enumerate(costs) if cost == least]
        if last_action in tied:
            action = last_action
        else:
            action = tied[rng.integers(len(tied))] if len(tied) > 1 else tied[0]
        return Lead(sign, action, least, tries=True)

    def _risk(self, action: int) -> float:
        """What an action risks, by the active Sign that knows worst of it."""
        risks = self._learner.hypotheses.risks
        if not risks:
            return 0.0
        return max(risks.get((context, action), 0.0) for context in self._active)

    def _cost_of_trying(self, sign: int, action: int) -> float:
        """C for an action never tried here, c + r/n for one last tried n cycles ago."""
        learner = self._learner
        last = learner.trials.last_tried(learner.hypotheses.cause(sign, action))
        if last < 0:
            return self._curiosity.optimistic_cost
        ago = learner.cycle - last
        return self._curiosity.optimistic_cost + self._curiosity.restlessness / ago
