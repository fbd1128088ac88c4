"""Planning: which goal, which map, which way, and why."""

import math
from collections.abc import Iterator, Sequence

import msgspec

from farside.dem.lists.goals import Outlook
from farside.dem.lists.hypotheses import ActionList, HypothesisList
from farside.dem.lists.signs import Sign, SignList
from farside.dem.policy.map import PolicyMap
from farside.dem.policy.spread import Spread

_NO_WAY = Outlook(math.inf, math.inf)


class PolicyValue(msgspec.Struct, frozen=True):
    """What the DPM knows of a Sign.

    Attributes:
        sign: the Sign.
        value: policy value P_v, least total cost estimate from here to the goal.
        action: best Action here, `None` where the goal is reached.
        depth: valence depth, steps from here to the goal on the best path.
    """

    sign: Sign
    value: float
    action: str | None
    depth: int


class PathStep(msgspec.Struct, frozen=True):
    """One step of the policy path.

    Attributes:
        sign: the context that the step begins from.
        action: what to do there.
        cost_to_go: policy value P_v at `sign`.
        cm: C_m of the hypothesis behind the step.
        probability: that all goes as planned up to the end of this step, the product of C_m.
    """

    sign: Sign
    action: str
    cost_to_go: float
    cm: float
    probability: float


class Why(msgspec.Struct, frozen=True):
    """The hypothesis behind an action, and the best one that speaks for another action.

    Attributes:
        context, action, outcome: the hypothesis.
        cost_to_go: C_e of the hypothesis and P_v of its outcome together.
        runner_up: the same for the best other action, `None` where there is none.
    """

    context: Sign
    action: str
    outcome: Sign
    cost_to_go: float
    runner_up: "Why | None" = None


class Planner:
    """Keeps the Dynamic Policy Map of the top-goal up to date with the lists.

    Args:
        signs, hypotheses, actions: the lists.
    """

    def __init__(self, signs: SignList, hypotheses: HypothesisList, actions: ActionList) -> None:
        self._signs, self._hypotheses, self._actions = signs, hypotheses, actions
        self._spread = Spread(self._hypotheses, self._signs)
        self._map: PolicyMap | None = None

    def aim(self, goal: Sign | None) -> None:
        """Bring the map of the top-goal up to date; of a new one, if it is another.

        There is no map without a top-goal, or towards a Sign that is not known.
        """
        known = None if goal is None else self._signs.find(goal)
        if known is None:
            self._map = None
        elif self._map is None or self._map.goal != known or known in self._signs.changed:
            self._map = PolicyMap(known, self._spread)
        elif self._hypotheses.changes or self._signs.changed:
            self._map.update(self._hypotheses.changes, self._signs.changed)
        self._hypotheses.changes.clear()
        self._signs.changed.clear()

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from, `None` where there is nothing to do for the top-goal."""
        return None if self._map is None else self._map.entry(active)

    def value(self, sign: int) -> float:
        """P_v of a Sign towards the top-goal, infinite without a map."""
        return math.inf if self._map is None else self._map.value[sign]

    def action(self, sign: int) -> str:
        """The best action at a Sign that `entry` gave."""
        return self._action_of(next(self._walk(sign)))

    def outlook(self, active: Sequence[int]) -> Outlook:
        """What the situation promises for the top-goal."""
        return _NO_WAY if self._map is None else self._outlook(self._map, active)

    def detour(self, active: Sequence[int]) -> Outlook:
        """What it would promise if the hypothesis to act on now never came true again."""
        entry = self.entry(active)
        if entry is None or self._map is None:
            return _NO_WAY
        cost, blocked = self._hypotheses.cost, next(self._walk(entry))
        held, cost[blocked] = cost[blocked], math.inf
        try:
            return self._outlook(PolicyMap(self._map.goal, self._spread), active)
        finally:
            cost[blocked] = held

    def _outlook(self, policy: PolicyMap, active: Sequence[int]) -> Outlook:
        entry = policy.entry(active)
        if entry is None:
            return _NO_WAY
        costs, action = self._actions.costs, self._hypotheses.action
        planned = sum(costs[action[arc]] for arc in policy.walk(entry))
        return Outlook(policy.value[entry], planned)

    def path(self, active: Sequence[int]) -> tuple[PathStep, ...]:
        """The best-estimate walk from the situation to the top-goal."""
        entry = self.entry(active)
        if entry is None:
            return ()
        steps, probability = [], 1.0
        for arc in self._walk(entry):
            context, cm = self._hypotheses.context[arc], self._hypotheses.cm[arc]
            probability *= cm
            steps.append(
                PathStep(
                    sign=self._signs.names[context],
                    action=self._action_of(arc),
                    cost_to_go=self.value(context),
                    cm=cm,
                    probability=probability,
                )
            )
        return tuple(steps)

    def why(self, active: Sequence[int]) -> Why | None:
        """What speaks for the best action in the situation, `None` where there is none."""
        entry = self.entry(active)
        reason = None if entry is None or self._map is None else self._map.why(entry)
        if reason is None:
            return None
        rival = None if reason.rival is None else self._why(reason.rival, reason.rival_total)
        return msgspec.structs.replace(self._why(reason.arc, reason.total), runner_up=rival)

    def table(self) -> tuple[PolicyValue, ...]:
        """The map, ordered by value, then Sign."""
        if self._map is None:
            return ()
        rows = (
            PolicyValue(
                sign=self._signs.names[sign],
                value=value,
                action=None if best < 0 else self._action_of(best),
                depth=depth,
            )
            for sign, value, best, depth in zip(
                *(column.tolist() for column in self._map.table()), strict=True
            )
        )
        return tuple(sorted(rows, key=lambda row: (row.value, row.sign)))

    def _walk(self, entry: int) -> Iterator[int]:
        assert self._map is not None  # noqa: S101 - an entry comes from a map
        return self._map.walk(entry)

    def _why(self, arc: int, total: float) -> Why:
        names = self._signs.names
        return Why(
            context=names[self._hypotheses.context[arc]],
            action=self._action_of(arc),
            outcome=names[self._hypotheses.outcome[arc]],
            cost_to_go=total,
        )

    def _action_of(self, arc: int) -> str:
        return self._actions.names[self._hypotheses.action[arc]]
