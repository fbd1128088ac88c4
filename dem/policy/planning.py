"""Planning: the maps of goals, and what to read from them: action, path, reason and cost."""

import math
from collections.abc import Collection, Iterator, Sequence

import msgspec

from farside.dem.lists.actions import ActionList
from farside.dem.lists.goals import Outlook
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.signs import Sign, SignList
from farside.dem.parameters import Parameters, Values
from farside.dem.policy.detour import Detour
from farside.dem.policy.expected_map import Expectation, ExpectedMap
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread

AnyMap = PolicyMap | ExpectedMap

_NO_PATH = Outlook(math.inf, lambda: math.inf)

WATCHED = 8
"""The number of Signs whose maps are kept because `Planner.cost_to` was asked for them (project
default). Every map takes time in every cycle."""


class PolicyValue(msgspec.Struct, frozen=True):
    """A Sign on the DPM.

    Attributes:
        sign: the Sign.
        value: policy value P_v from here to the goal: the least total cost estimate, or the
            expected cost (`Parameters.values`).
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
        cost_to_go: C_e of the hypothesis plus P_v of its outcome; with expected values, the
            expected cost of the action.
        cm: C_m of the hypothesis.
        runner_up: the same for the best other action, `None` if there is none.
    """

    context: Sign
    action: str
    outcome: Sign
    cost_to_go: float
    cm: float
    runner_up: "Why | None" = None

    @property
    def margin(self) -> float | None:
        """By how much the runner-up is dearer, 0 or more; `None` without a runner-up."""
        return None if self.runner_up is None else self.runner_up.cost_to_go - self.cost_to_go


class Planner:
    """Keeps the Dynamic Policy Maps of some goals up to date with the lists.

    A map is built when it is first needed, and repaired after every change of the lists until
    `aim` finds that nobody needs it any more. What is told of "the map" is told of the one aimed
    at. After any change to the lists, call `refresh` or `aim` before any other method.

    Args:
        signs, hypotheses, actions: the lists.
        parameters: those of the model.
    """

    def __init__(
        self,
        signs: SignList,
        hypotheses: HypothesisList,
        actions: ActionList,
        parameters: Parameters,
    ) -> None:
        self._signs, self._hypotheses, self._actions = signs, hypotheses, actions
        self.change(parameters)
        # The one asked for longest ago comes first.
        self._watched: dict[Sign, None] = {}

    def change(self, parameters: Parameters) -> None:
        """Plan by these from now on; all maps are built anew when they are needed."""
        self._spread = Spread(self._hypotheses, self._signs, parameters)
        self._expectation = (
            Expectation(self._spread) if parameters.values is Values.EXPECTED else None
        )
        self._map: AnyMap | None = None
        self._maps: dict[Sign, AnyMap] = {}
        self._detour: Detour | None = None

    def refresh(self) -> None:
        """Bring all maps up to date with the lists."""
        costs, signs = self._hypotheses.cost_changes, self._signs.changed
        if signs:
            # Its id may be that of another Sign now.
            self._maps = {
                goal: policy for goal, policy in self._maps.items() if policy.goal not in signs
            }
        if costs or signs:
            for policy in self._maps.values():
                policy.update(costs, signs)
            if self._detour is not None:
                self._detour.update(costs, signs)
            costs.clear()
            signs.clear()

    def aim(self, goal: Sign | None, others: Collection[Sign] = ()) -> None:
        """Bring all maps up to date, and aim at the map of `goal`.

        There is no map without a goal, or if its Sign is not known. Of the other maps, only those
        of `others` and of the Signs that `cost_to` was asked for are kept.
        """
        self.refresh()
        self._map = None if goal is None else self._map_of(goal)
        if self._detour is not None and self._detour.of is not self._map:
            self._detour = None
        if len(self._maps) > (self._map is not None):
            self._maps = {
                kept: policy
                for kept, policy in self._maps.items()
                if kept == goal or kept in others or kept in self._watched
            }

    def _new_map(self, goal: int) -> AnyMap:
        if self._expectation is None:
            return PolicyMap(goal, self._spread)
        return ExpectedMap(goal, self._expectation)

    def _map_of(self, goal: Sign) -> AnyMap | None:
        """The map of a goal, built if it is not kept; `None` if the Sign is not known."""
        policy = self._maps.get(goal)
        if policy is None:
            known = self._signs.find(goal)
            if known is None:
                return None
            policy = self._maps[goal] = self._new_map(known)
        return policy

    def knows(self, goal: Sign) -> bool:
        """Whether the Sign of a goal is known."""
        return self._signs.find(goal) is not None

    def reaches(self, goal: Sign, active: Sequence[int]) -> bool:
        """Whether a way is known from one of the active Signs to a goal, or it is active itself."""
        policy = self._map_of(goal)
        return policy is not None and policy.nearest(active) < math.inf

    def cost_to(self, goal: Sign, starts: Sequence[int]) -> float:
        """P_v of the best of some Signs towards any goal, infinite where no way is known.

        The map is kept, so that asking again costs next to nothing, until the costs to `WATCHED`
        other goals have been asked for.
        """
        self.refresh()
        policy = self._map_of(goal)
        if policy is None:
            return math.inf
        self._watched.pop(goal, None)
        self._watched[goal] = None
        if len(self._watched) > WATCHED:
            del self._watched[next(iter(self._watched))]
        return policy.nearest(starts)

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from, `None` if the map suggests no action."""
        policy, risks = self._map, self._hypotheses.risks
        if policy is None:
            return None
        if not risks or policy.nearest(active) == 0.0:
            return policy.entry(active)
        totals = {sign: self._with_all_risks(policy, sign, active) for sign in active}
        least = min(totals.values(), default=math.inf)
        return policy.entry([sign for sign, total in totals.items() if total <= least])

    def _with_all_risks(self, policy: AnyMap, sign: int, active: Sequence[int]) -> float:
        """P_v of an active Sign, by what any active Sign knows of the risk of its best action."""
        arc = policy.best(sign)
        if arc is None:
            return math.inf
        arcs, risks = self._hypotheses, self._hypotheses.risks
        action = arcs.action[arc]
        most = max(risks.get((context, action), 0.0) for context in active)
        more = max(0.0, most - risks.get((arcs.context[arc], action), 0.0))
        return policy.nearest((sign,)) + more / arcs.measure[arc]

    def value(self, sign: int) -> float:
        """P_v of a Sign on the map; infinite without a map."""
        return math.inf if self._map is None else self._map.nearest((sign,))

    def action(self, sign: int) -> str:
        """The best action at the Sign that `entry` returned."""
        best = None if self._map is None else self._map.best(sign)
        assert best is not None  # noqa: S101 - there is an entry only with a map, short of the goal
        return self._action_of(best)

    def outlook(self, goal: Sign, active: Sequence[int]) -> Outlook:
        """The outlook of a goal with these Signs active."""
        policy = self._map_of(goal)
        if policy is None:
            return _NO_PATH
        return Outlook(policy.nearest(active), lambda: policy.planned(active, self._actions))

    def detour(self, goal: Sign, active: Sequence[int]) -> Outlook:
        """The outlook of a goal if the hypothesis to act on next never came true again."""
        policy = self._map_of(goal)
        entry = None if policy is None else policy.entry(active)
        blocked = None if policy is None or entry is None else policy.best(entry)
        if policy is None or blocked is None:
            return _NO_PATH
        if self._detour is None or self._detour.of is not policy:
            self._detour = Detour(policy, self._hypotheses)
        value, plan = self._detour.outlook(blocked, active, self._actions)
        return Outlook(value, lambda: plan)

    def path(self, active: Sequence[int]) -> tuple[PolicyStep, ...]:
        """The best-estimate walk from the active Signs to the goal."""
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
            cm=self._hypotheses.cm[arc],
        )

    def _action_of(self, arc: int) -> str:
        return self._actions.names[self._hypotheses.action[arc]]
