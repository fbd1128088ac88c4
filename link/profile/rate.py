"""The rate over time: constant, in steps, or as a trace of delivery opportunities.

Work is counted in bits × 10⁹, so that at 1 bit/s one nanosecond does one unit of it and a whole
rate does a whole number.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Protocol

from farside.link.profile.config import AtEnd, OneWay, Trace
from farside.node import NEVER_NS, NS_PER_S, to_ns

OPPORTUNITY_BYTE = 1500
"""What passes at one delivery opportunity of a trace (mahimahi)."""

_NS_PER_MS = 1_000_000
_OPPORTUNITY_WORK = OPPORTUNITY_BYTE * 8 * NS_PER_S


class Rate(Protocol):
    """When a transmitter can send, and how long it takes.

    Attributes:
        constant_bit_s: the rate if it never changes and is above 0, otherwise 0. If it is constant,
            the transmitter is always open, and work w takes w / rate, rounded up.
    """

    constant_bit_s: float

    def opens_ns(self, time_ns: int) -> int:
        """The first moment from `time_ns` on at which something can be sent, or `NEVER_NS`."""
        ...

    def end_ns(self, start_ns: int, work: int) -> int:
        """When work that starts at an open moment is done; `NEVER_NS` if it never is.

        Calls come in order: no start is before the end of the work started before.
        """
        ...

    def remaining(self, start_ns: int, work: int, now_ns: int) -> int:
        """How much of the work last started remains to be done at `now_ns`."""
        ...


def transmit_rate(one_way: OneWay) -> Rate | None:
    """The rate at which the channel transmits; `None` without a limit.

    Raises:
        ValueError: if a trace cannot be played; see `Opportunities`.
    """
    if one_way.rate_trace is not None:
        return Opportunities(one_way.rate_trace)
    return _rate_steps(one_way)


def planning_rate(one_way: OneWay) -> "RateSteps | None":
    """The rate by which the endpoints plan; `None` without a limit.

    A trace counts with its mean rate, for its opportunities are not known beforehand.
    """
    trace = one_way.rate_trace
    if trace is None or not trace.times_ms or not trace.times_ms[-1]:
        return _rate_steps(one_way)
    last_ms = trace.times_ms[-1]
    mean_bit_s = len(trace.times_ms) * OPPORTUNITY_BYTE * 8 * 1000 / last_ms
    end = [(last_ms * _NS_PER_MS, 0)] if trace.at_end is AtEnd.END else []
    return RateSteps([(0, mean_bit_s), *end])


def _rate_steps(one_way: OneWay) -> "RateSteps | None":
    if one_way.rate_table:
        return RateSteps([(to_ns(step.t_s), step.rate_bit_s) for step in one_way.rate_table])
    return None if one_way.rate_bit_s is None else RateSteps([(0, one_way.rate_bit_s)])


class Unlimited:
    """A transmitter without a rate limit."""

    constant_bit_s = 0.0

    def opens_ns(self, time_ns: int) -> int:
        """See `Rate.opens_ns`."""
        return time_ns

    def end_ns(self, start_ns: int, work: int) -> int:  # noqa: ARG002 - as in `Rate`
        """See `Rate.end_ns`."""
        return start_ns

    def remaining(self, start_ns: int, work: int, now_ns: int) -> int:  # noqa: ARG002 - as in `Rate`
        """See `Rate.remaining`."""
        return 0


class RateSteps:
    """A rate that changes in steps.

    Args:
        steps: in order, from when on each rate holds, in ns, and the rate in bit/s, 0 for none; the
            first at time 0.
    """

    def __init__(self, steps: Sequence[tuple[int, float]]) -> None:
        self._times_ns = [time_ns for time_ns, _ in steps]
        self._rates = [rate for _, rate in steps]
        self.constant_bit_s = self._rates[0] if len(steps) == 1 else 0.0

    @property
    def times_ns(self) -> Sequence[int]:
        """From when on each of its rates holds, in ns."""
        return self._times_ns

    def at(self, time_ns: int) -> float:
        """The rate at a moment in bit/s; before time 0, that of the first step."""
        return self._rates[max(0, bisect_right(self._times_ns, time_ns) - 1)]

    def idle(self) -> list[tuple[int, int]]:
        """The spans in which the rate is 0, begin and end in ns."""
        ends_ns = [*self._times_ns[1:], NEVER_NS]
        steps = zip(self._times_ns, ends_ns, self._rates, strict=True)
        return [(begin_ns, end_ns) for begin_ns, end_ns, rate in steps if rate == 0]

    def opens_ns(self, time_ns: int) -> int:
        """See `Rate.opens_ns`."""
        step = bisect_right(self._times_ns, time_ns) - 1
        if self._rates[step]:
            return time_ns
        later = zip(self._times_ns[step + 1 :], self._rates[step + 1 :], strict=True)
        return next((begin_ns for begin_ns, rate in later if rate), NEVER_NS)

    def end_ns(self, start_ns: int, work: float) -> int:
        """See `Rate.end_ns`."""
        times_ns = self._times_ns
        if self.constant_bit_s:
            return start_ns - int(-work // self.constant_bit_s)
        following = bisect_right(times_ns, start_ns)
        while following < len(times_ns):
            done = self._rates[following - 1] * (times_ns[following] - start_ns)
            if done >= work:
                break
            work -= done
            start_ns = times_ns[following]
            following += 1
        rate = self._rates[following - 1]
        if rate:
            return start_ns - int(-work // rate)
        return NEVER_NS if work else start_ns

    def remaining(self, start_ns: int, work: int, now_ns: int) -> int:
        """See `Rate.remaining`."""
        left: float = work
        ends_ns = [*self._times_ns[1:], now_ns]
        for begin_ns, end_ns, rate in zip(self._times_ns, ends_ns, self._rates, strict=True):
            left -= rate * max(0, min(end_ns, now_ns) - max(begin_ns, start_ns))
        return max(0, int(left))


class Opportunities:
    """Moments at which 1500 bytes may pass, as in mahimahi; what they leave unused is lost.

    A frame may take several opportunities, and several frames may share one if they wait for it.

    Raises:
        ValueError: if the trace is empty.
    """

    constant_bit_s = 0.0

    def __init__(self, trace: Trace) -> None:
        times_ms = trace.times_ms
        if not times_ms:
            raise ValueError("expected the times of a trace, found none")
        self._times_ns = [ms * _NS_PER_MS for ms in times_ms]
        self._wraps = trace.at_end is AtEnd.WRAP
        # The opportunity in use, counted from 0 over all rounds, and the work that is left in it.
        self._current, self._left = -1, 0
        # The same when the work last started began.
        self._begun = -1, 0

    def opens_ns(self, time_ns: int) -> int:
        """See `Rate.opens_ns`."""
        current, _ = self._at(time_ns)
        return self._time_ns(current)

    def end_ns(self, start_ns: int, work: int) -> int:
        """See `Rate.end_ns`."""
        self._begun = current, left = self._at(start_ns)
        more = max(0, -((left - work) // _OPPORTUNITY_WORK))
        self._current = current + more
        self._left = left + more * _OPPORTUNITY_WORK - work
        return self._time_ns(self._current)

    def remaining(self, start_ns: int, work: int, now_ns: int) -> int:  # noqa: ARG002 - as in `Rate`
        """See `Rate.remaining`."""
        current, left = self._begun
        more = self._first_from(now_ns) - current - 1
        return max(0, work - left - more * _OPPORTUNITY_WORK)

    def _at(self, time_ns: int) -> tuple[int, int]:
        """The first opportunity from `time_ns` on that has room, and how much."""
        if self._left and self._time_ns(self._current) == time_ns:
            return self._current, self._left
        return max(self._current + 1, self._first_from(time_ns)), _OPPORTUNITY_WORK

    def _first_from(self, time_ns: int) -> int:
        rounds = 0
        if self._wraps:
            # The last opportunity of a round is at the time at which the next round starts.
            rounds = max(0, -(-time_ns // self._times_ns[-1]) - 1)
        index = bisect_left(self._times_ns, time_ns - rounds * self._times_ns[-1])
        return rounds * len(self._times_ns) + index

    def _time_ns(self, opportunity: int) -> int:
        rounds, index = divmod(opportunity, len(self._times_ns))
        if rounds and not self._wraps:
            return NEVER_NS
        return rounds * self._times_ns[-1] + self._times_ns[index]
