"""Long-run statistics of loss models and jitter."""

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.impairments import Jitter, JitterShape, LossModel
from farside.link.profile.jitter import table_ns
from farside.link.profile.loss import LossChain
from farside.node import NS_PER_S

Floats = NDArray[np.float64]

_MOST_SCORE, _SCORES = 8.0, 20_001
_NEVER = 1e-18
"""A transition that is less probable than this happens in no run."""


class LossStatistics(NamedTuple):
    """A loss model in the long run.

    Attributes:
        rate: share of frames lost.
        burst_length: mean number of frames lost in a row; infinite if a burst never ends, NaN if
            nothing is ever lost.
        clustering: how many frames carry as much information about the rate as one independent
            trial, 1 or more.
    """

    rate: float
    burst_length: float
    clustering: float


def loss_statistics(model: LossModel, other: float = 0.0) -> LossStatistics:
    """Statistics of `model`, where each frame may also be lost independently to something else.

    A burst begins where a lost frame follows one that was not lost, so the mean burst length is the
    loss rate over the rate of such pairs.

    Args:
        model: see `farside.link.profile.impairments`.
        other: probability that a frame spared by the model is lost nevertheless.
    """
    chain = LossChain.of(model)
    lasting = _lasting(chain)
    transitions = transition_matrix(chain)[np.ix_(lasting, lasting)]
    lost = (1 - (1 - np.array(chain.losses)) * (1 - other))[lasting]
    share = _stationary(transitions)
    rate = min(1.0, float(share @ lost))
    begins = float((share * (1 - lost)) @ transitions @ lost)
    if not 0 < rate < 1:
        return LossStatistics(rate, math.inf if rate else math.nan, 1.0)
    # A burst lasts at least one frame; where it begins less than once in 10^12 frames, for ever.
    burst_length = max(1.0, rate / begins) if begins > 1e-12 else math.inf
    return LossStatistics(rate, burst_length, _clustering(transitions, share, lost))


def _lasting(chain: LossChain) -> list[int]:
    """The states that the chain is in again and again, if it starts in its first one."""

    def reached(first: int) -> set[int]:
        found, left = {first}, [first]
        while left:
            exits = chain.exits[left.pop()]
            new = {state for chance, state in exits if chance > _NEVER} - found
            found |= new
            left += new
        return found

    # Each model of ours has one set of states that is not left again.
    return sorted(set.intersection(*(reached(state) for state in reached(0))))


def _stationary(transitions: Floats) -> Floats:
    """The share of steps after which an irreducible chain is in each state.

    By elimination without subtraction, so that the least probabilities count: Grassmann, Taksar and
    Heyman (1985).
    """
    left = transitions.copy()
    states = len(left)
    for state in reversed(range(1, states)):
        left[:state, state] /= left[state, :state].sum()
        left[:state, :state] += np.outer(left[:state, state], left[state, :state])
    share = np.ones(states)
    for state in range(1, states):
        share[state] = share[:state] @ left[:state, state]
    found: Floats = share / share.sum()
    return found


def _clustering(transitions: Floats, share: Floats, lost: Floats) -> float:
    """How many frames count as one independent trial; infinitely many if states hardly change."""
    rate = float(share @ lost)
    # Sum of the covariances between the loss of a frame and that of every later frame.
    deviation = transitions - share
    try:
        later = np.linalg.solve(np.eye(len(share)) - deviation, deviation @ lost)
    except np.linalg.LinAlgError:
        return math.inf
    clustering = 1 + 2 * float((share * lost) @ later) / (rate * (1 - rate))
    return max(1.0, clustering) if math.isfinite(clustering) else math.inf


def transition_matrix(chain: LossChain) -> Floats:
    """Probability of going from each state (row) to each state (column)."""
    matrix = np.zeros((len(chain.exits), len(chain.exits)))
    for state, exits in enumerate(chain.exits):
        staying = 1.0
        for probability, following in exits:
            matrix[state, following] = probability
            staying -= probability
        matrix[state, state] = max(0.0, staying)
    return matrix


def jitter_cdf(jitter: Jitter, delay_s: Floats) -> Floats:
    """Probability that the jitter does not exceed `delay_s`."""
    match jitter.shape:
        case JitterShape.UNIFORM:
            return np.clip(delay_s / jitter.spread_s, 0.0, 1.0)
        case JitterShape.EXPONENTIAL:
            return -np.expm1(-np.maximum(delay_s, 0.0) / jitter.spread_s)
        case JitterShape.TABLE:
            return _share_of_table(jitter, delay_s, "right")
    below = _deviation_cdf(jitter.shape, (delay_s - jitter.mean_s) / jitter.spread_s)
    return np.where(delay_s < 0, 0.0, below)


def jitter_below(jitter: Jitter, delay_s: Floats) -> Floats:
    """Probability that the jitter is less than `delay_s`."""
    if jitter.shape is JitterShape.TABLE:
        return _share_of_table(jitter, delay_s, "left")
    return np.where(delay_s > 0, jitter_cdf(jitter, delay_s), 0.0)


def jitter_quantile(jitter: Jitter, probability: Floats) -> Floats:
    """The jitter in seconds that is not exceeded with this probability, 0 up to but not 1."""
    match jitter.shape:
        case JitterShape.UNIFORM:
            return probability * jitter.spread_s
        case JitterShape.EXPONENTIAL:
            return -np.log1p(-probability) * jitter.spread_s
        case JitterShape.TABLE:
            delays_s: Floats = np.array(table_ns(jitter)) / NS_PER_S
            found: Floats = delays_s[(probability * len(delays_s)).astype(int)]
            return found
    deviations = _deviation_quantile(jitter.shape, probability)
    return np.maximum(0.0, jitter.mean_s + jitter.spread_s * deviations)


def _share_of_table(jitter: Jitter, delay_s: Floats, side: Literal["left", "right"]) -> Floats:
    delays_ns = np.array(table_ns(jitter))
    return np.searchsorted(delays_ns, np.rint(delay_s * NS_PER_S), side) / len(delays_ns)


def _deviation_cdf(shape: JitterShape, deviations: Floats) -> Floats:
    from scipy import special  # type: ignore[import-untyped] # noqa: PLC0415 - takes long

    found: Floats
    if shape is JitterShape.NORMAL:
        found = special.ndtr(deviations)
    elif shape is JitterShape.PARETO:
        # The inverse of x = 4/3 · (u^(−1/3) − 3/2), which is 1 − u.
        found = 1 - np.maximum(0.75 * deviations + 1.5, 1.0) ** -3
    else:
        scores = np.linspace(-_MOST_SCORE, _MOST_SCORE, _SCORES)
        reached = _deviation_quantile(shape, special.ndtr(scores))
        found = special.ndtr(np.interp(deviations, reached, scores))
    return found


def _deviation_quantile(shape: JitterShape, probability: Floats) -> Floats:
    from scipy import special  # noqa: PLC0415 - takes long

    # As in `farside.link.profile.jitter.deviation`.
    pareto: Floats = (1 - probability) ** (-1 / 3) - 1.5
    if shape is JitterShape.PARETO:
        return 4 / 3 * pareto
    scores: Floats = special.ndtri(probability)
    return scores if shape is JitterShape.NORMAL else 0.25 * scores + pareto
