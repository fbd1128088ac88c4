"""G, the Goal List: what is wanted, how much, and what is out of reach for now."""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import msgspec

from farside.dem.lists.signs import Sign, to_sign


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

    Several rules may have one goal; the highest priority of those that hold counts. While `when`
    and `goal` are both active, the goal is off the list, and it is reached but once. Source: seed
    for such goals; how they go together is a project default.

    Raises:
        ValueError: if `goal` has no Tokens or `priority` is not finite.
        TypeError: if `when` or `goal` is a string.
    """

    when: Sign
    goal: Sign
    priority: float

    def __post_init__(self) -> None:
        msgspec.structs.force_setattr(self, "when", to_sign(self.when))
        msgspec.structs.force_setattr(self, "goal", to_sign(self.goal))
        _check(self.goal, self.priority)


class GoalState(msgspec.Struct, frozen=True, array_like=True):
    """A goal as it is saved; see `_Entry`."""

    tokens: Sign
    given: float | None
    inherent: float | None
    value_at_start: float
    suspended_until: int | None


class GoalsState(msgspec.Struct, frozen=True, array_like=True):
    """A Goal List as it is saved, the oldest goal first, and what rules want but have."""

    goals: tuple[GoalState, ...]
    had: tuple[Sign, ...]


class Outlook(NamedTuple):
    """What a situation promises for a goal.

    Attributes:
        value: least policy value P_v of the active Signs, infinite where no path is known.
        planned: cost of the best path's actions if each succeeds at once.
    """

    value: float
    planned: float


class _Entry:
    """A goal: who wants it, and the memory that its break point needs.

    Attributes:
        given: the priority it was set with, `None` if it was not set.
        inherent: the priority that the robot's own rules give it, `None` if none wants it.
    """

    def __init__(self) -> None:
        self.given: float | None = None
        self.inherent: float | None = None
        self.value_at_start = math.inf
        self.suspended_until: int | None = None

    @property
    def priorities(self) -> list[float]:
        return [one for one in (self.given, self.inherent) if one is not None]


def _check(sign: Sign, priority: float) -> None:
    if not sign:
        raise ValueError("a goal: expected one Token at least, found none")
    if not math.isfinite(priority):
        raise ValueError(f"priority of goal {sign}: expected a finite number, found {priority}")


class GoalList:
    """G, the goals: those that are not suspended first, by priority, ties to the older.

    A goal is there while it was set or a rule of the robot's own wants it, with the higher of the
    two priorities.

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
        # What rules want but have: reached, and active ever since.
        self._had: set[Sign] = set()

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
        _check(sign, priority)
        self._entries.setdefault(sign, _Entry()).given = priority
        self._order()

    def withdraw(self, sign: Sign) -> bool:
        """Remove a goal that was set. False if none was of this Sign.

        While a rule wants it, it stays, with the priority that the rule gives it.
        """
        entry = self._entries.get(sign)
        if entry is None or entry.given is None:
            return False
        entry.given = None
        self._order()
        return True

    def follow(self, rules: Iterable[InherentGoal], tokens: Sign) -> None:
        """Want what the rules want when `tokens` are sensed, and no longer what they wanted before.

        What was reached is wanted again only after it was inactive.
        """
        wanted: dict[Sign, float] = {}
        for rule in rules:
            if set(rule.when).issubset(tokens):
                wanted[rule.goal] = max(rule.priority, wanted.get(rule.goal, rule.priority))
        self._had = {sign for sign in self._had if sign in wanted and set(sign).issubset(tokens)}
        for entry in self._entries.values():
            entry.inherent = None
        for sign, priority in wanted.items():
            if sign not in self._had:
                self._entries.setdefault(sign, _Entry()).inherent = priority
        self._order()

    def take_satisfied(self, tokens: Sign) -> tuple[Goal, ...]:
        """Remove and return the goals that are active when `tokens` are sensed."""
        if not self.ordered:
            return ()
        satisfied = tuple(goal for goal in self.ordered if set(goal.tokens).issubset(tokens))
        for goal in satisfied:
            if self._entries.pop(goal.tokens).inherent is not None:
                self._had.add(goal.tokens)
        if satisfied:
            self._order()
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
        self,
        cycle: int,
        outlook_of: Callable[[Sign], Outlook],
        detour_of: Callable[[Sign], Outlook],
        *,
        on_course: bool,
    ) -> tuple[Sign, ...]:
        """Suspend top-goals one after the other as long as they are past their break points.

        Args:
            cycle: now.
            outlook_of: what the present situation promises for a goal. One that no known path
                leads to is not suspended: it waits to be explored for.
            detour_of: what it would promise without the step to be taken next. A goal that has a
                detour that can be trusted, by the same multiple, is not suspended either: the
                step has only to fail a few times more to be dearer than the way round.
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
            detour = detour_of(sign)
            if detour.value <= self._break_multiple * detour.planned < math.inf:
                break
            entry.suspended_until = cycle + self._recovery
            suspended.append(sign)
            self._order()
        return tuple(suspended)

    def state(self) -> GoalsState:
        """Everything that `restore` needs."""
        goals = tuple(
            GoalState(
                sign, entry.given, entry.inherent, entry.value_at_start, entry.suspended_until
            )
            for sign, entry in self._entries.items()
        )
        return GoalsState(goals, tuple(sorted(self._had)))

    def restore(self, state: GoalsState) -> None:
        """Become the list that `state` was taken of. This one is new and has no goals yet."""
        for saved in state.goals:
            entry = self._entries[saved.tokens] = _Entry()
            entry.given, entry.inherent = saved.given, saved.inherent
            entry.value_at_start = saved.value_at_start
            entry.suspended_until = saved.suspended_until
        self._had.update(state.had)
        self._order()

    def _order(self) -> None:
        """Drop what nobody wants any more, and put the rest in order."""
        self._entries = {sign: entry for sign, entry in self._entries.items() if entry.priorities}
        goals = (
            Goal(sign, max(entry.priorities), entry.suspended_until is not None)
            for sign, entry in self._entries.items()
        )
        self.ordered = tuple(sorted(goals, key=lambda goal: (goal.suspended, -goal.priority)))
