"""Differentiation: a hypothesis that is right now and then looks for what tells when.

A mature hypothesis of middling success is watched: for each Token that is sensed beside its
context, how often it then came true with the Token and without. When the watch is over, the Token
that told success from failure best, if it did so clearly and not by chance, is added to the context
of a copy. Source: seed for the copy; the watch and its thresholds are project defaults.
"""

import math
from collections.abc import Sequence

import msgspec

_MIDDLING = 0.08, 0.92
_TELLING = 0.5
_BEYOND_CHANCE = 10.83  # χ² with one degree of freedom: one case in a thousand
_WATCHES = 4


def beyond_chance(successes: int, cases: int, other_successes: int, other_cases: int) -> float:
    """How little two shares of success look like one: the G statistic of a 2 × 2 table.

    G = 2 Σ O·ln(O/E) over the four counts O, with E what they would be if the shares were the same.
    Source: Sokal and Rohlf, Biometry, ch. 17.
    """
    total = cases + other_cases
    won = successes + other_successes
    table = [
        (successes, cases * won),
        (cases - successes, cases * (total - won)),
        (other_successes, other_cases * won),
        (other_cases - other_successes, other_cases * (total - won)),
    ]
    return 2.0 * sum(
        observed * math.log(observed * total / expected) for observed, expected in table if observed
    )


class WatchState(msgspec.Struct, frozen=True, array_like=True):
    """A watch as it is saved: counts in all, and (Token's Sign, successes, cases) by Token."""

    hypothesis: int
    cases: int
    successes: int
    beside: tuple[tuple[int, int, int], ...]


class DifferentiationState(msgspec.Struct, frozen=True, array_like=True):
    """`Differentiation` as it is saved: watches, and (hypothesis, watches begun so far)."""

    watches: tuple[WatchState, ...]
    watched: tuple[tuple[int, int], ...]


class _Watch:
    """Successes and cases of one hypothesis, in all and by Token."""

    def __init__(self) -> None:
        self.cases = 0
        self.successes = 0
        self.beside: dict[int, tuple[int, int]] = {}

    def note(self, beside: Sequence[int], *, success: bool) -> None:
        self.cases += 1
        self.successes += success
        for token in beside:
            successes, cases = self.beside.get(token, (0, 0))
            self.beside[token] = successes + success, cases + 1

    def telling(self) -> int | None:
        """The Sign of the Token that told success from failure best, if one did clearly."""
        best, best_margin = None, _TELLING
        for token, (successes, cases) in self.beside.items():
            others = self.cases - cases
            if not others:
                continue
            # P(success | Token) − P(success | no Token)
            other_successes = self.successes - successes
            margin = successes / cases - other_successes / others
            if margin > best_margin and (
                beyond_chance(successes, cases, other_successes, others) > _BEYOND_CHANCE
            ):
                best, best_margin = token, margin
        return best


class Differentiation:
    """Watches over mature hypotheses of middling success.

    Args:
        maturity: predictions before a watch may begin, and length of a watch.
    """

    def __init__(self, maturity: int) -> None:
        self._maturity = maturity
        self._watches: dict[int, _Watch] = {}
        self._watched: dict[int, int] = {}

    def note(
        self,
        hypothesis: int,
        predictions: int,
        successes: int,
        beside: Sequence[int],
        *,
        success: bool,
    ) -> int | None:
        """A prediction of `hypothesis` was judged.

        Args:
            hypothesis: its id.
            predictions: how often it was judged, this time included.
            successes: how often it came true, this time included.
            beside: the Signs of single Tokens that were active with its context, but are not part
                of it.
            success: whether it came true.

        Returns:
            the Sign of a Token to add to the context of a copy, if the watch ended with one.
        """
        watch = self._watches.get(hypothesis)
        if watch is None:
            if predictions % self._maturity == 0:
                self._consider(hypothesis, successes / predictions)
            return None
        watch.note(beside, success=success)
        if watch.cases < self._maturity:
            return None
        del self._watches[hypothesis]
        return watch.telling()

    def forget(self, hypothesis: int) -> None:
        """The hypothesis is no more."""
        self._watches.pop(hypothesis, None)
        self._watched.pop(hypothesis, None)

    def state(self) -> DifferentiationState:
        """Everything that `restore` needs."""
        return DifferentiationState(
            watches=tuple(
                WatchState(
                    hypothesis,
                    watch.cases,
                    watch.successes,
                    tuple((token, *counts) for token, counts in watch.beside.items()),
                )
                for hypothesis, watch in self._watches.items()
            ),
            watched=tuple(self._watched.items()),
        )

    def restore(self, state: DifferentiationState) -> None:
        """Become what `state` was taken of. This one is new."""
        for saved in state.watches:
            watch = self._watches[saved.hypothesis] = _Watch()
            watch.cases, watch.successes = saved.cases, saved.successes
            for token, successes, cases in saved.beside:
                watch.beside[token] = successes, cases
        self._watched.update(state.watched)

    def _consider(self, hypothesis: int, success_rate: float) -> None:
        low, high = _MIDDLING
        if low < success_rate < high and self._watched.get(hypothesis, 0) < _WATCHES:
            self._watched[hypothesis] = self._watched.get(hypothesis, 0) + 1
            self._watches[hypothesis] = _Watch()
