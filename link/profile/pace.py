"""How fast a transmitter is, over time: a rate, a table of rates, or a trace of opportunities.

Work is counted in bits × 10⁹, so that a rate in bit/s does a whole number of it in a nanosecond.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Protocol

from farside.link.profile.config import AtEnd, OneWay, RateStep, Trace
from farside.node import NEVER_NS, NS_PER_S, to_ns

_NS_PER_MS = 1_000_000
_OPPORTUNITY = 1500 * 8 * NS_PER_S


class Pace(Protocol):
    """How fast a transmitter is, over time.

    Attributes:
        constant_bit_s: the rate, if it is above 0 and always the same; 0 otherwise. Then nobody
            needs to ask when: work w takes w / rate, rounded up.
    """

    constant_bit_s: int

    def opens_ns(self, time_ns: int) -> int:
        """When, from `time_ns` on, something can be sent; `NEVER_NS` if not."""
        ...

    def end_ns(self, start_ns: int, work: int) -> int:
        """When `work` is done that starts at an open moment; `NEVER_NS` if not.

        Work comes in order: each start is not before the end of what was started before.
        """
        ...

    def left(self, start_ns: int, work: int, now_ns: int) -> int:
        """How much of the work last started is still to be done at `now_ns`."""
        ...


def pace_of(one_way: OneWay) -> Pace | None:
    """The pace that `one_way` asks for, `None` if it sets no limit."""
    if one_way.rate_trace is not None:
        return Opportunities(one_way.rate_trace)
    if one_way.rate_table:
        return Rates(one_way.rate_table)
    if one_way.rate_bit_s is not None:
        return Rates((RateStep(t_s=0.0, rate_bit_s=one_way.rate_bit_s),))
    return None


class Unlimited:
    """A rate without a limit."""

    constant_bit_s = 0

    def opens_ns(self, time_ns: int) -> int:
        """See `Pace.opens_ns`."""
        return time_ns

    def end_ns(self, start_ns: int, work: int) -> int:  # noqa: ARG002 - as in `Pace`
        """See `Pace.end_ns`."""
        return start_ns

    def left(self, start_ns: int, work: int, now_ns: int) -> int:  # noqa: ARG002 - as in `Pace`
        """See `Pace.left`."""
        return 0


class Rates:
    """A rate that changes in steps, the first of them at time 0."""

    def __init__(self, steps: Sequence[RateStep]) -> None:
        self._times_ns = [to_ns(step.t_s) for step in steps]
        self._rates = [step.rate_bit_s for step in steps]
        self.constant_bit_s = self._rates[0] if len(steps) == 1 else 0

    def opens_ns(self, time_ns: int) -> int:
        """See `Pace.opens_ns`."""
        step = bisect_right(self._times_ns, time_ns) - 1
        if self._rates[step]:
            return time_ns
        later = zip(self._times_ns[step + 1 :], self._rates[step + 1 :], strict=True)
        return next((begin_ns for begin_ns, rate in later if rate), NEVER_NS)

    def end_ns(self, start_ns: int, work: int) -> int:
        """See `Pace.end_ns`."""
        times_ns = self._times_ns
        if self.constant_bit_s:
            return start_ns - (-work // self.constant_bit_s)
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
            return start_ns - (-work // rate)
        return NEVER_NS if work else start_ns

    def left(self, start_ns: int, work: int, now_ns: int) -> int:
        """See `Pace.left`."""
        ends_ns = [*self._times_ns[1:], now_ns]
        for begin_ns, end_ns, rate in zip(self._times_ns, ends_ns, self._rates, strict=True):
            work -= rate * max(0, min(end_ns, now_ns) - max(begin_ns, start_ns))
        return max(0, work)


class Opportunities:
    """Moments at which 1500 bytes may pass, as in mahimahi; what they leave over is lost.

    A frame may take several, and several frames may share one if they wait for it.

    Raises:
        ValueError: if the trace is empty, goes back in time, or would never get on.
    """

    constant_bit_s = 0

    def __init__(self, trace: Trace) -> None:
        times_ms = trace.times_ms
        if not times_ms or list(times_ms) != sorted(times_ms) or not times_ms[-1]:
            raise ValueError(
                "expected a trace of milliseconds in order, the last of them above 0, "
                f"found {len(times_ms)} lines that end with {times_ms[-1:]}"
            )
        self._times_ns = [ms * _NS_PER_MS for ms in times_ms]
        self._wraps = trace.at_end is AtEnd.WRAP
        # The opportunity in use, counted from 0 over all rounds, and what is left of it.
        self._current, self._left = -1, 0
        self._begun = -1, 0

    def opens_ns(self, time_ns: int) -> int:
        """See `Pace.opens_ns`."""
        current, _ = self._at(time_ns)
        return self._time_ns(current)

    def end_ns(self, start_ns: int, work: int) -> int:
        """See `Pace.end_ns`."""
        self._begun = current, left = self._at(start_ns)
        more = max(0, -((left - work) // _OPPORTUNITY))
        self._current = current + more
        self._left = left + more * _OPPORTUNITY - work
        return self._time_ns(self._current)

    def left(self, start_ns: int, work: int, now_ns: int) -> int:  # noqa: ARG002 - as in `Pace`
        """See `Pace.left`."""
        current, left = self._begun
        more = self._first_from(now_ns) - current - 1
        return max(0, work - left - more * _OPPORTUNITY)

    def _at(self, time_ns: int) -> tuple[int, int]:
        """The first opportunity that is good for something from `time_ns` on, and for how much."""
        if self._left and self._time_ns(self._current) == time_ns:
            return self._current, self._left
        return max(self._current + 1, self._first_from(time_ns)), _OPPORTUNITY

    def _first_from(self, time_ns: int) -> int:
        rounds = 0
        if self._wraps:
            # The last opportunity of a round is at the time at which the next round starts.
            rounds = max(0, -(-time_ns // self._times_ns[-1]) - 1)
        place = bisect_left(self._times_ns, time_ns - rounds * self._times_ns[-1])
        return rounds * len(self._times_ns) + place

    def _time_ns(self, opportunity: int) -> int:
        rounds, place = divmod(opportunity, len(self._times_ns))
        if rounds and not self._wraps:
            return NEVER_NS
        return rounds * self._times_ns[-1] + self._times_ns[place]
