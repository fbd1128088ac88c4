"""A controller of one's own: it remembers where every move led, and goes the shortest way."""

from collections import deque
from collections.abc import Callable, Mapping

from numpy.random import Generator

from farside.dem import Choice, Sign
from farside.rover import PlainController


class Pathfinder(PlainController):
    """Goes to the first goal that it knows a way to; without one it tries what it never tried."""

    def __init__(
        self, action_costs: Mapping[str, float], *, rng: Generator, explores: bool = True
    ) -> None:
        super().__init__(action_costs, rng=rng)
        self._explores = explores
        self._led: dict[Sign, dict[str, Sign]] = {}

    def learn(self, before: Sign, action: str, after: Sign) -> None:
        """Remember where an action led, whoever chose it."""
        self._led.setdefault(before, {})[action] = after

    def choose(self, *, explore: bool = True) -> Choice | None:
        """The first move of the shortest way, or one that was never tried."""
        for goal in self.goals:
            action = self._way(set(goal.tokens).issubset)
            if action is not None:
                return Choice(action, goal=goal.tokens)
        if not (self.goals and explore and self._explores):
            return None
        if untried := self._untried(self.tokens):
            return Choice(untried[self.rng.integers(len(untried))])
        action = self._way(lambda here: bool(self._untried(here)))
        return None if action is None else Choice(action)

    def _untried(self, here: Sign) -> list[str]:
        return [action for action in self.actions if action not in self._led.get(here, {})]

    def _way(self, is_there: Callable[[Sign], bool]) -> str | None:
        """The first move of the shortest way that it remembers."""
        ways = deque(self._led.get(self.tokens, {}).items())
        seen = {self.tokens}
        while ways:
            first, here = ways.popleft()
            if is_there(here):
                return first
            if here not in seen:
                seen.add(here)
                ways.extend((first, after) for after in self._led.get(here, {}).values())
        return None
