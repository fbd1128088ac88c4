"""Random impairments, as tables of a mission file."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from farside.settings import Fraction, Positive, Section


class GilbertElliott(Section, frozen=True, tag="gilbert-elliott", tag_field="model"):
    """Loss in bursts: a good and a bad state, and a probability of changing with every frame.

    Source: Gilbert (1960), Elliott (1963); parameters as in tc-netem's `loss gemodel p r 1-h 1-k`.

    Attributes:
        p: probability of going from good to bad.
        r: probability of going from bad to good.
        bad_loss: 1 − h, probability that a frame is lost in the bad state.
        good_loss: 1 − k, the same in the good state.
    """

    p: Fraction
    r: Fraction
    bad_loss: Fraction = 1.0
    good_loss: Fraction = 0.0


class FourState(Section, frozen=True, tag="four-state", tag_field="model"):
    """Loss in bursts between gaps: a Markov chain of four states that steps with every frame.

    1 received in a gap, 2 received within a burst, 3 lost within a burst, 4 lost alone in a gap.
    Source: Salsano et al. (2009), as tc-netem's `loss state p13 p31 p32 p23 p14`. State 4 always
    returns to 1.

    Attributes:
        p13: probability of going from 1 to 3.
        p31: probability of going from 3 to 1; 1 − `p13` where absent, as in tc-netem.
        p32: probability of going from 3 to 2.
        p23: probability of going from 2 to 3.
        p14: probability of going from 1 to 4.

    Raises:
        ValueError: if the probabilities of leaving a state add up to more than 1.
    """

    p13: Fraction
    p31: Fraction | None = None
    p32: Fraction = 0.0
    p23: Fraction = 1.0
    p14: Fraction = 0.0

    def __post_init__(self) -> None:
        p31 = 1.0 - self.p13 if self.p31 is None else self.p31
        told = "p31 + p32" if self.p31 is not None else "p31 (where absent, 1 - p13) + p32"
        for names, total in (("p13 + p14", self.p13 + self.p14), (told, p31 + self.p32)):
            if total > 1.0:
                raise ValueError(f"expected {names} of 1 at most, found {total:g}")


LossModel = Fraction | GilbertElliott | FourState
"""The probability that each frame is lost independently, or a model with memory."""


class JitterShape(StrEnum):
    """Distribution of the delay: uniform from 0 to the spread, or exponential with it as mean."""

    UNIFORM = "uniform"
    EXPONENTIAL = "exponential"


class Jitter(Section, frozen=True):
    """Delay on top of the propagation, drawn for each frame; it never makes a frame overtake.

    Attributes:
        spread_s: the longest delay if `uniform`, the mean one if `exponential`.
        shape: the distribution, which holds for any correlation (a Gaussian copula).
        correlation: between the jitters of successive frames, of the underlying normal variables;
            −1 to 1 exclusive.
    """

    spread_s: Positive
    shape: JitterShape = JitterShape.UNIFORM
    correlation: Annotated[float, Meta(gt=-1, lt=1)] = 0.0


class Reorder(Section, frozen=True):
    """Frames held back while later ones pass.

    Attributes:
        share: the probability that a frame is held back.
        hold_s: for how long.
    """

    share: Fraction
    hold_s: Positive
