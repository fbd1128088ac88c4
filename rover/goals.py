"""Who wants what: goals of the operator, of the mission, and inherent to the rover."""

from collections.abc import Mapping

from farside.dem import DynamicExpectancyModel, Goal
from farside.messages import GoalReached, Tokens
from farside.node import Journal
from farside.rover.events import EventQueue
from farside.topics import ROVER_GOAL, GoalChange, GoalEntry, GoalSource


class Goals:
    """Puts Signs on the DEM's Goal List for each source, and records every change.

    The DEM knows which source wants a Sign, and which priority counts. Mission goals are on the
    list only while the rover is alone, each until it was reached once.
    """

    def __init__(
        self,
        model: DynamicExpectancyModel,
        mission: Mapping[Tokens, float],
        journal: Journal,
        events: EventQueue,
    ) -> None:
        self._model = model
        self._mission = dict(mission)
        self._journal, self._events = journal, events

    @property
    def listed(self) -> tuple[Tokens, ...]:
        """The Goal List, top-goal first."""
        return tuple(goal.tokens for goal in self._model.goals)

    @property
    def any_for_alone(self) -> bool:
        """Whether there is any goal to pursue without the operator."""
        return bool(self._model.goals or self._mission)

    def want(self, tokens: Tokens, priority: float, source: GoalSource) -> None:
        """Put a Sign on the list for `source`, or change the priority that it gives."""
        new = not self.wants(tokens, source)
        self._model.set_goal(tokens, priority, source.value)
        if new:
            self._note(tokens, GoalChange.SET, priority, source)

    def give_up(self, tokens: Tokens, source: GoalSource) -> None:
        """Take a Sign off the list for `source`; it stays while others want it."""
        priority = self._model.goal_priorities(tokens)[source]
        self._model.withdraw_goal(tokens, source.value)
        self._note(tokens, GoalChange.WITHDRAWN, priority, source)

    def wants(self, tokens: Tokens, source: GoalSource) -> bool:
        """Whether `source` has this Sign on the list."""
        return source in self._model.goal_priorities(tokens)

    def reached(self, goal: Goal) -> None:
        """The DEM found a goal satisfied and took it off its list."""
        for source, priority in goal.priorities.items():
            self._note(goal.tokens, GoalChange.REACHED, priority, GoalSource(source))
        self._mission.pop(goal.tokens, None)
        self._events.tell(GoalReached(goal.tokens))

    def take_up_mission(self) -> None:
        """Put the mission goals that are left on the list."""
        for tokens, priority in self._mission.items():
            self.want(tokens, priority, GoalSource.MISSION)

    def put_down_mission(self) -> None:
        """Take the mission goals off the list until the rover is alone again."""
        for tokens in self._mission:
            if self.wants(tokens, GoalSource.MISSION):
                self.give_up(tokens, GoalSource.MISSION)

    def _note(
        self, tokens: Tokens, change: GoalChange, priority: float, source: GoalSource
    ) -> None:
        self._journal.note(ROVER_GOAL, GoalEntry(tokens, change, priority, source))
