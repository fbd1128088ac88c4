"""The rule of what is part of a situation, as plain as possible; see `plain`."""

from collections.abc import Hashable, Mapping

Cause = tuple[Hashable, str]
"""A Sign and an action."""


class Reproducible:
    """Which Tokens return when the same action follows the same Sign: κ for each of them."""

    def __init__(self) -> None:
        self.cycles = 0
        self.sensed: dict[str, int] = {}
        self.followed: dict[Cause, list[str]] = {}
        self.repetitions = 0
        self.then: dict[str, float] = {}
        self.now: dict[str, int] = {}
        self.both: dict[str, float] = {}
        self.random: set[str] = set()

    def note(self, tokens: set[str], trials: Mapping[Cause, int]) -> list[str]:
        """Take in a cycle, and return the Tokens that have just turned out to be random.

        `trials` are those of the last action in all Signs that were active then.
        """
        self.cycles += 1
        for token in tokens:
            self.sensed[token] = self.sensed.get(token, 0) + 1
        if not trials:
            return []
        weights = [(self.followed[c], 1 / n) for c, n in trials.items() if c in self.followed]
        total = 0.0
        for _, weight in weights:
            total += weight
        for before, weight in weights:
            for token in before:
                self.then[token] = self.then.get(token, 0.0) + weight / total
                if token in tokens:
                    self.both[token] = self.both.get(token, 0.0) + weight / total
        if weights:
            self.repetitions += 1
            for token in tokens:
                self.now[token] = self.now.get(token, 0) + 1
        self.followed |= dict.fromkeys(trials, sorted(tokens))
        return [token for token in sorted(tokens) if self.turns_random(token)]

    def turns_random(self, token: str) -> bool:
        """Judge a Token anew, once there are 64 cases of it."""
        n, was_random = self.repetitions, token in self.random
        a, b = self.then.get(token, 0.0), self.now.get(token, 0)
        both = self.both.get(token, 0.0)
        if a + b - both < 64:
            return False
        agreed = 1 - (a + b - 2 * both) / n
        chance = (a * b + (n - a) * (n - b)) / n**2
        if agreed - chance < 0.1 * (1 - chance):
            self.random.add(token)
        else:
            self.random.discard(token)
        return token in self.random and not was_random

    def situation(self, tokens: set[str]) -> tuple[str, ...]:
        """The Tokens that are not random, and were not sensed in every cycle so far."""
        varied = {token for token in tokens if self.sensed[token] < self.cycles}
        return tuple(sorted(varied - self.random))
