"""What flies the rover when the operator does not: the protocol of a learning controller."""

from collections.abc import Iterable, Mapping
from typing import Protocol, runtime_checkable

from farside.dem import Choice, Delta, Goal, Hypothesis, PolicyStep, PolicyValue, Sensed, Why
from farside.messages import Tokens
from farside.topics import GoalSource


class Controller(Protocol):
    """A controller on board. `farside.dem.DynamicExpectancyModel` is one.

    A cycle is `sense`, then `choose` if the controller is to choose, then `perform` with the action
    that is really performed, whoever chose it, as it begins. Goals may be set and withdrawn at any
    time. `farside.rover.PlainController` keeps the goals and leaves `choose` to its user.
    """

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List: the top-goal first, those put aside last."""
        ...

    @property
    def sign_count(self) -> int:
        """How many Signs it knows."""
        ...

    @property
    def hypothesis_count(self) -> int:
        """How many hypotheses it has."""
        ...

    @property
    def mean_cm(self) -> float:
        """Mean C_m of its hypotheses, 0 without any."""
        ...

    def sense(self, tokens: Iterable[str]) -> Sensed:
        """Begin a cycle: sense, learn, drop the goals that are satisfied."""
        ...

    def choose(self, *, explore: bool = True) -> Choice | None:
        """The action to take now, `None` for nothing; without `explore` only towards a goal."""
        ...

    def perform(self, action: str | None) -> None:
        """End a cycle with the action really performed, `None` if there was none."""
        ...

    def set_goal(self, tokens: Iterable[str], priority: float, source: str = ...) -> Goal | None:
        """Put a Sign on the Goal List, or change the priority that `source` gives it.

        A goal that is active between `sense` and `perform` may be satisfied at once: then it is
        returned, and told in the next `Sensed.reached`.
        """
        ...

    def withdraw_goal(self, tokens: Iterable[str], source: str = ...) -> bool:
        """Take back what `source` set; False if it set no such goal."""
        ...

    def goal_priorities(self, tokens: Iterable[str]) -> Mapping[str, float]:
        """The priority that each source gives a Sign; empty if it is not on the list."""
        ...

    def policy_path(self) -> tuple[PolicyStep, ...]:
        """The way that it has in mind to the top-goal; empty without one."""
        ...

    def why(self) -> Why | None:
        """The reason for what it would choose; `None` without one."""
        ...

    def cost_to(self, goal: Iterable[str], start: Iterable[str] | None = None) -> float:
        """Estimated cost from here, or from the Sign `start`, to a Sign; infinite if not known."""
        ...

    def expected(self, action: str) -> Hypothesis | None:
        """The most credible hypothesis of what an action leads to here; `None` if not known."""
        ...


@runtime_checkable
class Averse(Protocol):
    """A controller that can avoid something. `DynamicExpectancyModel` is one."""

    def avert(self, tokens: Iterable[str], cost: float, source: str = ...) -> None:
        """Avoid a Sign: to make it active costs so much more."""
        ...

    def accept(self, tokens: Iterable[str], source: str = ...) -> bool:
        """Take back what `source` averted; False if it averted no such Sign."""
        ...


def change_aversions(
    controller: Controller, before: Mapping[Tokens, float], after: Mapping[Tokens, float]
) -> None:
    """Have a controller avoid what the mission says, if it can; it said `before` until now."""
    if not isinstance(controller, Averse):
        return
    for tokens in before:
        if tokens not in after:
            controller.accept(tokens, GoalSource.MISSION.value)
    for tokens, cost in after.items():
        if before.get(tokens) != cost:
            controller.avert(tokens, cost, GoalSource.MISSION.value)


@runtime_checkable
class Mapped(Protocol):
    """A controller that can show its whole policy map. `DynamicExpectancyModel` is one."""

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The top-goal's map, ordered by value, then Sign; empty without one."""
        ...


@runtime_checkable
class Shadowed(Protocol):
    """A controller whose lists the ground can hold too. `DynamicExpectancyModel` is one."""

    def record_changes(self) -> None:
        """From now on, record the changes of the lists."""
        ...

    def take_delta(self) -> Delta:
        """The changes of the lists since the last delta, or a whole."""
        ...

    def whole(self) -> Delta:
        """All lists as they are, in place of the next delta."""
        ...

    def lists_check(self) -> int:
        """CRC-32 of the lists."""
        ...
