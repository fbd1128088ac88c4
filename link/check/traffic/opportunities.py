"""The delivery opportunities of a trace, counted from 0 over all its rounds."""

import numpy as np
from numpy.typing import NDArray

from farside.link.profile.config import AtEnd, Trace
from farside.link.profile.rate import OPPORTUNITY_BYTE

_NS_PER_MS = 1_000_000
_NEVER_NS = 1 << 61
_MOST_ROUNDS = 1 << 40

Ints = NDArray[np.int64]


class TraceTimes:
    """The delivery opportunities of a trace.

    Args:
        trace: with its times, in order, the last of them above 0.
    """

    def __init__(self, trace: Trace) -> None:
        times_ns = [min(ms * _NS_PER_MS, _NEVER_NS) for ms in trace.times_ms]
        self._times_ns = np.array(times_ns, dtype=np.int64)
        self._round_ns = times_ns[-1]
        self._wraps = trace.at_end is AtEnd.WRAP

    @staticmethod
    def needed(frame_byte: int) -> int:
        """How many opportunities a frame takes that finds none in use."""
        return -(-frame_byte // OPPORTUNITY_BYTE)

    def time_ns(self, number: Ints) -> Ints:
        """When these opportunities are; far away if never."""
        rounds, index = np.divmod(number, len(self._times_ns))
        if not self._wraps:
            return np.where(rounds > 0, _NEVER_NS, self._times_ns[index])
        possible = rounds <= _NEVER_NS // self._round_ns - 1
        found: Ints = np.where(possible, rounds, 0) * self._round_ns + self._times_ns[index]
        return np.where(possible, found, _NEVER_NS)

    def first_from(self, time_ns: Ints) -> Ints:
        """The number of the first opportunity at or after each of these moments."""
        rounds = np.zeros_like(time_ns)
        if self._wraps:
            rounds = np.maximum(0, -(-time_ns // self._round_ns) - 1)
        index = np.searchsorted(self._times_ns, time_ns - rounds * self._round_ns, side="left")
        found: Ints = rounds * len(self._times_ns) + index
        return found

    def longest_ns(self, count: int) -> int:
        """The longest time that something has to wait for this many opportunities."""
        if count > _MOST_ROUNDS:
            return _NEVER_NS
        before = np.arange(len(self._times_ns)) - 1
        if not self._wraps:
            before = before[: max(0, len(before) + 1 - count)]
            if not len(before):
                return _NEVER_NS
        begun = np.where(before < 0, 0, self._times_ns[before])
        return int((self.time_ns(before + count) - begun).max())
