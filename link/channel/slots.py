"""When a transmitter is let through: in slots that it asks for and that open some time later."""

import math

from numpy.random import Generator

from farside.link.profile.impairments import Slots
from farside.link.profile.jitter import sampler
from farside.link.profile.rate import Rate
from farside.node import NS_PER_S, to_ns

_WORK_PER_BYTE = 8 * NS_PER_S


class Slotted:
    """A rate that is at hand in slots only; see `farside.link.profile.impairments.Slots`.

    What the transmitter asks for at a time after the last frame has left gets a slot of its own,
    as nothing can have waited in between. A frame for which the rate itself makes it wait ends the
    slot too.

    Args:
        rate: at which frames are sent within a slot.
        slots: how long the waits for slots are, and what passes in one.
        rng: draws one number per slot.
    """

    constant_bit_s = 0.0

    def __init__(self, rate: Rate, slots: Slots, rng: Generator) -> None:
        self._rate, self._rng = rate, rng
        self._is_constant = rate.constant_bit_s > 0
        # How long work takes at a constant rate.
        self._sending_ns: dict[int, int] = {}
        self._least_ns = to_ns(slots.min_s)
        self._range_ns = to_ns(slots.greatest_s) - self._least_ns
        self._sample = None if slots.wait is None else sampler(slots.wait)
        self._frames: float = slots.frames or math.inf
        self._work: float = slots.bytes * _WORK_PER_BYTE if slots.bytes else math.inf
        # When the latest slot opens, when the last frame in it has left, and what may still pass.
        self._opens_ns = self._free_ns = -1
        self._frames_left = self._work_left = 0.0

    def opens_ns(self, time_ns: int) -> int:
        """See `Rate.opens_ns`."""
        if time_ns < self._opens_ns:
            return self._opens_ns
        left = time_ns == self._free_ns and self._frames_left > 0 and self._work_left > 0
        if left and (self._is_constant or self._rate.opens_ns(time_ns) == time_ns):
            return time_ns
        self._opens_ns = self._free_ns = self._rate.opens_ns(time_ns + self._wait_ns())
        self._frames_left, self._work_left = self._frames, self._work
        return self._opens_ns

    def end_ns(self, start_ns: int, work: int) -> int:
        """See `Rate.end_ns`."""
        self._frames_left -= 1
        self._work_left -= work
        if work in self._sending_ns:
            self._free_ns = start_ns + self._sending_ns[work]
        else:
            self._free_ns = self._rate.end_ns(start_ns, work)
            if self._is_constant:
                self._sending_ns[work] = self._free_ns - start_ns
        return self._free_ns

    def _wait_ns(self) -> int:
        if self._sample is None:
            return self._least_ns + round(self._rng.random() * self._range_ns)
        return self._sample([float(self._rng.standard_normal())])[0]

    def remaining(self, start_ns: int, work: int, now_ns: int) -> int:
        """See `Rate.remaining`."""
        return self._rate.remaining(start_ns, work, now_ns)
