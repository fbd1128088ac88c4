"""The robot's own rules: what it wants of itself, when, and how much."""

from collections.abc import Callable, Iterable, Sequence

import msgspec

from farside.dem.lists.given import finite, given, shown
from farside.dem.lists.signs import Sign, to_sign


class InherentGoal(msgspec.Struct, frozen=True):
    """A rule of the robot's own: while the Sign `when` is active, `goal` is wanted.

    Where several active rules share a goal, the highest of their priorities counts. The goal is
    reached once: it leaves the list, and returns only after it was inactive. Source: seed for goals
    of the robot's own, and for a priority that follows its state, such as the extent of battery
    discharge; the rest is a project default.

    Attributes:
        when: the Sign that makes it active; active always if it has no Tokens.
        goal: the Sign that is wanted then.
        priority: how much, on the same scale as for other goals. A number, or a function of the
            Tokens sensed, which is asked in every cycle in which the rule is active, before
            anything is learned in it. The function may look at more than the Tokens.

    Raises:
        ValueError: if `goal` has no Tokens or `priority` is not finite.
        TypeError: if `when` or `goal` is a string or no Tokens, or `priority` neither a number nor
            a function.
    """

    when: Sign
    goal: Sign
    priority: float | Callable[[Sign], float]

    def __post_init__(self) -> None:
        msgspec.structs.force_setattr(self, "when", to_sign(self.when))
        msgspec.structs.force_setattr(self, "goal", to_sign(self.goal))
        if callable(self.priority):
            check_goal(self.goal, 0.0)
        else:
            msgspec.structs.force_setattr(self, "priority", check_goal(self.goal, self.priority))

    def priority_now(self, tokens: Sign) -> float:
        """The priority where these Tokens are sensed.

        Raises:
            TypeError, ValueError: if a function gives something else than a finite number.
        """
        if not callable(self.priority):
            return self.priority
        what = "priority by the rule {} -> {}"
        return finite(self.priority(tokens), what, self.when, self.goal)


class RuleState(msgspec.Struct, frozen=True, array_like=True):
    """An `InherentGoal` as it is saved: with the priority `None` for a function."""

    when: Sign
    goal: Sign
    priority: float | None


def check_goal(sign: Sign, priority: float) -> float:
    """That a Sign can be wanted at a priority, which is returned.

    Raises:
        TypeError: if the priority is no number.
        ValueError: if it is not finite, or the Sign has no Tokens.
    """
    if not sign:
        raise ValueError("a goal: expected one Token at least, found none")
    return finite(priority, "priority of goal {}", sign)


def rules_given(found: object) -> tuple[InherentGoal, ...]:
    """The rules that a caller gave.

    Raises:
        TypeError: if they are none.
    """
    if not isinstance(found, Iterable):
        raise TypeError(f"inherent: expected rules, found {shown(found)}")
    return tuple(given(InherentGoal, "inherent", rule) for rule in found)


def wanted(rules: Iterable[InherentGoal], tokens: Sign) -> dict[Sign, float]:
    """The goals of those rules that are active when `tokens` are sensed, with their priorities.

    Raises:
        TypeError, ValueError: as `InherentGoal.priority_now` does.
    """
    goals: dict[Sign, float] = {}
    for rule in rules:
        if set(rule.when).issubset(tokens):
            priority = rule.priority_now(tokens)
            goals[rule.goal] = max(priority, goals.get(rule.goal, priority))
    return goals


def saved(rules: Sequence[InherentGoal]) -> tuple[RuleState, ...]:
    """The rules as they are saved."""
    return tuple(
        RuleState(rule.when, rule.goal, None if callable(rule.priority) else rule.priority)
        for rule in rules
    )


def restored(
    states: Sequence[RuleState], rules: Iterable[InherentGoal] | None
) -> tuple[InherentGoal, ...]:
    """The rules that were `saved`.

    Args:
        states: as they were saved.
        rules: the rules themselves; not needed where all priorities are numbers.

    Raises:
        TypeError: if they are no rules.
        ValueError: if they are needed, or are others than those that were saved.
    """
    if rules is None:
        functions = [(rule.when, rule.goal) for rule in states if rule.priority is None]
        if functions:
            raise ValueError(
                "inherent: expected the model's rules once more, because functions are not saved, "
                f"found none; functions give the priorities of {shown(functions)}"
            )
        return tuple(InherentGoal(*msgspec.structs.astuple(rule)) for rule in states)
    rules = rules_given(rules)
    if saved(rules) != tuple(states):
        raise ValueError(
            f"inherent: expected the rules that were saved, {shown(tuple(states))}, "
            f"found {shown(saved(rules))}"
        )
    return rules
