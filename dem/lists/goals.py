"""G, the Goal List: the Signs that are wanted, by whom, and how much."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import msgspec

from farside.dem.lists.signs import Sign, to_sign

OPERATOR = "operator"
"""The source of a goal that is set without naming one."""

RULE = "rule"
"""The source of the goals of `InherentGoal` rules; no goal can be set in its name."""


class Goal(msgspec.Struct, frozen=True):
    """A Sign to be made active, wanted by one source or more.

    Attributes:
        tokens: the Sign.
        priorities: the priority that each source gives the goal, on any scale; one at least. The
            source that wanted it first comes first.
        suspended: whether the goal passed its break point and waits to recover.
    """

    tokens: Sign
    priorities: Mapping[str, float]
    suspended: bool = False

    @property
    def priority(self) -> float:
        """The priority that counts: the highest that any source gives."""
        return max(self.priorities.values())


class InherentGoal(msgspec.Struct, frozen=True):
    """A rule of the robot's own: while the Sign `when` is active, `goal` is wanted.

    Where several active rules share a goal, the highest of their priorities counts. The goal is
    reached once: it leaves the list, and returns only after it was inactive. Source: seed for
    goals of the robot's own; the rest is a project default.

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
    priorities: dict[str, float]
    value_at_start: float
    suspended_until: int | None


class GoalsState(msgspec.Struct, frozen=True, array_like=True):
    """A Goal List as it is saved: its goals, the oldest first, and the goals that rules hold."""

    goals: tuple[GoalState, ...]
    held: tuple[Sign, ...]


class Outlook(NamedTuple):
    """The prospects of a goal in the present situation.

    Attributes:
        value: least policy value P_v of the active Signs, infinite where no path is known.
        planned: cost of the actions on the best path if each succeeds at the first attempt.
    """

    value: float
    planned: float


class _Entry:
    """A goal on the list: who wants it, and the state of its break point.

    Attributes:
        priorities: priority by source, in the order in which the sources came to want it.
        value_at_start: policy value from which growth is measured, infinite until there is one.
        suspended_until: cycle in which it recovers, `None` unless suspended.
    """

    def __init__(self) -> None:
        self.priorities: dict[str, float] = {}
        self.value_at_start = math.inf
        self.suspended_until: int | None = None


def _check(sign: Sign, priority: float) -> None:
    if not sign:
        raise ValueError("a goal: expected one Token at least, found none")
    if not math.isfinite(priority):
        raise ValueError(f"priority of goal {sign}: expected a finite number, found {priority}")


class GoalList:
    """G, the goals: active ones before suspended ones, by priority, ties to the older.

    A Sign is a goal as long as any source wants it, at the highest priority that any source gives
    it. When the Sign becomes active, the goal is satisfied for all of them.

    A goal has a *break point*. It is suspended when its policy value has grown past a multiple of
    its value when set, and past the same multiple of what the best path costs if all goes as
    planned. Another goal is then pursued, or exploration. After a number of cycles the goal
    recovers, and its value is measured anew. Source: seed for break point and recovery; the
    numbers, and that a long detour is no block, are project defaults.

    Args:
        break_multiple: the multiple, above 1.
        recovery: number of cycles that a suspension lasts.

    Attributes:
        ordered: the goals, the top-goal first.
    """

    def __init__(self, break_multiple: float, recovery: int) -> None:
        self.ordered: tuple[Goal, ...] = ()
        self._break_multiple = break_multiple
        self._recovery = recovery
        self._entries: dict[Sign, _Entry] = {}
        # Goals of rules that were reached and have been active ever since.
        self._held: set[Sign] = set()

    @property
    def top(self) -> Sign | None:
        """The top-goal; `None` where there is no goal, or all are suspended."""
        return self.ordered[0].tokens if self.ordered and not self.ordered[0].suspended else None

    def __contains__(self, sign: Sign) -> bool:
        return sign in self._entries

    def set(self, sign: Sign, priority: float, source: str = OPERATOR) -> None:
        """Want a Sign on behalf of `source`, or change the priority that the source gives it.

        The goal keeps its age.

        Raises:
            ValueError: if `sign` has no Tokens, `priority` is not finite, or `source` is `RULE`.
        """
        _check(sign, priority)
        if source == RULE:
            raise ValueError(f"source of goal {sign}: expected any but {RULE!r}, found {RULE!r}")
        self._entries.setdefault(sign, _Entry()).priorities[source] = priority
        self._order()

    def withdraw(self, sign: Sign, source: str = OPERATOR) -> bool:
        """Take back what `source` set; False if it set no such goal.

        The goal stays as long as another source wants it.
        """
        entry = self._entries.get(sign)
        if source == RULE or entry is None or source not in entry.priorities:
            return False
        del entry.priorities[source]
        self._order()
        return True

    def priorities(self, sign: Sign) -> Mapping[str, float]:
        """The priority that each source gives a Sign; empty if it is no goal."""
        return dict(self._entries[sign].priorities) if sign in self._entries else {}

    def follow(self, rules: Iterable[InherentGoal], tokens: Sign) -> None:
        """Want exactly the goals of those rules that are active when `tokens` are sensed.

        A goal that was reached is wanted again only after it was inactive.
        """
        wanted: dict[Sign, float] = {}
        for rule in rules:
            if set(rule.when).issubset(tokens):
                wanted[rule.goal] = max(rule.priority, wanted.get(rule.goal, rule.priority))
        self._held = {sign for sign in self._held if sign in wanted and set(sign).issubset(tokens)}
        for sign, entry in self._entries.items():
            if sign not in wanted:
                entry.priorities.pop(RULE, None)
        for sign, priority in wanted.items():
            if sign not in self._held:
                self._entries.setdefault(sign, _Entry()).priorities[RULE] = priority
        self._order()

    def take_satisfied(self, tokens: Sign) -> tuple[Goal, ...]:
        """Remove and return the goals that are active when `tokens` are sensed."""
        if not self.ordered:
            return ()
        satisfied = tuple(goal for goal in self.ordered if set(goal.tokens).issubset(tokens))
        for goal in satisfied:
            del self._entries[goal.tokens]
            if RULE in goal.priorities:
                self._held.add(goal.tokens)
        if satisfied:
            self._order()
        return satisfied

    def recover(self, cycle: int) -> tuple[Sign, ...]:
        """End the suspensions that are over by `cycle`, and return those goals."""
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
        """Suspend one top-goal after another while each is past its break point.

        Args:
            cycle: the current cycle.
            outlook_of: the outlook of a goal. A goal that no known path leads to is not
                suspended: exploration may find one.
            detour_of: its outlook without the hypothesis to act on next. A goal with a reliable
                detour, by the same multiple, is not suspended either: after a few more failures
                of that hypothesis the detour will be the best path.
            on_course: whether the action performed last was the policy map's own choice. A value
                that grew because somebody led the robot away is no sign of a block.
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
            GoalState(sign, dict(entry.priorities), entry.value_at_start, entry.suspended_until)
            for sign, entry in self._entries.items()
        )
        return GoalsState(goals, tuple(sorted(self._held)))

    def restore(self, state: GoalsState) -> None:
        """Become the list that `state` was taken from. This one must be new."""
        for saved in state.goals:
            entry = self._entries[saved.tokens] = _Entry()
            entry.priorities.update(saved.priorities)
            entry.value_at_start = saved.value_at_start
            entry.suspended_until = saved.suspended_until
        self._held.update(state.held)
        self._order()

    def _order(self) -> None:
        """Drop the goals that no source wants any more, and sort the others."""
        self._entries = {sign: entry for sign, entry in self._entries.items() if entry.priorities}
        goals = (
            Goal(sign, dict(entry.priorities), entry.suspended_until is not None)
            for sign, entry in self._entries.items()
        )
        self.ordered = tuple(sorted(goals, key=lambda goal: (goal.suspended, -goal.priority)))
