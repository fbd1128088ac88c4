"""The reliable service: messages cut into segments, and reports of which of them have arrived.

Selective repeat for links where a round trip may be longer than a contact. Three rules keep it
from stalling and from storming:

- A segment is sent again only when a report made after it should have arrived does not have it,
  so that nothing is repeated before its answer could have come.
- The moment by which an answer must have come follows from the schedule: the time to leave, the
  light time there, the receiver's interval, the wait for its contact, the light time back. No
  timer runs where there is no contact (as in LTP, RFC 5326), and nothing is sent there.
- Where no answer has come by then, something happened that no schedule foresaw. Segments then go
  out one by one, oldest first, at intervals that double, counted in open time only.

Both ends know the time and the schedule. What they are handed has been checked to be whole.
"""

from collections import OrderedDict, deque
from collections.abc import Sequence
from itertools import islice
from typing import Annotated, NamedTuple

from msgspec import Meta

from farside.link.endpoint.deadlines import Deadlines
from farside.link.endpoint.segments import Parts, Report, Segment, Told, encode, reports_on
from farside.link.endpoint.wire import FrameError
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, Direction, to_ns
from farside.settings import Count, NonNegative, Section

_GREATEST_BACKOFF = 16
_REPEATS = 3
_MOST_COPIES = 4
_RESUMED = 8


class TransferConfig(Section, frozen=True):
    """How the reliable service works; the same at both ends.

    Attributes:
        segment_byte: length of a segment's data, and of a report, at most (project default:
            1000). On the way, up to 24 bytes come on top.
        window: how far the newest segment may be ahead of the oldest that has not been answered,
            and how many segments a message may have (project default: 4096). It should hold what
            the rate lets through until the first answer can come.
        margin_s: by how much a segment or an answer may be late, such as through jitter and
            frames that go first (project default: 1 s).
        keeps_on: whether new segments go out although answers are overdue: for a trickle of news,
            which may be heard though the answer is not. Off, nothing new is risked.
        spare: share of all segments that may be sent on top, where what is lost again costs
            another contact (project default: 0.3).
    """

    segment_byte: Annotated[int, Meta(ge=64)] = 1000
    window: Count = 4096
    margin_s: NonNegative = 1.0
    spare: NonNegative = 0.3
    keeps_on: bool = False


class Sending(NamedTuple):
    """A segment to put on the link: its bytes, its number, and how often it has been sent."""

    payload: bytes
    number: int
    attempt: int


class TransferFullError(Exception):
    """A message for which there is no room before more segments have been answered."""


class ReliableSender:
    """The sending end. It paces itself to the rate that the schedule tells.

    Where an answer cannot come within the contact, what was lost is sent in up to four copies,
    one round after the other, as far as half of what is left of `TransferConfig.spare` goes: lost
    again, it would cost another contact.

    Args:
        direction: of the data; reports come from the other one.
        schedule: of the link.
        config: as at the other end.

    Attributes:
        sent: how many segments were put on the link, copies and repeats included.
        offered: how many different segments there were.
    """

    def __init__(
        self, direction: Direction, schedule: Schedule, config: TransferConfig | None = None
    ) -> None:
        self._config = config or TransferConfig()
        self._times = Deadlines(
            direction, schedule, self._config.segment_byte, self._config.margin_s
        )
        self._margin_ns = to_ns(self._config.margin_s)
        self.offered = 0
        self.sent = 0
        self._base = 0  # the oldest segment that has not been answered
        self._fresh = 0  # the oldest segment that has never been sent
        self._held: dict[int, bytes] = {}
        self._attempts: dict[int, int] = {}
        # When each arrives, in order of sending. A dict looks for its first entry in linear time.
        self._flight: OrderedDict[int, int] = OrderedDict()
        self._again: deque[int] = deque()
        self._copies: dict[int, int] = {}  # how often those in `_again` are to be sent
        self._spent = 0
        self._free_ns = 0
        self._heard_ns = 0
        self._overdue: tuple[int, int] | None = None  # when the oldest arrives, and its deadline
        self._probes = 0
        self._probe_ns = 0
        self._holding = False

    @property
    def room(self) -> int:
        """How many more segments can be offered now."""
        return self._config.window - (self.offered - self._base)

    @property
    def is_done(self) -> bool:
        """Whether all that was offered has arrived, and this end knows it."""
        return not self._held

    def offer(self, message: bytes) -> range:
        """Take a message to be sent. Gives the numbers of its segments.

        Raises:
            TransferFullError: if it has more segments than there is `room` for.
        """
        size = self._config.segment_byte
        count = max(1, -(-len(message) // size))
        if count > self.room:
            raise TransferFullError(
                f"expected a message of {self.room} segments of {size} bytes at most, "
                f"found {count}: wait for answers, or widen the window"
            )
        numbers = range(self.offered, self.offered + count)
        for index, number in enumerate(numbers):
            data = message[index * size : (index + 1) * size]
            self._held[number] = encode(Segment(number, index, index == count - 1, data))
        self.offered += count
        return numbers

    def next_ns(self, now_ns: int) -> int | None:
        """When `take` has something next, if no report comes before; `None` if never."""
        first_ns = NEVER_NS
        if not self._is_holding(now_ns) and (number := self._waiting()) is not None:
            first_ns = self._sends_ns(number, now_ns)[0]
        if self._flight:
            probe_ns = max(now_ns, self._deadline_ns(), self._probe_ns)
            if probe_ns < first_ns:
                first_ns = min(first_ns, self._sends_ns(next(iter(self._flight)), probe_ns)[0])
        return first_ns if first_ns < NEVER_NS else None

    def take(self, now_ns: int) -> Sending | None:
        """The segment to put on the link now, if there is one."""
        is_probe = self._is_silent(now_ns) and self._probe_ns <= now_ns
        if is_probe:
            number: int | None = next(iter(self._flight))
        else:
            number = None if self._is_holding(now_ns) else self._waiting()
        if number is None:
            return None
        begin_ns, end_ns = self._sends_ns(number, now_ns)
        if begin_ns > now_ns:
            return None
        if is_probe:
            self._back_off(now_ns)
        else:
            self._use_up(number)
        return self._send(number, end_ns)

    def receive(self, report: Report, now_ns: int) -> None:
        """Take a report that arrived at `now_ns`.

        Raises:
            FrameError: if it tells of segments that were never sent, or of the future.
        """
        told = Told(report)
        if told.end > self._fresh or report.made_ns > now_ns + self._margin_ns:
            raise FrameError(
                f"expected a report of {self._fresh} segments by {now_ns} ns, "
                f"found {told.end} by {report.made_ns} ns"
            )
        if report.made_ns > self._heard_ns:
            self._heard_ns = report.made_ns
            self._probes, self._probe_ns = 0, 0
        lost = self._settle(told, report.made_ns)
        while self._base < self.offered and self._base not in self._held:
            self._base += 1
        self._repeat(lost, now_ns)

    def resume(self, now_ns: int) -> None:
        """The other end was heard after a silence: do not wait for the next probe.

        The oldest segments whose answer is overdue go out again, eight at most.
        """
        if not self._is_silent(now_ns):
            return
        self._probes, self._probe_ns, self._holding = 0, 0, False
        lost = list(islice(self._flight, _RESUMED))
        for number in lost:
            del self._flight[number]
        self._repeat(lost, now_ns)

    def _settle(self, told: Told, made_ns: int) -> list[int]:
        """Let go of what has arrived. Gives what should have and has not."""
        arrived = [number for number in self._copies if told.has(number)]
        lost = []
        for number, arrives_ns in self._flight.items():
            if arrives_ns > made_ns:
                break
            has = told.has(number)
            if has:
                arrived.append(number)
            elif has is False and arrives_ns + self._margin_ns <= made_ns:
                lost.append(number)
        for number in arrived:
            self._held.pop(number, None)
            self._flight.pop(number, None)
            self._attempts.pop(number, None)
        for number in lost:
            del self._flight[number]
        return lost

    def _repeat(self, lost: Sequence[int], now_ns: int) -> None:
        extra = 0
        if lost and not self._times.is_answered_within_contact(now_ns):
            spare = int(self._config.spare * self.offered) - self._spent
            extra = min(_MOST_COPIES - 1, spare // (2 * len(lost)))
            self._spent += extra * len(lost)
        for number in lost:
            if number not in self._copies:
                self._again.append(number)
            self._copies[number] = 1 + extra

    def _waiting(self) -> int | None:
        """The segment whose turn it is."""
        while self._again and self._again[0] not in self._held:
            del self._copies[self._again.popleft()]
        if self._again:
            return self._again[0]
        return self._fresh if self._fresh < self.offered else None

    def _use_up(self, number: int) -> None:
        if number == self._fresh:
            self._fresh += 1
            return
        self._again.popleft()
        self._copies[number] -= 1
        if self._copies[number]:
            self._again.append(number)
        else:
            del self._copies[number]

    def _send(self, number: int, end_ns: int) -> Sending:
        self._free_ns = end_ns
        self._flight.pop(number, None)
        self._flight[number] = self._times.arrives_ns(end_ns)
        self._attempts[number] = attempt = self._attempts.get(number, 0) + 1
        self.sent += 1
        return Sending(self._held[number], number, attempt)

    def _sends_ns(self, number: int, time_ns: int) -> tuple[int, int]:
        return self._times.sends_ns(max(time_ns, self._free_ns), len(self._held[number]))

    def _deadline_ns(self) -> int:
        """When the answer to the oldest in flight must have come."""
        arrives_ns = next(iter(self._flight.values()))
        if self._overdue is None or self._overdue[0] != arrives_ns:
            self._overdue = arrives_ns, self._times.answer_ns(arrives_ns)
        return self._overdue[1]

    def _is_silent(self, now_ns: int) -> bool:
        return bool(self._flight) and self._deadline_ns() <= now_ns

    def _is_holding(self, now_ns: int) -> bool:
        return self._holding and not self._config.keeps_on and self._is_silent(now_ns)

    def _back_off(self, now_ns: int) -> None:
        self._probe_ns = self._times.backoff_ns(now_ns, min(2**self._probes, _GREATEST_BACKOFF))
        self._probes += 1
        # Where no answer can come before the contact ends, nothing is gained by waiting for it.
        self._holding = self._times.is_answered_within_contact(now_ns)


class ReliableReceiver:
    """The receiving end.

    It reports a while after anything arrives, also if it had that before, since the sender then
    does not know. It says so three more times, in open time and at intervals that
    double, in case the report is lost.

    Args:
        direction: of the data; reports go the other way.
        schedule: of the link.
        config: as at the other end.
        in_order: whether a message waits for those offered before it.

    Attributes:
        duplicates: how many segments arrived that were here already.
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
        self._beyond: set[int] = set()  # those that have, after it
        self._parts: dict[int, Parts] = {}  # of each message, by its first segment
        self._parts_held = 0
        self._whole: dict[int, tuple[bytes, int]] = {}  # messages to come later in order
        self._turn = 0  # first segment of the message whose turn it is
        self._due_ns: int | None = None
        self._has_news = False
        self._repeats = 0

    def receive(self, segment: Segment, now_ns: int) -> list[bytes]:
        """Take a segment that arrived at `now_ns`. Gives the messages that are due now.

        Raises:
            FrameError: if it contradicts what arrived before, or is beyond the window.
        """
        if segment.number < self._base or segment.number in self._beyond:
            self.duplicates += 1
            self._note_news(now_ns)
            return []
        self._check(segment)
        messages = self._assemble(segment)
        self._beyond.add(segment.number)
        while self._base in self._beyond:
            self._beyond.remove(self._base)
            self._base += 1
        self._note_news(now_ns)
        return messages

    def next_ns(self) -> int | None:
        """When a report is due; `None` if there is nothing to tell."""
        return self._due_ns

    def take(self, now_ns: int) -> list[bytes]:
        """The report to put on the link now; in several parts if it is long, empty if not due."""
        if self._due_ns is None or now_ns < self._due_ns:
            return []
        self._due_ns = self._times.report_opens_ns(now_ns)
        if self._due_ns > now_ns:
            return []
        self._repeats = 0 if self._has_news else self._repeats + 1
        self._has_news = False
        self._due_ns = None
        if self._repeats < _REPEATS:
            due_ns = self._times.repeat_ns(now_ns, 2**self._repeats)
            self._due_ns = due_ns if due_ns < NEVER_NS else None
        return [
            encode(report)
            for report in reports_on(self._base, self._beyond, now_ns, self._config.segment_byte)
        ]

    def _note_news(self, now_ns: int) -> None:
        if not self._has_news:
            due_ns = self._times.report_ns(now_ns)
            self._due_ns = min(due_ns, self._due_ns or NEVER_NS)
            self._has_news = True

    def _check(self, segment: Segment) -> None:
        end = self._base + self._config.window
        if segment.number >= end or segment.index > min(segment.number, self._config.window - 1):
            raise FrameError(
                f"expected a segment below {end} of a message of {self._config.window} at most, "
                f"found segment {segment.number} at place {segment.index}"
            )
        if self._parts_held >= 2 * self._config.window:
            raise FrameError(
                f"segment {segment.number}: expected messages that end, found {self._parts_held} "
                f"segments of messages that do not"
            )

    def _assemble(self, segment: Segment) -> list[bytes]:
        first = segment.number - segment.index
        parts = self._parts.get(first) or Parts()
        whole = parts.add(segment)
        self._parts[first] = parts
        self._parts_held += 1
        if whole is None:
            return []
        del self._parts[first]
        message, count = whole
        self._parts_held -= count
        if not self._in_order:
            return [message]
        self._whole[first] = message, first + count
        messages = []
        while self._turn in self._whole:
            message, self._turn = self._whole.pop(self._turn)
            messages.append(message)
        return messages
