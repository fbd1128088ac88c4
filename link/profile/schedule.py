"""What both ends know of the link beforehand: light times, rates and contacts."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from itertools import accumulate, pairwise
from operator import add
from typing import NamedTuple

from farside.frames import OutageReason
from farside.link.profile.config import AfterLast, LinkConfig, OneWay
from farside.link.profile.rate import planning_rate
from farside.node import NEVER_NS, NS_PER_S, Direction, to_ns

Span = tuple[int, int]
"""Begin and end in nanoseconds; the end is not part of it."""


class Outage(NamedTuple):
    """A direction is out from `begin_ns` up to, not including, `end_ns`."""

    begin_ns: int
    end_ns: int
    reason: OutageReason


def outages_of(config: LinkConfig, direction: Direction) -> tuple[Outage, ...]:
    """The scheduled outages of one direction, in order and without overlaps.

    Where two overlap, the earlier one gives the reason. Adjacent ones stay separate if their
    reasons differ. Passes and contacts must have been resolved to blackouts.
    """
    return _merged(_blackouts(config, direction))


def told_outages_of(config: LinkConfig, direction: Direction) -> tuple[Outage, ...]:
    """`outages_of`, and when the sender waits for its first contact on a way by other nodes.

    Nothing is lost to the latter.
    """
    rate = None if config.routing is None else planning_rate(config.way(direction))
    if rate is None:
        return outages_of(config, direction)
    waits = [Outage(*span, OutageReason.CONTACT) for span in rate.idle()]
    return _merged([*_blackouts(config, direction), *waits])


def _blackouts(config: LinkConfig, direction: Direction) -> list[Outage]:
    own = (one for one in config.blackouts if one.direction.includes(direction))
    return [Outage(*one.span_ns, one.reason) for one in own]


def _merged(outages: Iterable[Outage]) -> tuple[Outage, ...]:
    found: list[Outage] = []
    for begin_ns, end_ns, reason in sorted(outages):
        start_ns = max(begin_ns, found[-1].end_ns) if found else begin_ns
        if start_ns >= end_ns:
            continue
        if found and found[-1].end_ns == start_ns and found[-1].reason is reason:
            found[-1] = Outage(found[-1].begin_ns, end_ns, reason)
        else:
            found.append(Outage(start_ns, end_ns, reason))
    return tuple(found)


class Delay:
    """Propagation delay over time: linear between the points of a table, constant outside it.

    That of a trace that wraps begins anew with its first point after the last.
    """

    def __init__(self, one_way: OneWay) -> None:
        points, trace = one_way.delay_points, one_way.delay_trace
        wraps = trace is not None and trace.at_end is AfterLast.WRAP
        self._round_ns = to_ns(points[-1].t_s) if wraps and points else None
        self._times_ns = [to_ns(point.t_s) for point in points]
        self._delays_ns = [to_ns(point.delay_s) for point in points]
        self._arrivals_ns: list[int] = list(map(add, self._times_ns, self._delays_ns))
        self._constant_ns = one_way.least_delay_ns if len(points) < 2 else None

    @property
    def is_constant(self) -> bool:
        """Whether it is the same at all times."""
        return self._constant_ns is not None

    def turns_ns(self, begin_ns: int, end_ns: int) -> Iterator[int]:
        """The moments between two at which it stops being linear: the points of its table."""
        round_ns = self._round_ns or NEVER_NS
        for round_begin_ns in range(begin_ns // round_ns * round_ns, end_ns, round_ns):
            times_ns = (round_begin_ns + time_ns for time_ns in self._times_ns)
            yield from (time_ns for time_ns in times_ns if begin_ns < time_ns < end_ns)

    def at(self, time_ns: int) -> int:
        """Propagation delay of what is sent at `time_ns`, in nanoseconds."""
        if self._constant_ns is not None:
            return self._constant_ns
        if self._round_ns:
            time_ns %= self._round_ns
        times, delays = self._times_ns, self._delays_ns
        after = bisect_right(times, time_ns)
        if after in {0, len(times)}:
            return delays[max(0, after - 1)]
        begin, end = times[after - 1], times[after]
        gained = (delays[after] - delays[after - 1]) * (time_ns - begin)
        return delays[after - 1] + gained // (end - begin)

    def sent_by_ns(self, now_ns: int) -> int:
        """Up to when what was sent has arrived by `now_ns`, if nothing overtakes."""
        if self._constant_ns is not None:
            return now_ns - self._constant_ns
        times, delays = self._times_ns, self._delays_ns
        arrivals = self._arrivals_ns
        after = bisect_right(arrivals, now_ns)
        if not after:
            return times[0] - 1  # nothing has arrived
        if after == len(arrivals):
            return now_ns - delays[-1]
        begin, end = arrivals[after - 1], arrivals[after]
        gained = (times[after] - times[after - 1]) * (now_ns - begin)
        return times[after - 1] + gained // (end - begin)

    def sent_ns(self, arrival_ns: int) -> int:
        """The earliest time of sending from which a frame arrives at `arrival_ns` or later."""
        if self._constant_ns is not None:
            return arrival_ns - self._constant_ns
        early, late = arrival_ns - max(self._delays_ns) - 1, arrival_ns
        while late - early > 1:
            middle = (early + late) // 2
            if middle + self.at(middle) < arrival_ns:
                early = middle
            else:
                late = middle
        return late


class _Contacts:
    """When one direction is open for sending, and its delay and rate."""

    def __init__(self, one_way: OneWay, closed: Iterable[Span], delay: Delay) -> None:
        self.delay = delay
        self._rate = planning_rate(one_way)
        self._overhead_byte = one_way.overhead_byte
        idle = [] if self._rate is None else self._rate.idle()
        spans: list[Span] = []
        for begin_ns, end_ns in sorted([*closed, *idle]):
            if spans and begin_ns <= spans[-1][1]:
                spans[-1] = spans[-1][0], max(end_ns, spans[-1][1])
            else:
                spans.append((begin_ns, end_ns))
        self._begins_ns = [begin_ns for begin_ns, _ in spans]
        self._ends_ns = [end_ns for _, end_ns in spans]
        gaps = (after - before for (_, before), (after, _) in pairwise(spans))
        self._open_before_ns = list(accumulate(gaps, initial=0))

    def opens_ns(self, time_ns: int) -> int:
        last = bisect_right(self._begins_ns, time_ns) - 1
        return max(time_ns, self._ends_ns[last]) if last >= 0 else time_ns

    def closes_ns(self, time_ns: int) -> int:
        after = bisect_right(self._begins_ns, self.opens_ns(time_ns))
        return self._begins_ns[after] if after < len(self._begins_ns) else NEVER_NS

    def sending_ns(self, time_ns: int, size_byte: int) -> int:
        """How long a frame takes to leave, at the rate of the moment at which it starts."""
        rate = None if self._rate is None else self._rate.at(time_ns)
        if not rate:
            return 0
        return -int(-(size_byte + self._overhead_byte) * 8 * NS_PER_S // rate)

    def open_ns_until(self, time_ns: int) -> int:
        """Open time since the first closing; negative before it."""
        if not self._begins_ns:
            return time_ns
        last = bisect_right(self._begins_ns, time_ns) - 1
        if last < 0:
            return time_ns - self._begins_ns[0]
        return self._open_before_ns[last] + max(0, time_ns - self._ends_ns[last])

    def after_open_ns(self, open_ns: int) -> int:
        """The inverse of `open_ns_until`: the first moment with this much open time behind it."""
        if not self._begins_ns:
            return open_ns
        last = bisect_right(self._open_before_ns, open_ns - 1) - 1
        if last < 0:
            return self._begins_ns[0] + open_ns
        return min(NEVER_NS, self._ends_ns[last] + open_ns - self._open_before_ns[last])


class Schedule:
    """Light times, rates and contacts as both ends know them: all but unforeseen outages.

    Every query takes logarithmic time. All times are those of sending. Outages are at the rover's
    end, so the uplink is closed whenever what is sent would arrive there during one.

    Args:
        config: the resolved link.

    Attributes:
        is_direct: whether frames go from end to end, not by way of other nodes.
    """

    def __init__(self, config: LinkConfig) -> None:
        self.is_direct = config.routing is None
        self._contacts: dict[Direction, _Contacts] = {}
        for direction in Direction:
            delay = Delay(config.way(direction))
            # Not `outages_of`: there a blackout would hide the foreseen outages that it overlaps.
            closed = [
                one.span_ns
                for one in config.blackouts
                if one.reason.is_foreseen and one.direction.includes(direction)
            ]
            if direction is Direction.UP:
                closed = [(delay.sent_ns(begin), delay.sent_ns(end)) for begin, end in closed]
            self._contacts[direction] = _Contacts(config.way(direction), closed, delay)

    def delay_ns(self, direction: Direction, time_ns: int) -> int:
        """Light time of what is sent at `time_ns`, in nanoseconds."""
        return self._contacts[direction].delay.at(time_ns)

    def sent_by_ns(self, direction: Direction, now_ns: int) -> int:
        """Up to when what was sent has arrived by `now_ns`.

        On a direct link by the light time of now, which changes little in the time of one; on a way
        by other nodes, where frames wait and then arrive all at once, exactly.
        """
        if self.is_direct:
            return now_ns - self.delay_ns(direction, now_ns)
        return self._contacts[direction].delay.sent_by_ns(now_ns)

    def is_heard(self, direction: Direction, now_ns: int) -> bool:
        """Whether by plan anything can arrive now."""
        sent_ns = self.sent_by_ns(direction, now_ns)
        if self.opens_ns(direction, sent_ns) > sent_ns:
            return False
        if self.is_direct:
            return True
        return abs(sent_ns + self.delay_ns(direction, sent_ns) - now_ns) <= 1

    def unheard_ns(self, direction: Direction, heard_ns: int, now_ns: int) -> int:
        """For how long something could have arrived between two moments, by plan."""
        if self.is_direct:
            # By the light time of now: it changes too little during a silence to matter here.
            light_ns = self.delay_ns(direction, now_ns)
            return self.open_ns_between(direction, heard_ns - light_ns, now_ns - light_ns)
        sent_ns = self.sent_by_ns(direction, heard_ns), self.sent_by_ns(direction, now_ns)
        due_ns = self._due_ns(direction, heard_ns)
        return max(0, min(self.open_ns_between(direction, *sent_ns), now_ns - due_ns))

    def unheard_until_ns(
        self, direction: Direction, heard_ns: int, silence_ns: int, now_ns: int
    ) -> int:
        """When something could have arrived for `silence_ns` since `heard_ns`, as known now.

        `NEVER_NS` or later if never.
        """
        if not self.is_direct:
            return self._due_ns(direction, heard_ns) + silence_ns
        light_ns = self.delay_ns(direction, now_ns)
        heard_ns = max(heard_ns, light_ns)
        sent_ns = self.after_open_ns(direction, heard_ns - light_ns, silence_ns)
        return NEVER_NS if sent_ns >= NEVER_NS else sent_ns + light_ns

    def _due_ns(self, direction: Direction, heard_ns: int) -> int:
        """When by plan something arrives next after `heard_ns`."""
        opens_ns = self.opens_ns(direction, self.sent_by_ns(direction, heard_ns) + 1)
        return min(NEVER_NS, opens_ns + self.delay_ns(direction, opens_ns))

    def opens_ns(self, direction: Direction, time_ns: int) -> int:
        """The first moment from `time_ns` on at which `direction` is open."""
        return self._contacts[direction].opens_ns(time_ns)

    def closes_ns(self, direction: Direction, time_ns: int) -> int:
        """The end of the contact at `time_ns`, or of the next one if there is none then."""
        return self._contacts[direction].closes_ns(time_ns)

    def open_ns_between(self, direction: Direction, begin_ns: int, end_ns: int) -> int:
        """For how long `direction` is open for sending between two moments."""
        contacts = self._contacts[direction]
        return contacts.open_ns_until(end_ns) - contacts.open_ns_until(begin_ns)

    def after_open_ns(self, direction: Direction, time_ns: int, open_ns: int) -> int:
        """The moment at which `direction` has been open for `open_ns` since `time_ns`."""
        contacts = self._contacts[direction]
        return max(time_ns, contacts.after_open_ns(contacts.open_ns_until(time_ns) + open_ns))

    def sending_ns(self, direction: Direction, time_ns: int, size_byte: int) -> int:
        """How long a frame that begins to be sent at `time_ns` takes to leave."""
        return self._contacts[direction].sending_ns(time_ns, size_byte)

    def sends_ns(self, direction: Direction, time_ns: int, size_byte: int) -> Span:
        """When the first and the last bit of a frame that is ready at `time_ns` would leave.

        The frame waits for the first contact in which it can leave whole, and for no other frame.
        Both are `NEVER_NS` or later if no contact is long enough.
        """
        contacts = self._contacts[direction]
        begin_ns = contacts.opens_ns(time_ns)
        while begin_ns < NEVER_NS:
            end_ns = begin_ns + contacts.sending_ns(begin_ns, size_byte)
            closes_ns = contacts.closes_ns(begin_ns)
            if end_ns < closes_ns:
                return begin_ns, end_ns
            begin_ns = contacts.opens_ns(closes_ns)
        return begin_ns, begin_ns
