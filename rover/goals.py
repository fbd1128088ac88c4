"""Who wants what: goals of the operator, of the mission, and inherent to the rover."""

from collections.abc import Mapping

from farside.dem import DynamicExpectancyModel, Goal
from farside.messages import GoalReached, Tokens
from farside.node import Journal
from farside.rover.events import EventQueue
from farside.topics import ROVER_GOAL, GoalChange, GoalEntry, GoalSource


class Goals:
    """Keeps the DEM's Goal List for all who may want something.

    A Sign is a goal as long as anyone wants it, with the highest priority that anyone gives it.
    Mission goals are on the list only while the rover is alone, each until it was reached once.
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
        self._wanted: dict[Tokens, dict[GoalSource, float]] = {}

    @property
    def listed(self) -> tuple[Tokens, ...]:
        """The Goal List, top-goal first."""
        return tuple(goal.tokens for goal in self._model.goals)

    @property
    def any_for_alone(self) -> bool:
        """Whether there is any goal to pursue without the operator."""
        return bool(self._wanted or self._mission)

    def want(self, tokens: Tokens, priority: float, source: GoalSource) -> None:
        """Put a Sign on the list for `source`, or change the priority that it gives."""
        owners = self._wanted.setdefault(tokens, {})
        new = source not in owners
        owners[source] = priority
        self._model.set_goal(tokens, max(owners.values()))
        if new:
            self._note(tokens, GoalChange.SET, priority, source)

    def give_up(self, tokens: Tokens, source: GoalSource) -> None:
        """Take a Sign off the list for `source`; it stays while others want it."""
        owners = self._wanted[tokens]
        priority = owners.pop(source)
        if owners:
            self._model.set_goal(tokens, max(owners.values()))
        else:
            del self._wanted[tokens]
            self._model.withdraw_goal(tokens)
        self._note(tokens, GoalChange.WITHDRAWN, priority, source)

    def wants(self, tokens: Tokens, source: GoalSource) -> bool:
        """Whether `source` has this Sign on the list."""
        return source in self._wanted.get(tokens, {})

    def reached(self, goal: Goal) -> None:
        """The DEM found a goal satisfied and took it off its list."""
        for source, priority in self._wanted.pop(goal.tokens).items():
            self._note(goal.tokens, GoalChange.REACHED, priority, source)
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
