"""Random impairments, as tables of a mission file."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from farside.settings import Count, Fraction, NonNegative, Positive, Section

Correlation = Annotated[float, Meta(gt=-1, lt=1)]
"""Between what successive frames meet with."""

Deviate = Annotated[int, Meta(ge=-(1 << 15), lt=1 << 15)]
"""An entry of a distribution table: a standardised deviation times `TABLE_SCALE`."""

TABLE_SCALE = 8192
"""What stands for 1 in a distribution table (tc-netem's NETEM_DIST_SCALE)."""


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


class CorrelatedLoss(Section, frozen=True, tag="correlated", tag_field="model"):
    """Loss of a given probability and correlation: what tc-netem's `loss random` is meant to do.

    A chain of two states, lost or not, in which the losses of frames n apart have the correlation
    cⁿ. Source: Yajnik et al. (1999). In tc-netem the correlation changes the probability too.

    Attributes:
        probability: p, that a frame is lost.
        correlation: c, between the losses of successive frames, counted as 0 and 1.

    Raises:
        ValueError: if no losses can be so anticorrelated.
    """

    probability: Fraction
    correlation: Correlation = 0.0

    def __post_init__(self) -> None:
        _expect_chain(self.probability, self.correlation)


LossModel = Fraction | GilbertElliott | FourState | CorrelatedLoss
"""The probability that each frame is lost independently, or a model with memory."""


class JitterShape(StrEnum):
    """Distribution of the delay on top; x is a deviation in spreads, the same as in tc-netem.

    `UNIFORM`: from 0 to the spread. `EXPONENTIAL`: with the spread as mean.
    `NORMAL`: x is normal. `PARETO`: x = 4/3 · (u^(−1/3) − 3/2) with u uniform, of mean 0 and least
    −2/3, without the cut at 4 that the table of tc-netem makes. `PARETONORMAL`: a quarter of the
    one and three quarters of the other, of the same u. `TABLE`: x is an entry of a table.
    """

    UNIFORM = "uniform"
    EXPONENTIAL = "exponential"
    NORMAL = "normal"
    PARETO = "pareto"
    PARETONORMAL = "paretonormal"
    TABLE = "table"

    @property
    def is_centred(self) -> bool:
        """Whether it is that of a deviation from a mean, which may be negative."""
        return self not in {JitterShape.UNIFORM, JitterShape.EXPONENTIAL}


class Jitter(Section, frozen=True):
    """Delay on top of the propagation, drawn for each frame; it never makes a frame overtake.

    Nothing arrives before the propagation delay has passed: with the shapes of a deviation the
    delay on top is `mean_s` + `spread_s` · x, and 0 where that is negative. So with a normal x and
    a mean of 0, half of the frames have no jitter, and the mean delay on top is 0.4 spreads.

    Attributes:
        spread_s: the longest delay if `uniform`, the mean one if `exponential`, else what
            multiplies x: the standard deviation if `normal`, 0.87 of it if `pareto`.
        shape: the distribution, which holds for any correlation (a Gaussian copula).
        mean_s: the delay where x = 0; not with `uniform` and `exponential`.
        correlation: between the jitters of successive frames, of the underlying normal variables;
            −1 to 1 exclusive.
        file: path of a distribution table in the format of tc-netem, such as `pareto.dist`.
        table: its entries, each x as likely as any other, times 8192.

    Raises:
        ValueError: if there is a table without its shape, or the shape without one, or a mean with
            a shape that has none.
    """

    spread_s: Positive
    shape: JitterShape = JitterShape.UNIFORM
    mean_s: NonNegative = 0.0
    correlation: Correlation = 0.0
    file: str | None = None
    table: tuple[Deviate, ...] = ()

    def __post_init__(self) -> None:
        if self.mean_s and not self.shape.is_centred:
            centred = ", ".join(shape for shape in JitterShape if shape.is_centred)
            raise ValueError(f"expected mean_s with one of {centred} only, found {self.shape}")
        given = [name for name in ("file", "table") if getattr(self, name)]
        if self.shape is JitterShape.TABLE and len(given) != 1:
            found = "both" if given else "neither"
            raise ValueError(f"expected a table by file or by table, found {found}")
        if given and self.shape is not JitterShape.TABLE:
            raise ValueError(f'expected {given[0]} with shape = "table" only, found {self.shape}')


class Reorder(Section, frozen=True):
    """Frames held back while later ones pass.

    Attributes:
        share: the probability that a frame is held back.
        hold_s: for how long.
        correlation: between whether successive frames are held back, counted as 0 and 1, by a chain
            of two states as for `CorrelatedLoss`.

    Raises:
        ValueError: if no frames can be so anticorrelated.
    """

    share: Fraction
    hold_s: Positive
    correlation: Correlation = 0.0

    def __post_init__(self) -> None:
        _expect_chain(self.share, self.correlation)


class Slots(Section, frozen=True):
    """Frames let through in bursts, as by the medium access of WiFi, DOCSIS, LTE or satellites.

    A transmitter with something to send asks for a slot and gets it `min_s` to `max_s` later, the
    waits uniformly distributed; meanwhile frames gather in the queue. A slot ends when nothing
    waits or it has carried `frames` or `bytes`; for what is left, the next one is asked for at
    once. Source: tc-netem's `slot`.

    Attributes:
        min_s: the shortest wait for a slot.
        max_s: the longest one; `min_s` where absent.
        wait: a distribution of the waits in place of both limits; they are not correlated.
        frames: how many frames pass in a slot at most; any number where absent.
        bytes: a slot ends with the frame that brings it to this many bytes, overhead included.

    Raises:
        ValueError: if the longest wait is 0 or shorter than the shortest, or if waits are given in
            two ways, or are correlated.
    """

    min_s: NonNegative = 0.0
    max_s: NonNegative | None = None
    wait: Jitter | None = None
    frames: Count | None = None
    bytes: Count | None = None

    def __post_init__(self) -> None:
        if self.wait is not None:
            if self.min_s or self.max_s is not None:
                raise ValueError("expected either min_s and max_s or wait, found both")
            if self.wait.correlation:
                found = f"{self.wait.correlation:g}"
                raise ValueError(f"expected waits without correlation, found {found}")
        elif self.greatest_s == 0 or self.greatest_s < self.min_s:
            found = f"min_s = {self.min_s:g} and max_s = {self.greatest_s:g}"
            raise ValueError(f"expected max_s above 0, and min_s or more, found {found}")

    @property
    def greatest_s(self) -> float:
        """The longest wait for a slot by its limits."""
        return self.min_s if self.max_s is None else self.max_s


def _expect_chain(probability: float, correlation: float) -> None:
    """Both states must be left with a probability of 1 at most."""
    rarer = min(probability, 1 - probability)
    least = 0.0 - rarer / (1 - rarer)
    if correlation < least:
        raise ValueError(
            f"expected a correlation of {least:.6g} or more with a probability of {probability:g}, "
            f"found {correlation:g}"
        )
