"""G, the Goal List: the Signs that are wanted, by whom, and how much."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import msgspec

from farside.dem.lists import given
from farside.dem.lists.inherent import check_goal
from farside.dem.lists.signs import Sign
from farside.dem.parameters import Parameters

OPERATOR = "operator"
"""The source of a goal that is set without naming one."""

RULE = "rule"
"""The source of the goals of `InherentGoal` rules; no goal can be set in its name."""


class Aside(StrEnum):
    """Why a goal is put aside, so that one of lower priority can be pursued."""

    BLOCKED = "blocked"
    """It is past its break point, and waits to recover."""

    UNKNOWN = "unknown"
    """Its Sign is not known."""

    UNREACHABLE = "unreachable"
    """No way to it is known from the active Signs."""


class Goal(msgspec.Struct, frozen=True):
    """A Sign to be made active, wanted by one source or more.

    Attributes:
        tokens: the Sign.
        priorities: the priority that each source gives the goal, on any scale; one at least. The
            source that wanted it first comes first.
        aside: why the goal is put aside, `None` unless it is. Whether there is a way to a goal is
            looked at when its turn comes, and then in every cycle until there is one.
    """

    tokens: Sign
    priorities: Mapping[str, float]
    aside: Aside | None = None

    @property
    def priority(self) -> float:
        """The priority that counts: the highest that any source gives."""
        return max(self.priorities.values())


class GoalState(msgspec.Struct, frozen=True, array_like=True):
    """A goal as it is saved; see `_Entry`."""

    tokens: Sign
    priorities: dict[str, float]
    value_at_start: float
    blocked_until: int | None
    aside: Aside | None
    told: Aside | None


class GoalsState(msgspec.Struct, frozen=True, array_like=True):
    """A Goal List as it is saved: its goals, the oldest first, and the goals that rules hold.

    Then those that were satisfied as they were set, and are not told yet, with their priorities.
    """

    goals: tuple[GoalState, ...]
    held: tuple[Sign, ...]
    met: tuple[tuple[Sign, dict[str, float]], ...]


class Outlook(NamedTuple):
    """The prospects of a goal in the present situation.

    Attributes:
        value: least policy value P_v of the active Signs, infinite where no path is known.
        planned: gives the cost of the actions on the best path if each succeeds at the first
            attempt. To know it first takes a walk along the path, and is rarely needed.
    """

    value: float
    planned: Callable[[], float]


class _Entry:
    """A goal on the list: who wants it, and the state of its break point.

    Attributes:
        priorities: priority by source, in the order in which the sources came to want it.
        value_at_start: policy value from which growth is measured, infinite until there is one.
        blocked_until: cycle in which it recovers, `None` unless blocked.
        aside: why it is put aside, `None` unless it is.
        told: the same when `GoalList.news` was last asked for.
    """

    def __init__(self) -> None:
        self.priorities: dict[str, float] = {}
        self.value_at_start = math.inf
        self.blocked_until: int | None = None
        self.aside: Aside | None = None
        self.told: Aside | None = None


class GoalList:
    """G, the goals: those put aside come last; by priority, ties to the older.

    A Sign is a goal as long as any source wants it, at the highest priority that any source gives
    it. When the Sign becomes active, the goal is satisfied for all of them.

    A goal that cannot be reached is *put aside*, and the next one is pursued. It is taken up again
    as soon as its Sign, or a way to it, is known (project default).

    A goal has a *break point*. It is blocked, and put aside, when its policy value has grown past a
    multiple of its value when set, and past the same multiple of what the best path costs if all
    goes as planned. After a number of cycles the goal recovers, and its value is measured anew.
    Source: seed for break point and recovery; the numbers, and that a long detour is no block, are
    project defaults.

    Args:
        parameters: whether, when and for how long to put goals aside.

    Attributes:
        ordered: the goals, the top-goal first.
        sought: the top-goal; where all goals are aside, the highest that is not blocked, to which a
            way may yet be found; `None` if there is none.
        unreachable: those that are aside because no way to them is known, highest first.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.ordered: tuple[Goal, ...] = ()
        self.sought: Sign | None = None
        self.unreachable: tuple[Sign, ...] = ()
        self._ranked: list[tuple[Sign, _Entry]] = []
        self._entries: dict[Sign, _Entry] = {}
        # Goals of rules that were reached and have been active ever since.
        self._held: set[Sign] = set()
        # Satisfied as they were set, and not told yet.
        self._met: dict[Sign, dict[str, float]] = {}
        self._parameters = parameters

    def change(self, parameters: Parameters) -> None:
        """Put goals aside by these from now on; without a break point, take up the blocked ones."""
        self._parameters = parameters
        if not parameters.break_point:
            self._take_up([entry for entry in self._entries.values() if entry.blocked_until])

    @property
    def top(self) -> Sign | None:
        """The top-goal, which is pursued; `None` where there is no goal, or all are aside."""
        return self.ordered[0].tokens if self.ordered and self.ordered[0].aside is None else None

    def __contains__(self, sign: Sign) -> bool:
        return sign in self._entries

    def set(
        self, sign: Sign, priority: float, source: str = OPERATOR, *, is_active: bool = False
    ) -> Goal | None:
        """Want a Sign on behalf of `source`, or change the priority that the source gives it.

        The goal keeps its age. One that is active is satisfied at once: it never comes on the list,
        and is among those that `take_satisfied` returns next.

        Returns:
            the goal, if it is satisfied at once.

        Raises:
            ValueError: if `sign` has no Tokens, `priority` is not finite, or `source` is `RULE`.
        """
        priority, source = check_goal(sign, priority), given.name("source of a goal", source)
        if source == RULE:
            raise ValueError(f"source of goal {sign}: expected any but {RULE!r}, found {RULE!r}")
        if is_active:
            self._met.setdefault(sign, {})[source] = priority
            return Goal(sign, {source: priority})
        self._entries.setdefault(sign, _Entry()).priorities[source] = priority
        self._order()
        return None

    def withdraw(self, sign: Sign, source: str = OPERATOR) -> bool:
        """Take back what `source` set; False if it set no such goal.

        The goal stays as long as another source wants it.
        """
        entry, source = self._entries.get(sign), given.name("source of a goal", source)
        if source == RULE or entry is None or source not in entry.priorities:
            return False
        del entry.priorities[source]
        self._order()
        return True

    def priorities(self, sign: Sign) -> Mapping[str, float]:
        """The priority that each source gives a Sign; empty if it is no goal."""
        return dict(self._entries[sign].priorities) if sign in self._entries else {}

    def follow(self, wanted: Mapping[Sign, float], tokens: Sign) -> None:
        """Want exactly these goals by rules, at these priorities, when `tokens` are sensed.

        A goal that was reached is wanted again only after it was inactive.
        """
        self._held = {sign for sign in self._held if sign in wanted and set(sign).issubset(tokens)}
        for sign, entry in self._entries.items():
            if sign not in wanted:
                entry.priorities.pop(RULE, None)
        for sign, priority in wanted.items():
            if sign not in self._held:
                self._entries.setdefault(sign, _Entry()).priorities[RULE] = priority
        self._order()

    def take_satisfied(self, tokens: Sign) -> tuple[Goal, ...]:
        """Remove and return the goals that are active when `tokens` are sensed, highest first.

        Those that were satisfied as they were set, since the last call, are among them. None of
        these is aside any more.
        """
        if not self.ordered and not self._met:
            return ()
        met, self._met = self._met, {}
        satisfied = [goal for goal in self.ordered if set(goal.tokens).issubset(tokens)]
        for goal in satisfied:
            del self._entries[goal.tokens]
            if RULE in goal.priorities:
                self._held.add(goal.tokens)
            met[goal.tokens] = {**met.get(goal.tokens, {}), **goal.priorities}
        if satisfied:
            self._order()
        goals = (Goal(sign, priorities) for sign, priorities in met.items())
        return tuple(sorted(goals, key=lambda goal: -goal.priority))

    def recover(self, cycle: int) -> tuple[Sign, ...]:
        """Take up the goals whose block is over by `cycle`, and return them."""
        recovered = {
            sign: entry
            for sign, entry in self._entries.items()
            if entry.blocked_until is not None and entry.blocked_until <= cycle
        }
        self._take_up(recovered.values())
        return tuple(recovered)

    def _take_up(self, blocked: Collection[_Entry]) -> None:
        for entry in blocked:
            entry.blocked_until = entry.aside = None
            entry.value_at_start = math.inf
        if blocked:
            self._order()

    def put_aside(
        self, is_known: Callable[[Sign], bool], is_reachable: Callable[[Sign], bool]
    ) -> None:
        """Put aside the goals that cannot be reached, and take up those that can be again.

        Blocked goals stay so; all others are taken up without `Parameters.put_aside`. Whether there
        is a way is asked only of goals down to the top-goal, and of those below it that are aside
        already: a map is needed to know it.

        Args:
            is_known: whether a Sign is known.
            is_reachable: whether a way leads from the active Signs to a known Sign.
        """
        changed = has_top = False
        can_wait = self._parameters.put_aside
        for sign, entry in self._ranked:
            if entry.aside is Aside.BLOCKED:
                continue
            aside = None
            if can_wait and not is_known(sign):
                aside = Aside.UNKNOWN
            elif can_wait and (entry.aside or not has_top) and not is_reachable(sign):
                aside = Aside.UNREACHABLE
            has_top |= aside is None
            changed |= aside is not entry.aside
            entry.aside = aside
        if changed:
            self._order()

    def news(self) -> tuple[tuple[Goal, ...], tuple[Sign, ...]]:
        """The goals put aside, or for another reason, and those taken up, since last asked."""
        put_aside: list[Goal] = []
        taken_up: list[Sign] = []
        for goal in self.ordered:
            entry = self._entries[goal.tokens]
            if goal.aside is not entry.told:
                if goal.aside is None:
                    taken_up.append(goal.tokens)
                else:
                    put_aside.append(goal)
                entry.told = goal.aside
        return tuple(put_aside), tuple(taken_up)

    def suspend_broken(
        self,
        cycle: int,
        outlook_of: Callable[[Sign], Outlook],
        detour_of: Callable[[Sign], Outlook],
        *,
        on_course: bool,
    ) -> tuple[Sign, ...]:
        """Put aside one top-goal after another while each is past its break point.

        Without `Parameters.break_point`, their values are only measured.

        Args:
            cycle: the current cycle.
            outlook_of: the outlook of a goal. A goal that no known path leads to is not blocked;
                that is for `put_aside`.
            detour_of: its outlook without the hypothesis to act on next. A goal with a reliable
                detour, by the same multiple, is not blocked either: after a few more failures of
                that hypothesis the detour will be the best path.
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
            multiple, on = self._parameters.break_multiple, self._parameters.break_point
            low = value <= multiple * entry.value_at_start
            if not on or low or value <= multiple * planned():
                break
            detour = detour_of(sign)
            if detour.value <= multiple * detour.planned() < math.inf:
                break
            entry.blocked_until = cycle + self._parameters.recovery
            entry.aside = Aside.BLOCKED
            suspended.append(sign)
            self._order()
        return tuple(suspended)

    def state(self) -> GoalsState:
        """Everything that `restore` needs."""
        goals = tuple(
            GoalState(
                sign,
                dict(entry.priorities),
                entry.value_at_start,
                entry.blocked_until,
                entry.aside,
                entry.told,
            )
            for sign, entry in self._entries.items()
        )
        return GoalsState(goals, tuple(sorted(self._held)), tuple(self._met.items()))

    def restore(self, state: GoalsState) -> None:
        """Become the list that `state` was taken from. This one must be new."""
        for saved in state.goals:
            entry = self._entries[saved.tokens] = _Entry()
            entry.priorities.update(saved.priorities)
            entry.value_at_start = saved.value_at_start
            entry.blocked_until = saved.blocked_until
            entry.aside, entry.told = saved.aside, saved.told
        self._held.update(state.held)
        self._met.update(state.met)
        self._order()

    def _order(self) -> None:
        """Drop the goals that no source wants any more, and sort the others."""
        self._entries = {sign: entry for sign, entry in self._entries.items() if entry.priorities}
        self._ranked = sorted(
            self._entries.items(), key=lambda item: -max(item[1].priorities.values())
        )
        goals = (Goal(sign, dict(entry.priorities), entry.aside) for sign, entry in self._ranked)
        self.ordered = tuple(sorted(goals, key=lambda goal: goal.aside is not None))
        self.sought = sought(self.ordered)
        self.unreachable = tuple(
            goal.tokens for goal in self.ordered if goal.aside is Aside.UNREACHABLE
        )


def sought(goals: Sequence[Goal]) -> Sign | None:
    """The goal that a policy map is wanted of; see `GoalList.sought`.

    Args:
        goals: a Goal List, those put aside last.
    """
    return next((goal.tokens for goal in goals if goal.aside is not Aside.BLOCKED), None)
