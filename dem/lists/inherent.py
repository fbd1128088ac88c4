"""The robot's own rules: what it wants of itself, and when."""

import math

import msgspec

from farside.dem.lists.signs import Sign, to_sign


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
        check_goal(self.goal, self.priority)


def check_goal(sign: Sign, priority: float) -> None:
    """That a Sign can be wanted at a priority.

    Raises:
        ValueError: if it has no Tokens, or the priority is not finite.
    """
    if not sign:
        raise ValueError("a goal: expected one Token at least, found none")
    if not math.isfinite(priority):
        raise ValueError(f"priority of goal {sign}: expected a finite number, found {priority}")
