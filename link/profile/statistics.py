"""Long-run statistics of loss models and jitter."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.impairments import Jitter, JitterShape, LossModel
from farside.link.profile.loss import LossChain

Floats = NDArray[np.float64]


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
    transitions = _transition_matrix(chain)
    lost = 1 - (1 - np.array(chain.losses)) * (1 - other)
    states = len(lost)
    # Stationary distribution: π(P − I) = 0, Σπ = 1
    balance = np.vstack([transitions.T - np.eye(states), np.ones(states)])
    share = np.linalg.lstsq(balance, np.append(np.zeros(states), 1.0), rcond=None)[0]
    rate = float(share @ lost)
    begins = float((share * (1 - lost)) @ transitions @ lost)
    if not 0 < rate < 1:
        return LossStatistics(rate, math.inf if rate else math.nan, 1.0)
    # Sum of the covariances between the loss of a frame and that of every later frame.
    deviation = transitions - share
    covariance = float(
        (share * lost) @ np.linalg.solve(np.eye(states) - deviation, deviation @ lost)
    )
    clustering = max(1.0, 1 + 2 * covariance / (rate * (1 - rate)))
    return LossStatistics(rate, rate / begins if begins > 1e-12 else math.inf, clustering)


def _transition_matrix(chain: LossChain) -> Floats:
    """Probability of going from each state (row) to each state (column)."""
    matrix = np.zeros((len(chain.exits), len(chain.exits)))
    for state, exits in enumerate(chain.exits):
        staying = 1.0
        for probability, following in exits:
            matrix[state, following] = probability
            staying -= probability
        matrix[state, state] = staying
    return matrix


def jitter_cdf(jitter: Jitter, delay_s: Floats) -> Floats:
    """Probability that the jitter does not exceed `delay_s`."""
    if jitter.shape is JitterShape.UNIFORM:
        return np.clip(delay_s / jitter.spread_s, 0.0, 1.0)
    return -np.expm1(-np.maximum(delay_s, 0.0) / jitter.spread_s)


def jitter_quantile(jitter: Jitter, probability: Floats) -> Floats:
    """The jitter in seconds that is not exceeded with this probability, 0 up to but not 1."""
    if jitter.shape is JitterShape.UNIFORM:
        return probability * jitter.spread_s
    return -np.log1p(-probability) * jitter.spread_s
