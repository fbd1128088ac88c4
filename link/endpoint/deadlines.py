"""Reply deadlines from the contact schedule."""

from farside.link.profile.schedule import Schedule, Span
from farside.node import NS_PER_S, Direction, to_ns

_LEAST_INTERVAL_NS = NS_PER_S
_INTERVALS_PER_ROUND_TRIP = 64
_SPARSE_INTERVALS = 2  # from one probe to the next, at least
_SPARSE_SENDINGS = 10  # and this many times as long as it takes to leave: a tenth of the rate
_SHORT_BYTE = 64  # a report with few gaps, at most
_GOLDEN = 0x9E3779B97F4A7C15  # the golden section of 2⁶⁴


def scattered(number: int, span_ns: int) -> int:
    """The wait of this number, from 0 up to `span_ns`: as if random, but always the same.

    It is the fractional part of the golden ratio times 0, 1, 3, 6, 10, ..., as a share of the span.
    Waits like these keep time with no period. Those of its plain multiples would: however many
    successive ones are added, the sum is always about the same.
    """
    triangle = number * (number + 1) // 2
    return (triangle * _GOLDEN & 2**64 - 1) * span_ns >> 64


class Deadlines:
    """When data sent in one direction arrives, and when reports on it must have come back.

    Args:
        direction: the direction of the data.
        schedule: the schedule of the link.
        report_byte: size of the longest report.
        margin_s: by how much anything may be late.
    """

    def __init__(
        self, direction: Direction, schedule: Schedule, report_byte: int, margin_s: float
    ) -> None:
        self._there, self._back = direction, direction.opposite
        self._schedule = schedule
        self._margin_ns = to_ns(margin_s)
        self._report_byte = report_byte

    def interval_ns(self, time_ns: int) -> int:
        """How long the receiver collects before it reports: a 64th of a round trip, at least 1 s.

        Both are project defaults.
        """
        there_ns = self._schedule.delay_ns(self._there, time_ns)
        back_ns = self._schedule.delay_ns(self._back, time_ns)
        return max(_LEAST_INTERVAL_NS, (there_ns + back_ns) // _INTERVALS_PER_ROUND_TRIP)

    def sends_ns(self, time_ns: int, size_byte: int) -> Span:
        """When the first and the last bit of a segment that is ready at `time_ns` leave."""
        return self._schedule.sends_ns(self._there, time_ns, size_byte)

    def arrives_ns(self, sent_ns: int) -> int:
        """When a segment whose last bit left at `sent_ns` arrives."""
        return sent_ns + self._schedule.delay_ns(self._there, sent_ns)

    def probe_ns(self, probed_ns: int, size_byte: int, reply_ns: int, number: int) -> int:
        """When the next probe leaves after that of `probed_ns`.

        On average they are two intervals apart, and so far that they take a tenth of the rate
        (project defaults): half of that for certain, and up to as much again, see `scattered`. What
        is probed next leaves no sooner than `reply_ns`; then it waits for up to two intervals, or
        half of the average, more. All is counted in open time.
        """
        there, after_open_ns = self._there, self._schedule.after_open_ns
        sparse_ns = self._sparse_ns(there, probed_ns, size_byte)
        spread_ns = max(_SPARSE_INTERVALS * self.interval_ns(probed_ns), sparse_ns // 2)
        first_ns = max(after_open_ns(there, probed_ns, sparse_ns // 2), reply_ns)
        last_ns = max(
            after_open_ns(there, probed_ns, sparse_ns * 3 // 2),
            after_open_ns(there, first_ns, spread_ns),
        )
        span_ns = self._schedule.open_ns_between(there, first_ns, last_ns)
        return after_open_ns(there, first_ns, scattered(number, span_ns))

    def report_ns(self, news_ns: int, reported_ns: int | None) -> int:
        """When the receiver reports what arrived at `news_ns`: in this contact if possible.

        That is at once, unless it reported less than an interval ago, repeats not counted.
        """
        due_ns = news_ns
        if reported_ns is not None:
            due_ns = max(news_ns, reported_ns + self.interval_ns(reported_ns))
        begin_ns, end_ns = self._report_sends_ns(news_ns)
        last_ns = self._schedule.closes_ns(self._back, news_ns) - 2 * (end_ns - begin_ns) - 1
        if begin_ns == news_ns <= last_ns < due_ns:
            return last_ns
        return self._report_sends_ns(due_ns)[0]

    def repeat_ns(self, reported_ns: int, intervals: int) -> int:
        """When the receiver repeats the report made at `reported_ns`."""
        open_ns = intervals * self.interval_ns(reported_ns)
        due_ns = self._schedule.after_open_ns(self._back, reported_ns, open_ns)
        return self._report_sends_ns(due_ns)[0]

    def sparse_repeat_ns(self, reported_ns: int, size_byte: int, number: int) -> int:
        """When the receiver repeats it again, as sparsely as a sender probes."""
        sparse_ns = self._sparse_ns(self._back, reported_ns, size_byte)
        open_ns = sparse_ns // 2 + scattered(number, sparse_ns)
        due_ns = self._schedule.after_open_ns(self._back, reported_ns, open_ns)
        return self._report_sends_ns(due_ns)[0]

    def as_long_again_ns(self, begin_ns: int, now_ns: int) -> int:
        """When as much open time will have passed since now as now has since `begin_ns`."""
        open_ns = self._schedule.open_ns_between(self._back, begin_ns, now_ns)
        return self._schedule.after_open_ns(self._back, now_ns, open_ns)

    def answer_ns(self, arrives_ns: int) -> int:
        """When a short report on a segment has come, if it is made at once and is not late."""
        end_ns = self._schedule.sends_ns(self._back, arrives_ns, _SHORT_BYTE)[1]
        return end_ns + self._schedule.delay_ns(self._back, end_ns)

    def reply_ns(self, arrives_ns: int) -> int:
        """The reply deadline of a segment: by then even a repeat of a lost report has come."""
        due_ns = arrives_ns + self.interval_ns(arrives_ns)
        repeat_ns = self.repeat_ns(self._report_sends_ns(due_ns)[0], 1)
        end_ns = self._report_sends_ns(repeat_ns)[1]
        return end_ns + self._schedule.delay_ns(self._back, end_ns) + self._margin_ns

    def reply_fits_contact(self, now_ns: int) -> bool:
        """Whether the reply to what is sent next can come before the contact ends."""
        begin_ns, end_ns = self.sends_ns(now_ns, self._report_byte)
        reply_ns = self.reply_ns(self.arrives_ns(end_ns))
        return reply_ns < self._schedule.closes_ns(self._there, begin_ns)

    def report_opens_ns(self, time_ns: int) -> int:
        """The first moment from `time_ns` on at which a report can be sent."""
        return self._report_sends_ns(time_ns)[0]

    def _sparse_ns(self, direction: Direction, time_ns: int, size_byte: int) -> int:
        begin_ns, end_ns = self._schedule.sends_ns(direction, time_ns, size_byte)
        least_ns = _SPARSE_INTERVALS * self.interval_ns(time_ns)
        return max(least_ns, _SPARSE_SENDINGS * (end_ns - begin_ns))

    def _report_sends_ns(self, time_ns: int) -> Span:
        return self._schedule.sends_ns(self._back, time_ns, self._report_byte)
