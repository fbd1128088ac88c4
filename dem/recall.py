"""Memory Tokens: what was sensed and done before, for worlds where places look alike."""

from collections import deque
from collections.abc import Iterable

from farside.dem.lists.signs import Sign, to_sign


class Recall:
    """Remembers the last steps, and tells them as one Token.

    The Token is `was:TOKENS|did:ACTION`, with the Tokens sensed before the action sorted and
    separated by spaces, and so on for every step, the latest first. An action after which the same
    is sensed as before, such as a push against a wall, is no step: it would take the place of what
    tells where one is.

    Args:
        steps: how many steps it goes back; with 0 there is no such Token.

    Raises:
        ValueError: if `steps` is negative.
    """

    def __init__(self, steps: int = 1) -> None:
        if steps < 0:
            raise ValueError(f"steps: expected 0 or more, found {steps}")
        self._steps: deque[str] = deque(maxlen=steps)
        self._sensed: Sign = ()
        self._action: str | None = None

    def sense(self, tokens: Iterable[str]) -> None:
        """Something is sensed, without the memory Token.

        Raises:
            TypeError: if `tokens` is a string.
        """
        sensed = to_sign(tokens)
        if self._action is not None and sensed != self._sensed:
            self._steps.appendleft(f"was:{' '.join(self._sensed)}|did:{self._action}")
        self._sensed, self._action = sensed, None

    def did(self, action: str) -> None:
        """An action is performed after what was sensed last."""
        self._action = action

    def forget(self) -> None:
        """Nothing that comes follows from what was."""
        self._steps.clear()
        self._action = None

    @property
    def tokens(self) -> list[str]:
        """The memory Token to sense beside what was sensed last; none before the first step."""
        return ["|".join(self._steps)] if self._steps else []
