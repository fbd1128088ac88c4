"""Loss models as Markov chains: the one definition behind the channel and the statistics."""

from typing import NamedTuple

from farside.link.profile.impairments import CorrelatedLoss, FourState, GilbertElliott, LossModel


class LossChain(NamedTuple):
    """A Markov chain that takes one step per frame and then loses the frame or not.

    Attributes:
        exits: for each state, the states it can be left for, as (probability, next state). What the
            probabilities leave of 1 is that of staying. Their order decides which random numbers
            lead where, so it is part of what a seed means.
        losses: for each state, the probability that a frame is lost.
    """

    exits: tuple[tuple[tuple[float, int], ...], ...]
    losses: tuple[float, ...]

    @classmethod
    def of(cls, model: LossModel) -> "LossChain":
        """The chain of a loss model. It starts in state 0: the good state, or the gap."""
        match model:
            case GilbertElliott(p=p, r=r):
                return cls((((p, 1),), ((r, 0),)), (model.good_loss, model.bad_loss))
            case FourState(p13=p13, p32=p32, p23=p23, p14=p14):
                p31 = 1.0 - p13 if model.p31 is None else model.p31
                return cls(
                    (((p14, 3), (p13, 2)), ((p23, 2),), ((p32, 1), (p31, 0)), ((1.0, 0),)),
                    (0.0, 0.0, 1.0, 1.0),
                )
            case CorrelatedLoss(probability=p, correlation=c):
                hit, spared = p * (1 - c), (1 - p) * (1 - c)
                return cls((((min(1.0, hit), 1),), ((min(1.0, spared), 0),)), (0.0, 1.0))
            case probability:
                return cls(((),), (probability,))
