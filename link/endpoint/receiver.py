"""The receiving end of the reliable service."""

from farside.link.endpoint.deadlines import Deadlines
from farside.link.endpoint.segments import PartialMessage, Segment, encode_part, reception_reports
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import FrameError
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, Direction


class ReliableReceiver:
    """Reassembles messages, and reports which segments have arrived.

    It reports as soon as anything arrives, but once an interval at most. That includes duplicates,
    since a duplicate shows that the sender does not know. In case the report is lost, it repeats it
    some times at intervals that double, counted in open time. After a duplicate, it goes on as
    sparsely as a sender probes, and for as long again as what arrived has been reported already.

    Args:
        direction: the direction of the data; reports go the other way.
        schedule: the schedule of the link.
        config: as at the other end.
        in_order: whether a message is delivered only after all those offered before it.

    Attributes:
        duplicates: how many segments had arrived before.
    """

    def __init__(
        self,
        direction: Direction,
        schedule: Schedule,
        config: TransferConfig | None = None,
        *,
        in_order: bool = True,
    ) -> None:
        self._config = config or TransferConfig()
        self._times = Deadlines(
            direction, schedule, self._config.segment_byte, self._config.margin_s
        )
        self._in_order = in_order
        self.duplicates = 0
        self._base = 0  # the first segment that has not arrived
        self._beyond: set[int] = set()  # those after it that have
        self._partial: dict[int, PartialMessage] = {}  # by the first segment of each
        self._segments_held = 0
        self._waiting: dict[int, tuple[bytes, int]] = {}  # complete, but not yet in order
        self._next = 0  # first segment of the next message in order
        self._due_ns: int | None = None
        self._made_ns: int | None = None  # the last report but for repeats
        self._told_ns: int | None = None  # the first report since a segment arrived that was new
        self._unheard_ns = 0  # until then, the sender is taken not to know
        self._sparse = 0  # sparse repeats ever made
        self._has_news = False
        self._repeats = 0

    def receive(self, segment: Segment, now_ns: int) -> list[bytes]:
        """Process a segment that arrived at `now_ns`; returns the messages now deliverable.

        Raises:
            FrameError: if it contradicts what arrived before, or is beyond the window.
        """
        if segment.number < self._base or segment.number in self._beyond:
            self.duplicates += 1
            if self._told_ns is not None:
                self._unheard_ns = self._times.as_long_again_ns(self._told_ns, now_ns)
            self._note_news(now_ns)
            return []
        self._check(segment)
        messages = self._assemble(segment)
        self._beyond.add(segment.number)
        while self._base in self._beyond:
            self._beyond.remove(self._base)
            self._base += 1
        self._told_ns = None
        self._note_news(now_ns)
        return messages

    def next_ns(self) -> int | None:
        """When a report is due; `None` if there is nothing to report."""
        return self._due_ns

    def take(self, now_ns: int) -> list[bytes]:
        """The reports to send now: several if one would be too long, none if not due."""
        if self._due_ns is None or now_ns < self._due_ns:
            return []
        self._due_ns = self._times.report_opens_ns(now_ns)
        if self._due_ns > now_ns:
            return []
        self._repeats = 0 if self._has_news else self._repeats + 1
        if self._has_news:
            self._has_news, self._made_ns = False, now_ns
        if self._told_ns is None:
            self._told_ns = now_ns
        reports = reception_reports(self._base, self._beyond, now_ns, self._config.segment_byte)
        encoded = [encode_part(report) for report in reports]
        due_ns = self._repeat_ns(now_ns, sum(map(len, encoded)))
        self._due_ns = due_ns if due_ns < NEVER_NS else None
        return encoded

    def _repeat_ns(self, now_ns: int, size_byte: int) -> int:
        if self._repeats < self._config.repeats:
            return self._times.repeat_ns(now_ns, 2**self._repeats)
        if now_ns >= self._unheard_ns:
            return NEVER_NS
        self._sparse += 1
        return self._times.sparse_repeat_ns(now_ns, size_byte, self._sparse)

    def _note_news(self, now_ns: int) -> None:
        if not self._has_news:
            due_ns = self._times.report_ns(now_ns, self._made_ns)
            self._due_ns = min(due_ns, self._due_ns or NEVER_NS)
            self._has_news = True

    def _check(self, segment: Segment) -> None:
        end = self._base + self._config.window
        if segment.number >= end or segment.index > min(segment.number, self._config.window - 1):
            raise FrameError(
                f"expected a segment below {end} of a message of {self._config.window} at most, "
                f"found segment {segment.number} at index {segment.index}"
            )
        if self._segments_held >= 2 * self._config.window:
            raise FrameError(
                f"segment {segment.number}: expected messages that end, "
                f"found {self._segments_held} segments of messages that do not"
            )

    def _assemble(self, segment: Segment) -> list[bytes]:
        first = segment.number - segment.index
        partial = self._partial.get(first) or PartialMessage()
        complete = partial.add(segment)
        self._partial[first] = partial
        self._segments_held += 1
        if complete is None:
            return []
        del self._partial[first]
        message, count = complete
        self._segments_held -= count
        if not self._in_order:
            return [message]
        self._waiting[first] = message, first + count
        messages = []
        while self._next in self._waiting:
            message, self._next = self._waiting.pop(self._next)
            messages.append(message)
        return messages
