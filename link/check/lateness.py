"""How late frames are beyond sending and propagation: by jitter, holding back, and slots."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.config import OneWay
from farside.link.profile.impairments import Jitter, JitterShape, Slots
from farside.link.profile.statistics import Floats, jitter_below, jitter_cdf, jitter_quantile
from farside.node import to_ns

Ints = NDArray[np.int64]

_TAIL = 1e-9
"""Once in so many frames a jitter may be longer than is assumed."""

_HEAVIEST_TAIL = 40.0
"""In mean jitters: what an exponential jitter exceeds once in 10^17 frames."""

_NEGLIGIBLE = 0.01
"""Correlation below which samples count as independent."""

_WAITS = 400
"""So many waits, each as likely as any other, stand for a distribution in a sum."""

_BLOCK = 4096

_Cdf = Callable[[Jitter, Floats], Floats]


def greatest_ns(jitter: Jitter | None) -> int:
    """What jitter hardly ever exceeds."""
    if jitter is None:
        return 0
    match jitter.shape:
        case JitterShape.UNIFORM:
            return to_ns(jitter.spread_s)
        case JitterShape.EXPONENTIAL:
            return to_ns(_HEAVIEST_TAIL * jitter.spread_s)
        case _:
            return to_ns(float(jitter_quantile(jitter, np.array(1 - _TAIL))))


def greatest_wait_ns(slots: Slots | None) -> int:
    """What the wait for a slot hardly ever exceeds."""
    if slots is None:
        return 0
    return greatest_ns(slots.wait) if slots.wait is not None else to_ns(slots.greatest_s)


def hurry(slots: Slots | None, within_ns: int) -> float:
    """Probability that a slot opens so soon after it was asked for."""
    wait, least_ns = _wait(slots)
    late_ns = within_ns - least_ns
    if slots is None or late_ns < 0:
        return 0.0
    return 1.0 if wait is None else float(jitter_cdf(wait, np.array([late_ns / 1e9]))[0])


def spacing(correlation: float) -> int:
    """How many frames apart what has this correlation is practically independent."""
    rho = abs(correlation)
    return max(1, math.ceil(math.log(_NEGLIGIBLE) / math.log(rho))) if rho > _NEGLIGIBLE else 1


class Lateness:
    """The distribution of what jitter, holding back and the wait for a slot add to a delay.

    Args:
        way: the direction.
    """

    def __init__(self, way: OneWay) -> None:
        self._way = way
        wait, self._least_ns = _wait(way.slots)
        self._laws = [law for law in (way.jitter, wait) if law is not None]
        # Where both are there, the second one is added as so many values.
        shares: Floats = (np.arange(_WAITS) + 0.5) / _WAITS
        self._added_ns = np.zeros(1)
        if len(self._laws) > 1:
            self._added_ns = np.rint(jitter_quantile(self._laws[1], shares) * 1e9)

    @property
    def is_none(self) -> bool:
        """Whether every frame is exactly in time."""
        return self._way.jitter is None and self._way.reorder is None and self._way.slots is None

    @property
    def spacing(self) -> int:
        """How many frames apart it is practically independent."""
        jitter, reorder = self._way.jitter, self._way.reorder
        return max(
            spacing(jitter.correlation if jitter else 0.0),
            spacing(reorder.correlation if reorder else 0.0),
        )

    @property
    def greatest_ns(self) -> int:
        """What it hardly ever exceeds, holding back apart."""
        return greatest_ns(self._way.jitter) + greatest_wait_ns(self._way.slots)

    def cdf(self, late_ns: Ints) -> Floats:
        """Probability that a frame is no later than this."""
        return self._held(late_ns, jitter_cdf, lambda ns: (ns >= 0).astype(np.float64))

    def below(self, late_ns: Ints) -> Floats:
        """Probability that a frame is less late than this."""
        return self._held(late_ns, jitter_below, lambda ns: (ns > 0).astype(np.float64))

    def quantile_ns(self, probability: float) -> int:
        """What is not exceeded with this probability, 0 to 1."""
        low, high = -1, self.greatest_ns
        high += to_ns(self._way.reorder.hold_s) if self._way.reorder else 0
        while high - low > 1:
            middle = (low + high) // 2
            if float(self.cdf(np.array([middle]))[0]) >= probability:
                high = middle
            else:
                low = middle
        return high

    def _held(self, late_ns: Ints, law: _Cdf, exact: Callable[[Ints], Floats]) -> Floats:
        free = self._free(late_ns, law, exact)
        reorder = self._way.reorder
        if reorder is None:
            return free
        held = self._free(late_ns - to_ns(reorder.hold_s), law, exact)
        return (1 - reorder.share) * free + reorder.share * held

    def _free(self, late_ns: Ints, law: _Cdf, exact: Callable[[Ints], Floats]) -> Floats:
        late_ns = late_ns - self._least_ns
        if not self._laws:
            return exact(late_ns)
        found = np.empty(len(late_ns))
        for begin in range(0, len(late_ns), _BLOCK):
            own = slice(begin, begin + _BLOCK)
            late_s = (late_ns[own, None] - self._added_ns) / 1e9
            found[own] = law(self._laws[0], late_s).mean(axis=1)
        return found


def _wait(slots: Slots | None) -> tuple[Jitter | None, int]:
    """The random part of the wait for a slot, and the rest in nanoseconds."""
    if slots is None or slots.wait is not None:
        return (slots.wait if slots else None), 0
    range_s = slots.greatest_s - slots.min_s
    return (Jitter(spread_s=range_s) if range_s > 0 else None), to_ns(slots.min_s)
