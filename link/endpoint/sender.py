"""The sending end of the reliable service."""

from collections import OrderedDict, deque
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

from farside.frames import Carried
from farside.link.endpoint.deadlines import Deadlines
from farside.link.endpoint.segments import Coverage, ReceptionReport, Segment, encode_part
from farside.link.endpoint.services import part_of
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import FrameError
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, Direction, to_ns

_MAX_COPIES = 4
_RESUMED = 8


class Sending(NamedTuple):
    """A segment to send now.

    Attributes:
        payload: its bytes.
        number: its number.
        attempt: which attempt this is, from 1.
        carries: the part of a message in it, for the log.
    """

    payload: bytes
    number: int
    attempt: int
    carries: tuple[Carried, ...] = ()

    @property
    def text(self) -> str:
        """What it is, in words for the log."""
        return "segment" if self.attempt == 1 else f"segment, sent {self.attempt} ×"


class TransferFullError(Exception):
    """There is no room in the window for a message until more segments are acknowledged."""


class ReliableSender:
    """Sends segments at the rate in the schedule, and retransmits what reports lack.

    Where a reply cannot come within the contact, lost segments are retransmitted in up to four
    copies each, one round after the other, for another loss would cost another contact. The extra
    copies may use half of what is left of `TransferConfig.spare`.

    Args:
        direction: the direction of the data; reports come from the other one.
        schedule: the schedule of the link.
        config: as at the other end.

    Attributes:
        sent: how many segments were sent, copies and retransmissions included.
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
        self._base = 0  # the oldest segment that is not acknowledged
        self._unsent = 0  # the oldest segment that has never been sent
        self._held: dict[int, bytes] = {}
        self._attempts: dict[int, int] = {}
        self._carried: dict[int, Carried] = {}  # by segment, for the log
        # When each arrives, in order of sending. A plain dict finds its first entry in linear time.
        self._flight: OrderedDict[int, int] = OrderedDict()
        self._retransmit: deque[int] = deque()
        self._copies: dict[int, int] = {}  # how often those in `_retransmit` are still to be sent
        self._extra_copies = 0
        self._free_ns = 0
        self._heard_ns = 0
        # When the oldest arrives, whether it is probed, and its deadline.
        self._oldest: tuple[int, bool, int] | None = None
        self._probes = 0  # ever sent: it does not start over, lest waits repeat themselves
        self._is_probing = False
        self._probe_ns = 0
        self._resumptions = 0  # since the last report
        self._holding = False

    @property
    def room(self) -> int:
        """How many more segments can be offered now."""
        return self._config.window - (self.offered - self._base)

    @property
    def unsent(self) -> int:
        """How many segments offered have never been sent."""
        return self.offered - self._unsent

    @property
    def waiting_byte(self) -> list[int]:
        """The sizes of the segments that are to be sent, or sent again, and have not been yet."""
        again = [number for number in self._retransmit if number in self._held]
        numbers = [*again, *range(self._unsent, self.offered)]
        return [len(self._held[number]) for number in numbers]

    @property
    def acknowledged(self) -> int:
        """The number of the oldest segment that is not acknowledged: all below are."""
        return self._base

    @property
    def is_done(self) -> bool:
        """Whether all segments offered are acknowledged."""
        return not self._held

    def offer(
        self, message: bytes, most_byte: int | None = None, carries: Carried | None = None
    ) -> range:
        """Accept a message to send; returns the numbers of its segments.

        Args:
            message: the message.
            most_byte: the most data in each segment, where that is to be less than usual.
            carries: what the message is, for the log.

        Raises:
            TransferFullError: if it has more segments than there is `room` for.
        """
        size = min(most_byte or self._config.segment_byte, self._config.segment_byte)
        count = max(1, -(-len(message) // size))
        if count > self.room:
            raise TransferFullError(
                f"expected a message of {self.room} segments of {size} bytes at most, "
                f"found {count}: wait for replies, or widen the window"
            )
        numbers = range(self.offered, self.offered + count)
        for index, number in enumerate(numbers):
            data = message[index * size : (index + 1) * size]
            self._held[number] = encode_part(Segment(number, index, index == count - 1, data))
            if carries is not None:
                self._carried[number] = part_of(carries, index + 1, count)
        self.offered += count
        return numbers

    def next_ns(self, now_ns: int) -> int | None:
        """When `take` has a segment next, if no report comes before; `None` if never."""
        first_ns = NEVER_NS
        if not self._is_holding(now_ns) and (number := self._next_number()) is not None:
            first_ns = self._sends_ns(number, now_ns)[0]
        if self._flight:
            probe_ns = max(now_ns, self._deadline_ns(), self._probe_ns)
            if probe_ns < first_ns:
                number = self._probed_number(probe_ns)
                first_ns = min(first_ns, self._sends_ns(number, probe_ns)[0])
        return first_ns if first_ns < NEVER_NS else None

    def take(self, now_ns: int) -> Sending | None:
        """The segment to send now, if there is one."""
        is_probe = self._is_overdue(now_ns) and self._probe_ns <= now_ns
        if is_probe:
            number: int | None = self._probed_number(now_ns)
        else:
            number = None if self._is_holding(now_ns) else self._next_number()
        if number is None:
            return None
        begin_ns, end_ns = self._sends_ns(number, now_ns)
        if begin_ns > now_ns:
            return None
        if not is_probe:
            self._dequeue(number)
            return self._send(number, end_ns)
        sending = self._send(number, end_ns)
        self._wait_after_probe(sending, now_ns)
        return sending

    def receive(self, report: ReceptionReport, now_ns: int) -> None:
        """Process a report that arrived at `now_ns`.

        Raises:
            FrameError: if it covers segments that were never sent, or was made in the future.
        """
        coverage = Coverage(report)
        if coverage.end > self._unsent or report.made_ns > now_ns + self._margin_ns:
            raise FrameError(
                f"expected a report of {self._unsent} segments by {now_ns} ns, "
                f"found {coverage.end} by {report.made_ns} ns"
            )
        if report.made_ns > self._heard_ns:
            self._heard_ns = report.made_ns
            self._is_probing, self._probe_ns = False, 0
            self._resumptions = 0
        lost = self._settle(coverage, report.made_ns)
        while self._base < self.offered and self._base not in self._held:
            self._base += 1
        self._queue_lost(lost, now_ns)

    def resume(self, now_ns: int) -> None:
        """Retransmit at once, since the other end was heard again after a silence.

        Of the segments in flight, the oldest go out again, eight at most, if a reply is overdue.
        A link that is up for less than a round trip is down again when they arrive. So while no
        report comes, only the first, second, fourth, eighth, ... such call does anything: what is
        sent always at the same moment after the link was up must not displace the probes.
        """
        if not self._is_overdue(now_ns):
            return
        self._resumptions += 1
        if self._resumptions & (self._resumptions - 1):
            return
        self._is_probing, self._probe_ns, self._holding = False, 0, False
        lost = list(islice(self._flight, _RESUMED))
        for number in lost:
            del self._flight[number]
        self._queue_lost(lost, now_ns)

    def _settle(self, coverage: Coverage, made_ns: int) -> list[int]:
        """Release the segments that have arrived; returns those that should have but have not."""
        arrived = [number for number in self._copies if coverage.has(number)]
        lost = []
        for number, arrives_ns in self._flight.items():
            has = coverage.has(number)
            if has:  # perhaps long since, though what was sent last is still on its way
                arrived.append(number)
            elif has is False and arrives_ns + self._margin_ns <= made_ns:
                lost.append(number)
        for number in arrived:
            self._held.pop(number, None)
            self._flight.pop(number, None)
            self._attempts.pop(number, None)
            self._carried.pop(number, None)
        for number in lost:
            del self._flight[number]
        return lost

    def _queue_lost(self, lost: Sequence[int], now_ns: int) -> None:
        extra = 0
        if lost and not self._times.reply_fits_contact(now_ns):
            spare = int(self._config.spare * self.offered) - self._extra_copies
            extra = min(_MAX_COPIES - 1, spare // (2 * len(lost)))
            self._extra_copies += extra * len(lost)
        for number in lost:
            if number not in self._copies:
                self._retransmit.append(number)
            self._copies[number] = 1 + extra

    def _next_number(self) -> int | None:
        """The number of the next segment to send: retransmissions first, then new ones."""
        while self._retransmit and self._retransmit[0] not in self._held:
            del self._copies[self._retransmit.popleft()]
        if self._retransmit:
            return self._retransmit[0]
        return self._unsent if self._unsent < self.offered else None

    def _dequeue(self, number: int) -> None:
        if number == self._unsent:
            self._unsent += 1
            return
        self._retransmit.popleft()
        self._copies[number] -= 1
        if self._copies[number]:
            self._retransmit.append(number)
        else:
            del self._copies[number]

    def _send(self, number: int, end_ns: int) -> Sending:
        self._free_ns = end_ns
        self._flight.pop(number, None)
        self._flight[number] = self._times.arrives_ns(end_ns)
        self._attempts[number] = attempt = self._attempts.get(number, 0) + 1
        self.sent += 1
        first = self._carried.get(number)
        carries = () if first is None else (part_of(first, first.part, first.parts, attempt),)
        return Sending(self._held[number], number, attempt, carries)

    def _sends_ns(self, number: int, time_ns: int) -> tuple[int, int]:
        return self._times.sends_ns(max(time_ns, self._free_ns), len(self._held[number]))

    def _deadline_ns(self) -> int:
        """Reply deadline of the oldest segment in flight."""
        arrives_ns = next(iter(self._flight.values()))
        if self._oldest is None or self._oldest[:2] != (arrives_ns, self._is_probing):
            times = self._times
            reply_ns = times.answer_ns if self._is_probing else times.reply_ns
            self._oldest = arrives_ns, self._is_probing, reply_ns(arrives_ns)
        return self._oldest[2]

    def _is_overdue(self, now_ns: int) -> bool:
        return bool(self._flight) and self._deadline_ns() <= now_ns

    def _is_holding(self, now_ns: int) -> bool:
        return self._holding and not self._config.keeps_on and self._is_overdue(now_ns)

    def _probed_number(self, now_ns: int) -> int:
        """What to probe with: what has waited longest, or what is to be delivered first.

        Sparse messages are delivered in order, so the sooner the first of them arrives the better.
        """
        if self._config.keeps_on:
            for number in sorted(self._flight):
                if self._times.answer_ns(self._flight[number]) <= now_ns:
                    return number
        return next(iter(self._flight))

    def _wait_after_probe(self, probe: Sending, now_ns: int) -> None:
        self._is_probing = True
        size_byte, reply_ns = len(probe.payload), self._deadline_ns()
        self._probe_ns = self._times.probe_ns(now_ns, size_byte, reply_ns, self._probes)
        self._probes += 1
        # If no reply can come before the contact ends, nothing is gained by holding new segments.
        self._holding = self._times.reply_fits_contact(now_ns)
