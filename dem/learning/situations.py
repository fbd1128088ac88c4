"""Situations: all that tells where the robot is, as one Sign.

A *situation* is the conjunction of the Tokens sensed in a cycle, without two kinds of them:

- those that were sensed in every cycle so far: they tell nothing apart;
- *random* ones: what comes and goes by chance would make every situation new. A Token is random if
  it is not *reproducible*: when an action follows a context again, the Token is there, or not, as
  it was the last time, hardly more often than by chance.

How reproducible a Token is, Cohen's κ tells: with p_o the fraction of repetitions that agreed, and
p_e the fraction that would agree by chance, κ = (p_o − p_e) / (1 − p_e); 1 if all agreed, 0 for
chance. In each cycle all contexts of the action before that are remembered are asked, those with
fewer trials of it counting for more. Source: Cohen (1960), A Coefficient of Agreement for Nominal
Scales; the use of it, and all numbers, are project defaults.
"""

from array import array
from collections.abc import Sequence

import msgspec

from farside.dem.lists.packing import packed, unpack_into

RANDOM = 0.1
"""The κ below which a Token is random. Noise has 0 on average, what eight neighbouring cells look
like in a maze from .2 to 1."""

CASES = 64
"""The number of repetitions with a Token, then or now, before it can be called random."""

REMEMBERED = 4096
"""How many contexts and actions are remembered with what followed; the last ones are."""


class SituationsState(msgspec.Struct, frozen=True, array_like=True):
    """`Situations` as it is saved: `packed` columns by Sign, and what followed what.

    Attributes:
        columns: sensed, then, now, both and random.
        followed: (context, action, Tokens), oldest first, all by id.
        cycles: number of cycles.
        repetitions: number of repetitions.
    """

    columns: tuple[bytes, ...]
    followed: tuple[tuple[int, int, tuple[int, ...]], ...]
    cycles: int
    repetitions: float


class Situations:
    """Which Tokens belong to a situation, by what followed the same action in the same context.

    Contexts and Tokens are ids of Signs.
    """

    def __init__(self) -> None:
        self._followed: dict[tuple[int, int], Sequence[int]] = {}
        self._cycles = 0
        self._repetitions = 0.0
        # By Sign: cycles in which it was sensed, and repetitions with it: the last time, now, both.
        self._sensed = array("q")
        self._then = array("d")
        self._now = array("d")
        self._both = array("d")
        self._random = array("b")

    def note(
        self, contexts: Sequence[int], trials: Sequence[int], action: int | None, tokens: list[int]
    ) -> list[int]:
        """Take in what is sensed in a cycle.

        Args:
            contexts: the Signs that were active in the last cycle.
            trials: number of trials of the action in each of them, the last one included.
            action: the action performed then, if any.
            tokens: what is sensed now.

        Returns:
            those Tokens that have now turned out to be random.
        """
        self._cycles += 1
        if tokens:
            self._extend(max(tokens))
        for token in tokens:
            self._sensed[token] += 1
        if action is None:
            return []
        self._compare(contexts, trials, action, tokens)
        for context in contexts:
            self._followed.pop((context, action), None)
            self._followed[context, action] = tokens
        while len(self._followed) > REMEMBERED:
            del self._followed[next(iter(self._followed))]
        return [token for token in tokens if self._turns_random(token)]

    def tell(self, tokens: Sequence[int]) -> list[int]:
        """Those of the Tokens sensed in this cycle that belong to the situation."""
        return [
            token
            for token in tokens
            if self._sensed[token] < self._cycles and not self._random[token]
        ]

    def is_random(self, token: int) -> bool:
        """Whether a Token is random."""
        return token < len(self._random) and bool(self._random[token])

    def forget(self, sign: int, actions: int) -> None:
        """Drop a Sign that is being removed; `actions` is how many there are."""
        for action in range(actions):
            self._followed.pop((sign, action), None)

    def state(self) -> SituationsState:
        """Everything that `restore` needs."""
        return SituationsState(
            columns=tuple(packed(column) for column in self._columns()),
            followed=tuple((*cause, tuple(tokens)) for cause, tokens in self._followed.items()),
            cycles=self._cycles,
            repetitions=self._repetitions,
        )

    def restore(self, state: SituationsState) -> None:
        """Become what `state` was taken from. This one must be new."""
        for column, data in zip(self._columns(), state.columns, strict=True):
            unpack_into(column, data)
        for context, action, tokens in state.followed:
            self._followed[context, action] = tokens
        self._cycles, self._repetitions = state.cycles, state.repetitions

    def _columns(self) -> "tuple[array[int] | array[float], ...]":
        return self._sensed, self._then, self._now, self._both, self._random

    def _extend(self, sign: int) -> None:
        missing = sign + 1 - len(self._sensed)
        if missing > 0:
            for column in self._columns():
                column.extend([0] * missing)

    def _compare(
        self, contexts: Sequence[int], trials: Sequence[int], action: int, tokens: Sequence[int]
    ) -> None:
        """Count one repetition, shared among the contexts by one over their trials."""
        followed = self._followed
        repeated = [
            (followed[context, action], 1.0 / tried)
            for context, tried in zip(contexts, trials, strict=True)
            if (context, action) in followed
        ]
        if not repeated:
            return
        self._repetitions += 1.0
        for token in tokens:
            self._now[token] += 1.0
        total, here = sum(weight for _, weight in repeated), set(tokens)
        for before, weight in repeated:
            share = weight / total
            for token in before:
                self._then[token] += share
                if token in here:
                    self._both[token] += share

    def _turns_random(self, token: int) -> bool:
        """Find out anew whether a Token is random; whether that is new."""
        then, now, both = self._then[token], self._now[token], self._both[token]
        if then + now - both < CASES:
            return False
        was, every = self._random[token], self._repetitions
        agreed = 1.0 - (then + now - 2.0 * both) / every
        chance = (then * now + (every - then) * (every - now)) / every**2
        self._random[token] = agreed - chance < RANDOM * (1.0 - chance)
        return bool(self._random[token]) and not was
