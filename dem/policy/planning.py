"""Planning: the map of the top-goal, and what to read from it: action, path and reason."""

import math
from collections.abc import Iterator, Sequence

import msgspec

from farside.dem.lists.actions import ActionList
from farside.dem.lists.goals import Outlook
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.signs import Sign, SignList
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread

_NO_PATH = Outlook(math.inf, math.inf)


class PolicyValue(msgspec.Struct, frozen=True):
    """A Sign on the DPM.

    Attributes:
        sign: the Sign.
        value: policy value P_v, the least total cost estimate from here to the goal.
        action: the best Action here, `None` at the goal.
        depth: valence depth, the number of steps on the best path to the goal.
    """

    sign: Sign
    value: float
    action: str | None
    depth: int


class PolicyStep(msgspec.Struct, frozen=True):
    """One step of the policy path.

    Attributes:
        sign: context of the hypothesis behind the step.
        action: its Action.
        cost_to_go: policy value P_v of `sign`.
        cm: C_m of the hypothesis.
        probability: that this and all earlier steps succeed at once, the product of their C_m.
    """

    sign: Sign
    action: str
    cost_to_go: float
    cm: float
    probability: float


class Why(msgspec.Struct, frozen=True):
    """The hypothesis behind an action, and the best one for another action.

    Attributes:
        context, action, outcome: the hypothesis.
        cost_to_go: C_e of the hypothesis plus P_v of its outcome.
        runner_up: the same for the best other action, `None` if there is none.
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
        """Bring the map up to date, or build a new one if the top-goal has changed.

        There is no map without a top-goal, or if its Sign is not known.
        """
        known = None if goal is None else self._signs.find(goal)
        if known is None:
            self._map = None
        elif self._map is None or self._map.goal != known or known in self._signs.changed:
            self._map = PolicyMap(known, self._spread)
        elif self._hypotheses.cost_changes or self._signs.changed:
            self._map.update(self._hypotheses.cost_changes, self._signs.changed)
        self._hypotheses.cost_changes.clear()
        self._signs.changed.clear()

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from, `None` if the map suggests no action."""
        return None if self._map is None else self._map.entry(active)

    def value(self, sign: int) -> float:
        """P_v of a Sign towards the top-goal; infinite without a map."""
        return math.inf if self._map is None else self._map.value[sign]

    def action(self, sign: int) -> str:
        """The best action at the Sign that `entry` returned."""
        return self._action_of(next(self._walk(sign)))

    def outlook(self, active: Sequence[int]) -> Outlook:
        """The outlook of the top-goal with these Signs active."""
        return _NO_PATH if self._map is None else self._outlook(self._map, active)

    def detour(self, active: Sequence[int]) -> Outlook:
        """The outlook if the hypothesis to act on next never came true again."""
        entry = self.entry(active)
        if entry is None or self._map is None:
            return _NO_PATH
        cost, blocked = self._hypotheses.cost, next(self._walk(entry))
        held, cost[blocked] = cost[blocked], math.inf
        try:
            return self._outlook(PolicyMap(self._map.goal, self._spread), active)
        finally:
            cost[blocked] = held

    def _outlook(self, policy: PolicyMap, active: Sequence[int]) -> Outlook:
        entry = policy.entry(active)
        if entry is None:
            return _NO_PATH
        costs, action = self._actions.costs, self._hypotheses.action
        planned = sum(costs[action[arc]] for arc in policy.walk(entry))
        return Outlook(policy.value[entry], planned)

    def path(self, active: Sequence[int]) -> tuple[PolicyStep, ...]:
        """The best-estimate walk from the active Signs to the top-goal."""
        entry = self.entry(active)
        if entry is None:
            return ()
        steps, probability = [], 1.0
        for arc in self._walk(entry):
            context, cm = self._hypotheses.context[arc], self._hypotheses.cm[arc]
            probability *= cm
            steps.append(
                PolicyStep(
                    sign=self._signs.names[context],
                    action=self._action_of(arc),
                    cost_to_go=self.value(context),
                    cm=cm,
                    probability=probability,
                )
            )
        return tuple(steps)

    def why(self, active: Sequence[int]) -> Why | None:
        """The hypothesis behind the best action, and the runner-up; `None` without an action."""
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
        assert self._map is not None  # noqa: S101 - there is an entry only with a map
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
