"""Who wants what: goals of the operator, of the mission, and inherent to the rover."""

from collections.abc import Mapping, Sequence

from farside.dem import Goal
from farside.messages import GoalAside, GoalReached, Tokens
from farside.node import Journal
from farside.rover.controller import Controller
from farside.rover.events import EventQueue
from farside.topics import ROVER_GOAL, GoalChange, GoalEntry, GoalSource


class Goals:
    """The one owner of goals: puts Signs on the Goal List, and tells what becomes of them.

    The controller knows which source wants a Sign, and which priority counts. Mission goals are on
    the list only while the rover is alone, or has the operator's word to go on with them; each
    until it was reached once, or the operator withdrew it.

    Args:
        controller: whose list it is.
        mission: the mission goals with their priorities.
        journal, events: where changes are noted, and told to the ground.

    Attributes:
        reached_lately: the goals reached since somebody cleared the list.
    """

    def __init__(
        self,
        controller: Controller,
        mission: Mapping[Tokens, float],
        journal: Journal,
        events: EventQueue,
    ) -> None:
        self._controller = controller
        self._mission = dict(mission)
        self._inherent: set[Tokens] = set()
        self._dismissed: set[Tokens] = set()  # of these, what the operator does not want
        self._aside: dict[Tokens, str] = {}
        self._met: set[Tokens] = set()  # satisfied as they were set, and not told yet
        self.reached_lately: list[Tokens] = []
        self._journal, self._events = journal, events

    # --- what is wanted ------------------------------------------------------------------------

    @property
    def listed(self) -> tuple[Tokens, ...]:
        """The Goal List, top-goal first, those put aside last."""
        return tuple(goal.tokens for goal in self._controller.goals)

    @property
    def all(self) -> tuple[Goal, ...]:
        """The goals on the list, in the same order."""
        return self._controller.goals

    @property
    def top(self) -> Goal | None:
        """The top-goal; `None` where there is none, or all are put aside."""
        goals = self._controller.goals
        return goals[0] if goals and goals[0].aside is None else None

    @property
    def for_alone(self) -> tuple[Tokens, ...]:
        """The goals that the rover would pursue without the operator, by priority."""
        wanted = dict(self._mission)
        for goal in self._controller.goals:
            wanted[goal.tokens] = max(goal.priority, wanted.get(goal.tokens, goal.priority))
        return tuple(sorted(wanted, key=lambda tokens: -wanted[tokens]))

    @property
    def any_for_alone(self) -> bool:
        """Whether there is any goal to pursue without the operator."""
        return bool(self._mission or self._controller.goals)

    def most_wanted_beside(self, tokens: Tokens) -> float:
        """The highest priority of any other goal that the rover would pursue, 0 without one."""
        priorities = [goal.priority for goal in self._controller.goals if goal.tokens != tokens]
        return max([*priorities, *self._mission.values()], default=0.0)

    def wants(self, tokens: Tokens, source: GoalSource) -> bool:
        """Whether `source` has this Sign on the list."""
        return source in self._controller.goal_priorities(tokens)

    def are_met(self, sensed: frozenset[str]) -> bool:
        """Whether a goal is satisfied where this is sensed, and is to be told."""
        return bool(self._met) or any(sensed.issuperset(goal) for goal in self.listed)

    # --- changes -------------------------------------------------------------------------------

    def want(self, tokens: Tokens, priority: float, source: GoalSource) -> None:
        """Put a Sign on the list for `source`, or change the priority that it gives."""
        tokens = _sign(tokens)
        new = not self.wants(tokens, source)
        if self._controller.set_goal(tokens, priority, source.value) is not None:
            self._met.add(tokens)
        if new:
            self._note(tokens, GoalChange.SET, priority, source)

    def withdraw(self, tokens: Tokens) -> str | None:
        """The operator does not want a Sign any more; the reason why not, if it is no goal.

        What the operator set goes first, then what the mission or the rover itself wants. A
        mission goal is withdrawn for good, also before it comes on the list; the rover's own until
        the rover stops wanting it.
        """
        tokens = _sign(tokens)
        if self.wants(tokens, GoalSource.OPERATOR):
            self._give_up(tokens, GoalSource.OPERATOR)
        elif tokens in self._mission:
            priority = self._mission.pop(tokens)
            if self.wants(tokens, GoalSource.MISSION):
                self._give_up(tokens, GoalSource.MISSION)
            else:
                self._note(tokens, GoalChange.WITHDRAWN, priority, GoalSource.MISSION)
        elif self.wants(tokens, GoalSource.INHERENT):
            self._dismissed.add(tokens)
            self._give_up(tokens, GoalSource.INHERENT)
        else:
            return "it is no goal"
        return None

    def follow_inherent(self, tokens: Tokens, priority: float | None) -> None:
        """Want a Sign of the rover's own at this priority; `None` for not any more."""
        if priority is not None:
            if tokens not in self._dismissed | self._met:
                self._inherent.add(tokens)
                self.want(tokens, priority, GoalSource.INHERENT)
        elif tokens in self._inherent:
            self._inherent.remove(tokens)
            self._dismissed.discard(tokens)
            if self.wants(tokens, GoalSource.INHERENT):
                self._give_up(tokens, GoalSource.INHERENT)

    def follow_mission(self, *, wanted: bool) -> None:
        """Have the mission goals that are left on the list, or not."""
        for tokens, priority in self._mission.items():
            if wanted is not self.wants(tokens, GoalSource.MISSION) and tokens not in self._met:
                if wanted:
                    self.want(tokens, priority, GoalSource.MISSION)
                else:
                    self._give_up(tokens, GoalSource.MISSION)

    def change_mission(self, before: Mapping[Tokens, float], after: Mapping[Tokens, float]) -> None:
        """Have other mission goals from now on: those that were reached or withdrawn stay so.

        Args:
            before: the mission goals so far, with their priorities.
            after: those from now on.
        """
        for tokens in [tokens for tokens in before if tokens not in after]:
            left = self._mission.pop(tokens, None)
            if left is not None and self.wants(tokens, GoalSource.MISSION):
                self._give_up(tokens, GoalSource.MISSION)
        for tokens, priority in after.items():
            if tokens not in before or (tokens in self._mission and priority != before[tokens]):
                self._mission[tokens] = priority
                if self.wants(tokens, GoalSource.MISSION):
                    self.want(tokens, priority, GoalSource.MISSION)

    def reached(self, goals: Sequence[Goal]) -> None:
        """The controller found goals satisfied and took them off its list."""
        self._met.clear()
        for goal in goals:
            for source, priority in goal.priorities.items():
                self._note(goal.tokens, GoalChange.REACHED, priority, GoalSource(source))
            self._mission.pop(goal.tokens, None)
            self.reached_lately.append(goal.tokens)
            self._events.tell(GoalReached(goal.tokens))

    def follow_aside(self, sensed: frozenset[str]) -> None:
        """Tell which goals the controller has put aside, or taken up again, since the last call.

        A goal that is active where `sensed` is what is sensed is about to be satisfied.
        """
        goals = [goal for goal in self._controller.goals if not sensed.issuperset(goal.tokens)]
        if not self._aside and all(goal.aside is None for goal in goals):
            return
        before, self._aside = self._aside, {}
        for goal in goals:
            why = None if goal.aside is None else goal.aside.value
            if why is not None:
                self._aside[goal.tokens] = why
            if why != before.get(goal.tokens):
                change = GoalChange.RECOVERED if why is None else GoalChange.SUSPENDED
                source = GoalSource(next(iter(goal.priorities)))
                self._note(goal.tokens, change, goal.priority, source, why)
                self._events.tell(GoalAside(goal.tokens, why))

    def _give_up(self, tokens: Tokens, source: GoalSource) -> None:
        priority = self._controller.goal_priorities(tokens)[source]
        self._controller.withdraw_goal(tokens, source.value)
        self._note(tokens, GoalChange.WITHDRAWN, priority, source)

    def _note(
        self,
        tokens: Tokens,
        change: GoalChange,
        priority: float,
        source: GoalSource,
        why: str | None = None,
    ) -> None:
        self._journal.note(ROVER_GOAL, GoalEntry(tokens, change, priority, source, why))


def _sign(tokens: Tokens) -> Tokens:
    """The Sign of these Tokens, in whatever order an operator names them."""
    return tuple(sorted(set(tokens)))
