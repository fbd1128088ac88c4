"""Pursuit: which goal of the Goal List is pursued now, and what the maps tell of it."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from farside.dem.learning.learner import Learner
from farside.dem.lists.goals import Goal, GoalList, Outlook
from farside.dem.lists.inherent import InherentGoal, wanted
from farside.dem.lists.signs import Sign
from farside.dem.parameters import Parameters
from farside.dem.policy.planning import Planner


class GoalNews(NamedTuple):
    """What became of the goals in a cycle; see `farside.dem.Sensed`."""

    reached: tuple[Goal, ...]
    suspended: tuple[Goal, ...]
    recovered: tuple[Sign, ...]


class Pursuit:
    """The Goal List and the maps of its goals, kept in step with each other and with the lists.

    Args:
        learner: the lists.
        parameters: those of the model.
        inherent: the robot's own goals.

    Attributes:
        goals: the Goal List.
        planner: the maps.
    """

    def __init__(
        self, learner: Learner, parameters: Parameters, inherent: Sequence[InherentGoal]
    ) -> None:
        self.goals = GoalList(parameters)
        self.planner = Planner(learner.signs, learner.hypotheses, learner.actions, parameters)
        self._learner = learner
        self._signs = learner.signs
        self._inherent = inherent
        self._active: Sequence[int] = ()  # in the present call

    def change(self, parameters: Parameters) -> None:
        """Pursue goals by these from now on; call `attend` before any other method."""
        self.goals.change(parameters)
        self.planner.change(parameters)

    def wanted(self, tokens: Sign) -> Mapping[Sign, float]:
        """What the robot wants of itself where `tokens` are sensed; raises what rules raise."""
        return wanted(self._inherent, tokens) if self._inherent else {}

    def sense(
        self,
        tokens: Sign,
        active: Sequence[int],
        by_rules: Mapping[Sign, float],
        *,
        on_course: bool,
    ) -> GoalNews:
        """Drop the goals that were reached, and choose among the others.

        Args:
            tokens: what is sensed.
            active: the active Signs, with everything learned from them.
            by_rules: what was `wanted` by rules before that.
            on_course: whether the action performed last was the policy map's own choice.
        """
        goals = self.goals
        if self._inherent:
            goals.follow(by_rules, tokens)
            self.know_goals()
        reached = goals.take_satisfied(tokens)
        if not goals.ordered:
            self.aim()
            return GoalNews(reached, (), ())
        cycle = self._learner.cycle
        goals.recover(cycle)
        self.attend(active)
        while goals.suspend_broken(cycle, self._outlook, self._detour, on_course=on_course):
            # The next goal may be one that no way leads to.
            self.attend(active)
        suspended, recovered = goals.news()
        return GoalNews(reached, suspended, recovered)

    def attend(self, active: Sequence[int]) -> None:
        """Put goals aside and take them up again as things are now, and aim at what is sought."""
        self._active = active
        self.planner.refresh()
        self.goals.put_aside(self.planner.knows, self._is_reachable)
        self.aim()

    def _is_reachable(self, goal: Sign) -> bool:
        # A Sign that became known in this cycle is not among the active ones yet.
        active = self._active
        return self.planner.reaches(goal, active) or self.is_active(goal, active)

    def is_active(self, sign: Sign, active: Sequence[int]) -> bool:
        """Whether a Sign is active, known or not, where these Signs are."""
        return set(sign).issubset(self._sensed(active))

    def _sensed(self, active: Sequence[int]) -> set[str]:
        return {token for sign in active for token in self._signs.names[sign]}

    def _outlook(self, goal: Sign) -> Outlook:
        return self.planner.outlook(goal, self._active)

    def _detour(self, goal: Sign) -> Outlook:
        return self.planner.detour(goal, self._active)

    def aim(self) -> None:
        """Bring the maps up to date, that of the goal that is sought above all."""
        self.planner.aim(self.goals.sought, self.goals.unreachable)

    def cost_to(self, goal: Sign, start: Sign | None, active: Sequence[int]) -> float:
        """P_v towards any Sign; see `farside.dem.DynamicExpectancyModel.cost_to`.

        Raises:
            ValueError: if `goal` has no Tokens.
        """
        if not goal:
            raise ValueError("goal: expected one Token at least, found none")
        if set(goal).issubset(self._sensed(active) if start is None else start):
            return 0.0
        if start is None:
            return self.planner.cost_to(goal, active)
        known = self._signs.find(start)
        return self.planner.cost_to(goal, [] if known is None else self._signs.active(start))

    def needed(self) -> list[int]:
        """The Signs that are goals now, or may become so by a rule, or are to be avoided."""
        wanted = [goal.tokens for goal in self.goals.ordered]
        wanted += [rule.goal for rule in self._inherent]
        wanted += self._learner.aversions.signs
        return [sign for sign in map(self._signs.find, wanted) if sign is not None]

    def know_goals(self) -> None:
        """Add the Signs of all goals; one of a single Token becomes known when it is sensed."""
        for goal in self.goals.ordered:
            if len(goal.tokens) > 1:
                self._learner.know(goal.tokens)
