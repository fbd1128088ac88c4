"""Differentiation: a partly effective hypothesis gets a copy with a more specific context.

A mature hypothesis with a middling success rate is watched: for each Token that is sensed beside
its context, successes are counted with and without the Token. At the end of the watch, the Token
that best separates success from failure, if clearly and not by chance, is added to the context of
a copy. Source: seed for the copy; the watch and its thresholds are project defaults.
"""

import math
from collections.abc import Sequence

import msgspec

_MIDDLING = 0.08, 0.92  # success rates between which a hypothesis is watched
_LEAST_MARGIN = 0.5  # between the success rates with and without a Token
_CRITICAL_G = 10.83  # χ² with one degree of freedom, p = 0.001

WATCHES = 4
"""The most watches of one hypothesis."""


def g_statistic(successes: int, cases: int, other_successes: int, other_cases: int) -> float:
    """The G statistic of two success rates, as a 2 × 2 table; large if they really differ.

    G = 2 Σ O·ln(O/E) over the four counts O, with E their expected values if the rates were equal.
    Source: Sokal and Rohlf, Biometry, ch. 17.
    """
    total = cases + other_cases
    all_successes = successes + other_successes
    table = [
        (successes, cases * all_successes),
        (cases - successes, cases * (total - all_successes)),
        (other_successes, other_cases * all_successes),
        (other_cases - other_successes, other_cases * (total - all_successes)),
    ]
    return 2.0 * sum(
        observed * math.log(observed * total / expected) for observed, expected in table if observed
    )


class WatchState(msgspec.Struct, frozen=True, array_like=True):
    """A watch as it is saved: total counts, and (Sign of the Token, successes, cases) by Token."""

    hypothesis: int
    cases: int
    successes: int
    beside: tuple[tuple[int, int, int], ...]


class DifferentiationState(msgspec.Struct, frozen=True, array_like=True):
    """`Differentiation` as it is saved: watches, and (hypothesis, number of watches begun)."""

    watches: tuple[WatchState, ...]
    watched: tuple[tuple[int, int], ...]


class _Watch:
    """Successes and cases of one hypothesis, in total and by Token."""

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

    def separating(self) -> int | None:
        """The Sign of the Token that best separates success from failure, if any does clearly."""
        best, best_margin = None, _LEAST_MARGIN
        for token, (successes, cases) in self.beside.items():
            others = self.cases - cases
            if not others:
                continue
            # P(success | Token) − P(success | no Token)
            other_successes = self.successes - successes
            margin = successes / cases - other_successes / others
            if margin > best_margin and (
                g_statistic(successes, cases, other_successes, others) > _CRITICAL_G
            ):
                best, best_margin = token, margin
        return best


class Differentiation:
    """Watches mature hypotheses with a middling success rate.

    Args:
        maturity: number of predictions before a watch may begin, and length of a watch.
    """

    def __init__(self, maturity: int) -> None:
        self._maturity = maturity
        self._watches: dict[int, _Watch] = {}
        self._watched: dict[int, int] = {}

    def change(self, maturity: int) -> None:
        """Watch by another maturity from now on; a watch that lasted so long already is void."""
        self._maturity = maturity
        self._watches = {
            one: watch for one, watch in self._watches.items() if watch.cases < maturity
        }

    def note(
        self,
        hypothesis: int,
        predictions: int,
        successes: int,
        beside: Sequence[int],
        *,
        success: bool,
    ) -> int | None:
        """Take in the result of a prediction.

        Args:
            hypothesis: id of the hypothesis that predicted.
            predictions: number of its predictions that have fallen due, this one included.
            successes: number of these that came true.
            beside: the Signs of single Tokens that were active beside its context; asked for only
                while it is watched.
            success: whether this prediction came true.

        Returns:
            the Sign of a Token to add to the context of a copy, if a watch ended with one.
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
        return watch.separating()

    def is_watching(self, hypothesis: int) -> bool:
        """Whether the next result of a hypothesis counts with the Tokens beside its context."""
        return hypothesis in self._watches

    def forget(self, hypothesis: int) -> None:
        """Drop a hypothesis that is being removed."""
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
        """Become what `state` was taken from. This one must be new."""
        for saved in state.watches:
            watch = self._watches[saved.hypothesis] = _Watch()
            watch.cases, watch.successes = saved.cases, saved.successes
            for token, successes, cases in saved.beside:
                watch.beside[token] = successes, cases
        self._watched.update(state.watched)

    def _consider(self, hypothesis: int, success_rate: float) -> None:
        low, high = _MIDDLING
        if low < success_rate < high and self._watched.get(hypothesis, 0) < WATCHES:
            self._watched[hypothesis] = self._watched.get(hypothesis, 0) + 1
            self._watches[hypothesis] = _Watch()
