"""What may happen to a frame on its way by chance, as tables of a mission file."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from farside.settings import Fraction, Positive, Section


class GilbertElliott(Section, frozen=True, tag="gilbert-elliott", tag_field="model"):
    """Loss in bursts: a good and a bad state, and a chance to change with every frame.

    Source: Gilbert (1960), Elliott (1963); parameters as in tc-netem's `loss gemodel p r 1-h 1-k`.

    Attributes:
        p, r: chance to go from good to bad, and from bad to good.
        bad_loss: 1 − h, chance that a frame is lost in the bad state.
        good_loss: 1 − k, the same in the good state.
    """

    p: Fraction
    r: Fraction
    bad_loss: Fraction = 1.0
    good_loss: Fraction = 0.0


class FourState(Section, frozen=True, tag="four-state", tag_field="model"):
    """Loss in bursts within gaps: a Markov chain of four states, moved on with every frame.

    1 received in a gap, 2 received within a burst, 3 lost within a burst, 4 lost alone in a gap.
    Source: Salsano et al. (2009), as tc-netem's `loss state p13 p31 p32 p23 p14`. From 4 it always
    goes back to 1.

    Attributes:
        p13, p31, p32, p23, p14: chances to go from the first state to the second. `p31` is what
            `p13` leaves where absent, as tc-netem has it.

    Raises:
        ValueError: if the chances to leave a state are above 1 together.
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
"""The chance that a frame is lost, each on its own, or a model with a memory."""


class JitterShape(StrEnum):
    """How the delay on top is spread: evenly from 0 to the spread, or with the spread for mean."""

    UNIFORM = "uniform"
    EXPONENTIAL = "exponential"


class Jitter(Section, frozen=True):
    """Delay on top of the propagation, drawn for each frame; it never makes a frame overtake.

    Attributes:
        spread_s: see `JitterShape`.
        shape: its distribution, which holds whatever the correlation (a Gaussian copula).
        correlation: of a frame's jitter with that of the frame before, −1 to 1 exclusive, of the
            underlying normal variables.
    """

    spread_s: Positive
    shape: JitterShape = JitterShape.UNIFORM
    correlation: Annotated[float, Meta(gt=-1, lt=1)] = 0.0


class Reorder(Section, frozen=True):
    """Frames are held back with a chance of `share` for `hold_s`, while later ones pass."""

    share: Fraction
    hold_s: Positive
