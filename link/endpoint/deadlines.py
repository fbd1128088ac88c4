"""Reply deadlines from the contact schedule."""

from farside.link.profile.schedule import Schedule, Span
from farside.node import NS_PER_S, Direction, to_ns

_LEAST_INTERVAL_NS = NS_PER_S
_INTERVALS_PER_ROUND_TRIP = 64


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

    def backoff_ns(self, time_ns: int, intervals: int) -> int:
        """The moment at which this many intervals of open time have passed since `time_ns`."""
        open_ns = intervals * self.interval_ns(time_ns)
        return self._schedule.after_open_ns(self._there, time_ns, open_ns)

    def report_ns(self, news_ns: int) -> int:
        """When the receiver reports what arrived at `news_ns`: in this contact if possible."""
        due_ns = news_ns + self.interval_ns(news_ns)
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

    def _report_sends_ns(self, time_ns: int) -> Span:
        return self._schedule.sends_ns(self._back, time_ns, self._report_byte)
