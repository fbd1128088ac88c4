"""How likely it is that a loss model loses as many frames as were seen, whatever its memory.

The losses of a Markov chain are neither independent nor, in few frames, normally distributed, and a
chain that changes its state seldom has not forgotten its first one. So nothing is assumed here but
the chain: by Chernoff's bound, the probability of a sum S of s or more is at most
min over θ ≥ 0 of E[exp(θ·S)]·exp(−θ·s), and the expectation is a product of matrices.
"""

import math
from collections.abc import Callable, Iterator
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.impairments import LossModel
from farside.link.profile.loss import LossChain
from farside.link.profile.statistics import Floats, transition_matrix

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_STEEPEST = 60.0
"""The greatest θ tried, with which even one loss too many is a chance of 10^-26."""

_GOLDEN = (math.sqrt(5) - 1) / 2
_ITERATIONS = 40

_Matrix = Callable[[float], Floats]
"""For each θ, the steps of a chain, each weighted with exp(θ · what it adds to the sum)."""


class _Run(NamedTuple):
    """Successive frames: whether they count, and how many they are."""

    counted: bool
    length: int


class LossLikelihood:
    """A loss model, and the frames handed over while it ran.

    Args:
        model: see `farside.link.profile.impairments`.
        other: probability that a frame spared by the model is lost nevertheless, independently.
        starts: for each frame handed over, in order, a number that changes where the model starts
            anew.
        counted: which of them count: those in which losses were looked for.
    """

    def __init__(self, model: LossModel, other: float, starts: Ints, counted: Bools) -> None:
        chain = LossChain.of(model)
        self._steps = transition_matrix(chain)
        self._lost = 1 - (1 - np.array(chain.losses)) * (1 - other)
        self._starts, self._counted = starts, counted

    def expected_share(self) -> float:
        """The mean share of counted frames that are lost, from the first state on."""
        mean = total = 0.0
        for runs in _runs(self._starts, self._counted):
            state = _first_state(len(self._lost))
            for run in runs:
                if run.counted:
                    mean += self._expected_in(state, run.length)
                    total += run.length
                state = state @ np.linalg.matrix_power(self._steps, run.length)
        return mean / total

    def chance(self, lost: float) -> float:
        """An upper bound of the probability of so many losses, or stranger, where frames count."""

        def losing(theta: float) -> Floats:
            weights: Floats = 1 - self._lost + self._lost * math.exp(theta)
            return self._steps * weights

        return _chance(lost, losing, len(self._lost), self._starts, self._counted)

    def repeat_chance(self, repeats: float, lost: float, share: float) -> float:
        """The same of so many losses right after another.

        Args:
            repeats: counted frames lost that come right after a counted one that was lost.
            lost: those that come right after a counted one that was lost.
            share: the share of these that the model is expected to lose.
        """
        states = len(self._lost)
        after_lost = np.tile([False, True], states)
        steps = np.repeat(np.repeat(self._steps, 2, axis=0), 2, axis=1)
        steps = steps * np.stack([1 - self._lost, self._lost], axis=1).ravel()

        def repeating(theta: float) -> Floats:
            gains = np.where(after_lost, 1 - share, -share)
            weights = np.exp(theta * np.outer(after_lost, gains))
            found: Floats = steps * weights
            return found

        pairs = self._counted.copy()
        pairs[1:] &= self._counted[:-1] & (self._starts[1:] == self._starts[:-1])
        pairs[:1] = False
        excess = repeats - lost * share
        return _chance(excess, repeating, 2 * states, self._starts, pairs)

    def _expected_in(self, state: Floats, length: int) -> float:
        """The sum of the probabilities of loss in the next `length` steps from `state` on."""
        states = len(state)
        # [P, P·l; 0, 1] to the n-th power holds the sum over k ≤ n of P^k·l.
        block = np.eye(states + 1)
        block[:-1, :-1] = self._steps
        block[:-1, -1] = self._steps @ self._lost
        return float(state @ np.linalg.matrix_power(block, length)[:-1, -1])


def _first_state(states: int) -> Floats:
    state = np.zeros(states)
    state[0] = 1.0
    return state


def _runs(starts: Ints, counted: Bools) -> Iterator[list[_Run]]:
    """For each start of the model after which frames count, the runs up to the last of these."""
    pairs = zip(starts.tolist(), counted.tolist(), strict=True)
    for _, frames in groupby(pairs, key=lambda one: one[0]):
        runs = [
            _Run(count, sum(1 for _ in group))
            for count, group in groupby(flag for _, flag in frames)
        ]
        while runs and not runs[-1].counted:
            runs.pop()
        if runs:
            yield runs


def _chance(total: float, weighted: _Matrix, states: int, starts: Ints, counted: Bools) -> float:
    """Twice the lesser bound of the probabilities of `total` or more, and of `total` or less."""
    runs = list(_runs(starts, counted))

    def log_bound(theta: float) -> float:
        plain, counting = _Powers(weighted(0.0)), _Powers(weighted(theta))
        found = -theta * total
        for each in runs:
            state = _first_state(states)
            for run in each:
                state, log = (counting if run.counted else plain).applied(state, run.length)
                found += log
        return found

    least = min(_least(log_bound, 0.0, _STEEPEST), _least(log_bound, -_STEEPEST, 0.0))
    return min(1.0, 2 * math.exp(min(0.0, least)))


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """The minimum of a convex function, by golden section; ends included."""
    found = min(function(low), function(high))
    inner, outer = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_inner, at_outer = function(inner), function(outer)
    for _ in range(_ITERATIONS):
        found = min(found, at_inner, at_outer)
        if at_inner < at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - _GOLDEN * (high - low)
            at_inner = function(inner)
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + _GOLDEN * (high - low)
            at_outer = function(outer)
    return found


class _Powers:
    """The powers of a matrix, scaled so that neither great nor small ones overflow."""

    def __init__(self, matrix: Floats) -> None:
        scale = float(matrix.max())
        self._squares = [(matrix / scale, math.log(scale))]

    def applied(self, state: Floats, exponent: int) -> tuple[Floats, float]:
        """`state` times the power, scaled to a sum of 1, and the logarithm of that sum."""
        log, bit = 0.0, 0
        while exponent >> bit:
            if bit == len(self._squares):
                matrix, before = self._squares[-1]
                square = matrix @ matrix
                scale = float(square.max())
                self._squares.append((square / scale, 2 * before + math.log(scale)))
            if exponent >> bit & 1:
                matrix, scaled = self._squares[bit]
                state = state @ matrix
                total = float(state.sum())
                state = state / total
                log += scaled + math.log(total)
            bit += 1
        return state, log
