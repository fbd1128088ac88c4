"""G, the Goal List: what is wanted, how much, and what is out of reach for now."""

import math
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from farside.dem.signs import Sign


class Goal(msgspec.Struct, frozen=True):
    """A Sign to be made active.

    Attributes:
        tokens: the Sign.
        priority: how much that matters beside other goals; any scale.
        suspended: whether its break point was passed, so that it waits to be tried again.
    """

    tokens: Sign
    priority: float
    suspended: bool = False


class InherentGoal(msgspec.Struct, frozen=True):
    """A rule of the robot's own: while the Sign `when` is active, `goal` is wanted.

    The goal leaves the list when `when` is no longer active.
    """

    when: Sign
    goal: Sign
    priority: float


class GoalState(msgspec.Struct, frozen=True, array_like=True):
    """A goal as it is saved, with the memory that its break point needs."""

    tokens: Sign
    priority: float
    value_at_start: float
    suspended_until: int | None


class Outlook(NamedTuple):
    """What a situation promises for a goal.

    Attributes:
        value: least policy value P_v of the active Signs, infinite where no path is known.
        planned: cost of the best path's actions if each succeeds at once.
    """

    value: float
    planned: float


class _Entry:
    """A goal with the memory that its break point needs."""

    def __init__(self, priority: float) -> None:
        self.priority = priority
        self.value_at_start = math.inf
        self.suspended_until: int | None = None


class GoalList:
    """G, the goals: those that are not suspended first, by priority, ties to the older.

    A goal has a *break point*: when its policy value has grown past a multiple of what it was
    when the goal was set, and past the same multiple of what the best path would cost if all went
    as planned, it is suspended for a while, so that something else is tried. After that it
    recovers by itself, and is measured anew. Source: seed for breaking and recovering; the
    numbers, and that a long way round is no block, are project defaults.

    Args:
        break_multiple: the multiple, above 1.
        recovery: cycles of a suspension.
    """

    def __init__(self, break_multiple: float, recovery: int) -> None:
        self.ordered: tuple[Goal, ...] = ()
        self._break_multiple = break_multiple
        self._recovery = recovery
        self._entries: dict[Sign, _Entry] = {}

    @property
    def top(self) -> Sign | None:
        """The top-goal; `None` where there is no goal, or all are suspended."""
        return self.ordered[0].tokens if self.ordered and not self.ordered[0].suspended else None

    def __contains__(self, sign: Sign) -> bool:
        return sign in self._entries

    def set(self, sign: Sign, priority: float) -> None:
        """Add a goal, or change its priority, which leaves it its age.

        Raises:
            ValueError: if `sign` has no Tokens or `priority` is not finite.
        """
        if not sign:
            raise ValueError("a goal: expected one Token at least, found none")
        if not math.isfinite(priority):
            raise ValueError(f"priority of goal {sign}: expected a finite number, found {priority}")
        if sign in self._entries:
            self._entries[sign].priority = priority
        else:
            self._entries[sign] = _Entry(priority)
        self._order()

    def withdraw(self, sign: Sign) -> bool:
        """Remove a goal. False if there was none of this Sign."""
        found = self._entries.pop(sign, None) is not None
        if found:
            self._order()
        return found

    def take_satisfied(self, tokens: Sign) -> tuple[Goal, ...]:
        """Remove and return the goals that are active when `tokens` are sensed."""
        if not self.ordered:
            return ()
        satisfied = tuple(goal for goal in self.ordered if set(goal.tokens).issubset(tokens))
        for goal in satisfied:
            self.withdraw(goal.tokens)
        return satisfied

    def recover(self, cycle: int) -> tuple[Sign, ...]:
        """End the suspensions that are over by `cycle`: the goals to be tried again."""
        recovered = []
        for sign, entry in self._entries.items():
            if entry.suspended_until is not None and entry.suspended_until <= cycle:
                entry.suspended_until = None
                entry.value_at_start = math.inf
                recovered.append(sign)
        if recovered:
            self._order()
        return tuple(recovered)

    def suspend_broken(
        self, cycle: int, outlook_of: Callable[[Sign], Outlook], *, on_course: bool
    ) -> tuple[Sign, ...]:
        """Suspend top-goals one after the other as long as they are past their break points.

        Args:
            cycle: now.
            outlook_of: what the present situation promises for a goal. One that no known path
                leads to is not suspended: it waits to be explored for.
            on_course: whether the policy map's own choice was performed last. A value that grew
                because somebody led the robot away says nothing of a block.
        """
        suspended = []
        while (sign := self.top) is not None:
            entry, (value, planned) = self._entries[sign], outlook_of(sign)
            if value == math.inf:
                break
            if entry.value_at_start == math.inf:
                entry.value_at_start = value
            elif not on_course:
                entry.value_at_start = max(entry.value_at_start, value)
            if value <= self._break_multiple * max(entry.value_at_start, planned):
                break
            entry.suspended_until = cycle + self._recovery
            suspended.append(sign)
            self._order()
        return tuple(suspended)

    def state(self) -> tuple[GoalState, ...]:
        """Everything that `restore` needs, the oldest goal first."""
        return tuple(
            GoalState(sign, entry.priority, entry.value_at_start, entry.suspended_until)
            for sign, entry in self._entries.items()
        )

    def restore(self, state: tuple[GoalState, ...]) -> None:
        """Become the list that `state` was taken of. This one is new and has no goals yet."""
        for saved in state:
            entry = self._entries[saved.tokens] = _Entry(saved.priority)
            entry.value_at_start = saved.value_at_start
            entry.suspended_until = saved.suspended_until
        self._order()

    def _order(self) -> None:
        goals = (
            Goal(sign, entry.priority, entry.suspended_until is not None)
            for sign, entry in self._entries.items()
        )
        self.ordered = tuple(sorted(goals, key=lambda goal: (goal.suspended, -goal.priority)))
