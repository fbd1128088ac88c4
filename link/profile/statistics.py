"""What a model of loss or jitter gives in the long run."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.impairments import (
    FourState,
    GilbertElliott,
    Jitter,
    JitterShape,
    LossModel,
)

Floats = NDArray[np.float64]


class LossStatistics(NamedTuple):
    """A loss model in the long run.

    Attributes:
        rate: share of frames lost.
        burst_length: mean number of frames lost in a row.
        clustering: how many frames tell as much of the rate as one that is lost on its own.
    """

    rate: float
    burst_length: float
    clustering: float


def loss_statistics(model: LossModel, other: float = 0.0) -> LossStatistics:
    """What `model` gives, where each frame may also be lost to something else on its own.

    A model is a chain of states with a chance of loss in each. A run of losses begins where a lost
    frame follows one that was not, so its mean length is the loss rate over the rate of such pairs.

    Args:
        model: see `farside.link.profile.impairments`.
        other: chance that a frame which the model spares is lost nevertheless.
    """
    moves, lost = _chain(model)
    lost = 1 - (1 - lost) * (1 - other)
    states = len(lost)
    balance = np.vstack([moves.T - np.eye(states), np.ones(states)])
    share = np.linalg.lstsq(balance, np.append(np.zeros(states), 1.0), rcond=None)[0]
    rate = float(share @ lost)
    begins = float((share * (1 - lost)) @ moves @ lost)
    if not 0 < rate < 1:
        return LossStatistics(rate, math.inf if rate else math.nan, 1.0)
    # The covariances of a frame's loss with those of all later frames, summed up.
    apart = moves - share
    shared = float((share * lost) @ np.linalg.solve(np.eye(states) - apart, apart @ lost))
    clustering = max(1.0, 1 + 2 * shared / (rate * (1 - rate)))
    return LossStatistics(rate, rate / begins if begins > 1e-12 else math.inf, clustering)


def _chain(model: LossModel) -> tuple[Floats, Floats]:
    """Chances to go from state to state, and of loss in each."""
    match model:
        case GilbertElliott(p=p, r=r):
            return (
                np.array([[1 - p, p], [r, 1 - r]]),
                np.array([model.good_loss, model.bad_loss]),
            )
        case FourState(p13=p13, p32=p32, p23=p23, p14=p14):
            p31 = 1 - p13 if model.p31 is None else model.p31
            return (
                np.array(
                    [
                        [1 - p13 - p14, 0, p13, p14],
                        [0, 1 - p23, p23, 0],
                        [p31, p32, 1 - p31 - p32, 0],
                        [1, 0, 0, 0],
                    ]
                ),
                np.array([0.0, 0.0, 1.0, 1.0]),
            )
        case _:
            return np.ones((1, 1)), np.array([float(model)])


def jitter_chance(jitter: Jitter, delay_s: Floats) -> Floats:
    """The chance of a jitter up to `delay_s`."""
    if jitter.shape is JitterShape.UNIFORM:
        return np.clip(delay_s / jitter.spread_s, 0.0, 1.0)
    return -np.expm1(-np.maximum(delay_s, 0.0) / jitter.spread_s)


def jitter_quantile(jitter: Jitter, chance: Floats) -> Floats:
    """The jitter that is not exceeded with a chance of `chance`."""
    if jitter.shape is JitterShape.UNIFORM:
        return chance * jitter.spread_s
    return -np.log1p(-chance) * jitter.spread_s
