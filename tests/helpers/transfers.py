"""A sender and a receiver of the reliable service, and a link that a test controls."""

import heapq
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

from farside.frames import OutageReason
from farside.link import Blackout, LinkConfig, OneWay
from farside.link.endpoint.receiver import ReliableReceiver
from farside.link.endpoint.segments import ReceptionReport, decode_part
from farside.link.endpoint.sender import ReliableSender
from farside.link.endpoint.transfer import TransferConfig
from farside.link.profile.schedule import Schedule
from farside.node import Direction, to_ns

UP, DOWN = Direction.UP, Direction.DOWN
GOOD = (0.0,)
LOST = ()
SMALL = TransferConfig(segment_byte=64, window=16, margin_s=1.0, spare=0.0)


@cache
def link(
    delay_s: float = 1.3,
    rate_bit_s: int | None = 8000,
    passes: int = 0,
    *,
    pass_s: int = 20,
    period_s: int = 100,
) -> Schedule:
    between = (
        Blackout(start_s=n * period_s + pass_s, end_s=(n + 1) * period_s, reason=OutageReason.PASS)
        for n in range(passes)
    )
    one_way = OneWay(delay_s=delay_s, rate_bit_s=rate_bit_s)
    return Schedule(LinkConfig(up=one_way, down=one_way, blackouts=tuple(between)))


class Pair:
    """A sender and a receiver, and between them a link that the test controls.

    Each frame takes the next of `fates`: the seconds by which its copies are late, none if it is
    lost. When they are used up, every frame arrives in time.
    """

    def __init__(
        self,
        schedule: Schedule,
        fates: Sequence[tuple[float, ...]] = (),
        config: TransferConfig = SMALL,
        *,
        in_order: bool = True,
    ) -> None:
        self.schedule, self.config = schedule, config
        self.sender = ReliableSender(DOWN, schedule, config)
        self.receiver = ReliableReceiver(DOWN, schedule, config, in_order=in_order)
        self.now_ns = 0
        self.delivered: list[bytes] = []
        self.sent: list[tuple[int, int]] = []
        self.reported: list[int] = []
        self._fates = iter(fates)
        self._arriving: list[tuple[int, int, bytes]] = []
        self._count = 0

    def run(self, messages: Sequence[bytes] = (), until_s: float = 1e6) -> None:
        """Offer the messages as there is room, until nothing is left to do."""
        waiting = list(reversed(messages))
        while self.now_ns < to_ns(until_s):
            self._hear()
            while waiting and len(waiting[-1]) <= self.sender.room * self.config.segment_byte:
                if not self.sender.room:
                    break
                self.sender.offer(waiting.pop())
            self._say()
            self._expect_bounds()
            events = [self.sender.next_ns(self.now_ns), self.receiver.next_ns()]
            due = [time_ns for time_ns in events if time_ns is not None]
            due += [entry[0] for entry in self._arriving[:1]]
            if not due:
                return
            assert min(due) > self.now_ns or self._arriving, "what is due has been done"
            self.now_ns = min(due)

    def again(self) -> list[int]:
        """The times between successive transmissions of the same segment, for all segments."""
        times: dict[int, list[int]] = {}
        for number, time_ns in self.sent:
            times.setdefault(number, []).append(time_ns)
        return [later - sooner for each in times.values() for sooner, later in pairwise(each)]

    def _hear(self) -> None:
        while self._arriving and self._arriving[0][0] <= self.now_ns:
            part = decode_part(heapq.heappop(self._arriving)[2])
            if isinstance(part, ReceptionReport):
                self.sender.receive(part, self.now_ns)
            else:
                self.delivered += self.receiver.receive(part, self.now_ns)

    def _say(self) -> None:
        while sending := self.sender.take(self.now_ns):
            self.sent.append((sending.number, self.now_ns))
            self._put(DOWN, sending.payload)
        for payload in self.receiver.take(self.now_ns):
            assert len(payload) <= self.config.segment_byte
            self.reported.append(self.now_ns)
            self._put(UP, payload)

    def _put(self, direction: Direction, payload: bytes) -> None:
        begin_ns, end_ns = self.schedule.sends_ns(direction, self.now_ns, len(payload))
        assert begin_ns == self.now_ns, "nothing is sent while the schedule says closed"
        arrival_ns = end_ns + self.schedule.delay_ns(direction, end_ns)
        for late_s in next(self._fates, GOOD):
            heapq.heappush(self._arriving, (arrival_ns + to_ns(late_s), self._count, payload))
            self._count += 1

    def _expect_bounds(self) -> None:
        window = self.config.window
        assert len(self.sender._held) <= window
        assert len(self.sender._retransmit) <= window
        assert len(self.receiver._beyond) < window
        assert self.receiver._segments_held <= 2 * window


def message(number: int, size_byte: int = 64) -> bytes:
    return number.to_bytes(2, "big") * (size_byte // 2)
