"""A controller to derive one's own from: it keeps the goals and leaves the choice to its user."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping

from numpy.random import Generator

from farside.dem import Choice, Goal, Hypothesis, Parameters, PolicyStep, Sensed, Sign, Why
from farside.dem.lists.goals import OPERATOR, GoalList
from farside.dem.lists.signs import to_sign


class PlainController(ABC):
    """A `Controller` that keeps the Goal List and the order of the cycle, and knows no way.

    A class of one's own says in `choose` what to do. In `learn` it is told what every action led
    to, whoever chose it. It may say more: the way that it has in mind (`policy_path`), and what
    ways cost (`cost_to`), without which nothing is refused for want of charge.

    Args:
        action_costs: cost of each action, above 0, all in the same unit.
        rng: the only source of randomness, a stream of the run's own.

    Attributes:
        action_costs: as given.
        actions: the names of the actions, in order.
        rng: as given.
        tokens: what was last sensed, sorted.

    Raises:
        ValueError: if there is no action.
    """

    def __init__(self, action_costs: Mapping[str, float], *, rng: Generator) -> None:
        if not action_costs:
            raise ValueError("expected one action at least, found none")
        self.action_costs = dict(action_costs)
        self.actions = tuple(action_costs)
        self.rng = rng
        self.tokens: Sign = ()
        self._goals = GoalList(Parameters(put_aside=False, break_point=False))
        self._known: set[str] = set()
        self._performed: str | None = None
        self._is_open = False

    # --- what a class of one's own says --------------------------------------------------------

    @abstractmethod
    def choose(self, *, explore: bool = True) -> Choice | None:
        """The action to take now, and the goal that it serves; `None` for nothing.

        Args:
            explore: whether an action that serves no goal, a `Choice` without one, may be chosen.
                There is none at all while there are no goals.
        """

    def learn(self, before: Sign, action: str, after: Sign) -> None:  # noqa: B027 - a hook
        """Told of every action performed, whoever chose it, and what was sensed before and after.

        Does nothing of itself.
        """

    # --- the cycle -----------------------------------------------------------------------------

    def sense(self, tokens: Iterable[str]) -> Sensed:
        """Begin a cycle: learn from the action that ended the last one, drop goals satisfied.

        The Signs that it knows are single Tokens.

        Raises:
            RuntimeError: if `perform` has not ended the last cycle.
            TypeError: if `tokens` is a string.
        """
        if self._is_open:
            raise RuntimeError("sense() twice in one cycle: end the cycle with perform(action)")
        self._is_open = True
        before, self.tokens = self.tokens, to_sign(tokens)
        novel = [token for token in self.tokens if token not in self._known]
        self._known.update(novel)
        action, self._performed = self._performed, None
        if action is not None:
            self.learn(before, action, self.tokens)
        return Sensed(
            tokens=self.tokens,
            active=tuple((token,) for token in self.tokens),
            novel=tuple((token,) for token in novel),
            unexpected=(),
            succeeded=0,
            failed=0,
            created=0,
            removed=0,
            reached=self._goals.take_satisfied(self.tokens),
            suspended=(),
            recovered=(),
        )

    def perform(self, action: str | None) -> None:
        """End a cycle with the action really performed, `None` if there was none.

        Raises:
            RuntimeError: if `sense` was not called since the last `perform`.
            ValueError: if the action is unknown.
        """
        if not self._is_open:
            raise RuntimeError("perform() before sense(): a cycle is sense, choose, perform")
        if action is not None and action not in self.action_costs:
            known = ", ".join(self.actions)
            raise ValueError(f"expected one of the actions {known}, found {action!r}")
        self._is_open = False
        self._performed = action

    # --- goals ---------------------------------------------------------------------------------

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List, the top-goal first, ties to the older."""
        return self._goals.ordered

    def set_goal(
        self, tokens: Iterable[str], priority: float, source: str = OPERATOR
    ) -> Goal | None:
        """Put a Sign on the Goal List, or change the priority that `source` gives it.

        Between `sense` and `perform`, a goal that is active is satisfied at once: it never comes on
        the list, is returned, and told in the next `Sensed.reached`.

        Raises:
            ValueError: if there are no Tokens, or `priority` is not finite.
            TypeError: if `tokens` is a string.
        """
        sign = to_sign(tokens)
        is_active = self._is_open and set(sign).issubset(self.tokens)
        return self._goals.set(sign, priority, source, is_active=is_active)

    def withdraw_goal(self, tokens: Iterable[str], source: str = OPERATOR) -> bool:
        """Take back what `source` set; False if it set no such goal."""
        return self._goals.withdraw(to_sign(tokens), source)

    def goal_priorities(self, tokens: Iterable[str]) -> Mapping[str, float]:
        """The priority that each source gives a Sign; empty if it is not on the Goal List."""
        return self._goals.priorities(to_sign(tokens))

    # --- what it knows: nothing, unless a class of one's own says more -------------------------

    @property
    def sign_count(self) -> int:
        """How many Tokens it has sensed."""
        return len(self._known)

    @property
    def hypothesis_count(self) -> int:
        """0: it has none."""
        return 0

    @property
    def mean_cm(self) -> float:
        """0: it has no hypotheses."""
        return 0.0

    def policy_path(self) -> tuple[PolicyStep, ...]:
        """The way that it has in mind to the top-goal: none that it tells."""
        return ()

    def why(self) -> Why | None:
        """The hypothesis behind its choice: none."""
        return None

    def cost_to(self, goal: Iterable[str], start: Iterable[str] | None = None) -> float:
        """Estimated cost to a Sign: 0 if it is active, or `start` implies it; else not known.

        Raises:
            ValueError: if `goal` has no Tokens.
            TypeError: if `goal` or `start` is a string.
        """
        wanted = to_sign(goal)
        if not wanted:
            raise ValueError("expected one Token at least, found none")
        begin = self.tokens if start is None else to_sign(start)
        return 0.0 if set(wanted).issubset(begin) else math.inf

    def expected(self, action: str) -> Hypothesis | None:  # noqa: ARG002 - the protocol has it
        """The most credible hypothesis of what an action leads to here: none."""
        return None
