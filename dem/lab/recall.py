"""Memory Tokens: what was sensed and done before, for worlds where places look alike."""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from farside.dem.lab.worlds import Situation, World


class _Step(NamedTuple):
    tokens: tuple[str, ...]
    action: str


class Recall:
    """Remembers the last steps, and tells them as one Token.

    The Token is `was:TOKENS|did:ACTION`, with the Tokens sensed before the action sorted and
    separated by spaces, and so on for every step, the latest first. It makes no part of what is
    remembered itself.

    Args:
        steps: how many steps it goes back, 1 or more.

    Raises:
        ValueError: if `steps` is less than 1.
    """

    def __init__(self, steps: int = 1) -> None:
        if steps < 1:
            raise ValueError(f"steps: expected 1 or more, found {steps}")
        self._steps: deque[_Step] = deque(maxlen=steps)

    def did(self, tokens: Iterable[str], action: str) -> None:
        """An action was performed where these Tokens were sensed."""
        self._steps.appendleft(_Step(tuple(sorted(set(tokens))), action))

    def forget(self) -> None:
        """Nothing that comes follows from what was."""
        self._steps.clear()

    @property
    def tokens(self) -> list[str]:
        """The memory Token; none before the first step."""
        if not self._steps:
            return []
        return ["|".join(f"was:{' '.join(step.tokens)}|did:{step.action}" for step in self._steps)]


class _Remembering:
    """A world with a memory Token; see `memory`."""

    def __init__(self, world: World, steps: int) -> None:
        self._world, self._recall = world, Recall(steps)
        self._sensed: tuple[str, ...] = ()

    @property
    def action_costs(self) -> Mapping[str, float]:
        return self._world.action_costs

    def begin(self, seed: int | None) -> Situation:
        self._recall.forget()
        return self._with_memory(self._world.begin(seed))

    def act(self, action: str) -> Situation:
        self._recall.did(self._sensed, action)
        return self._with_memory(self._world.act(action))

    def _with_memory(self, now: Situation) -> Situation:
        self._sensed = tuple(now.tokens)
        return now._replace(tokens=[*self._sensed, *self._recall.tokens])


def memory(world: World, steps: int = 1) -> World:
    """A world in which what was sensed and done before is sensed too, as one Token; see `Recall`.

    For worlds where several places look alike and only the way to them tells them apart. The memory
    begins anew with every episode.

    Args:
        world: the world.
        steps: how many steps the memory goes back, 1 or more.

    Raises:
        ValueError: if `steps` is less than 1.
    """
    return _Remembering(world, steps)
