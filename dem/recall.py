"""Memory Tokens: what was sensed and done before, for worlds where places look alike."""

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple


class _Step(NamedTuple):
    tokens: tuple[str, ...]
    action: str


class Recall:
    """Remembers the last steps, and tells them as one Token.

    The Token is `was:TOKENS|did:ACTION`, with the Tokens sensed before the action sorted and
    separated by spaces, and so on for every step, the latest first.

    Args:
        steps: how many steps it goes back; with 0 there is no such Token.

    Raises:
        ValueError: if `steps` is negative.
    """

    def __init__(self, steps: int = 1) -> None:
        if steps < 0:
            raise ValueError(f"steps: expected 0 or more, found {steps}")
        self._steps: deque[_Step] = deque(maxlen=steps)

    def did(self, tokens: Iterable[str], action: str) -> None:
        """An action was performed where these Tokens were sensed, without the memory Token."""
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
