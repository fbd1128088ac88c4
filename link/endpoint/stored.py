"""The stored stream: what is sent in what all else leaves of the rate.

Messages wait for it in a bounded store. One more may go ahead of them: what can be made anew at any
time, so that there is no use in a queue of it.
"""

from collections import deque
from typing import NamedTuple

from farside.link.endpoint.segments import ReceptionReport
from farside.link.endpoint.sender import ReliableSender, Sending
from farside.link.endpoint.services import carried_in
from farside.link.endpoint.store import Store
from farside.link.endpoint.transfer import TransferConfig
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, NS_PER_S, Direction

_SEGMENT_NS = NS_PER_S
_LEAST_BYTE = 64


class StoreState(NamedTuple):
    """What has become of the messages that were stored.

    Attributes:
        kept: how many were stored so far.
        given_up: how many of them were dropped since the store was full.
        waiting: how many are not known to have arrived at the other end.
    """

    kept: int
    given_up: int
    waiting: int


class StoredStream:
    """A reliable stream that is fed from a store, and by one message at a time beside it.

    Args:
        direction: in which it sends.
        schedule: of the link.
        config: as at the other end.
        capacity_byte: of the store.

    Attributes:
        aside_waits: whether the message beside the store has not begun to be sent.
    """

    def __init__(
        self, direction: Direction, schedule: Schedule, config: TransferConfig, capacity_byte: int
    ) -> None:
        self._direction, self._schedule, self._config = direction, schedule, config
        self._store = Store(capacity_byte)
        self._sender = ReliableSender(direction, schedule, config)
        self._forwarded: deque[int] = deque()  # the segment after the last of each message
        self._kept = 0
        self._aside, self._aside_kind, self._cut_byte = b"", "", config.segment_byte
        self._aside_segments: deque[range] = deque()
        self.aside_waits = False
        self._wake_ns = 0  # until then there is nothing to send, if nothing happens

    def keep(self, payload: bytes, made_ns: int, priority: int) -> int:
        """Put a message into the store; returns how many were dropped to make room."""
        self._kept += 1
        self._wake_ns = 0
        return len(self._store.add(payload, made_ns, priority))

    def put_aside(self, payload: bytes, kind: str, now_ns: int) -> bool:
        """Have a message sent before those of the store, in place of one that waits so.

        It is cut so short that no segment keeps live telemetry waiting for more than a second.

        Args:
            payload: the message.
            kind: what it is, the same for all.
            now_ns: the present.

        Returns:
            false if it is too long to be sent.
        """
        usual_byte = self._config.segment_byte
        begin_ns, end_ns = self._schedule.sends_ns(self._direction, now_ns, usual_byte)
        fit_byte = usual_byte * _SEGMENT_NS // max(end_ns - begin_ns, 1)
        self._cut_byte = max(_LEAST_BYTE, min(usual_byte, fit_byte))
        if len(payload) > self._cut_byte * self._config.window:
            return False
        self._aside, self._aside_kind, self.aside_waits = payload, kind, True
        self._wake_ns = 0
        return True

    @property
    def state(self) -> StoreState:
        """What has become of the messages that were stored."""
        while self._forwarded and self._forwarded[0] <= self._sender.acknowledged:
            self._forwarded.popleft()
        waiting = len(self._store) + len(self._forwarded)
        return StoreState(self._kept, self._store.dropped, waiting)

    def take(self, now_ns: int, until_ns: int) -> tuple[Sending, str] | None:
        """The segment to send by `until_ns`, and what it is; `None` if there is nothing."""
        if until_ns < self._wake_ns:
            return None
        self._feed()
        at_ns = self._sender.next_ns(now_ns)
        if at_ns is None or at_ns > until_ns:
            self._wake_ns = at_ns or NEVER_NS
            return None
        sending = self._sender.take(at_ns)
        if sending is None:
            return None
        aside = self._aside_segments
        while aside and aside[0].stop <= self._sender.acknowledged:
            aside.popleft()
        is_aside = any(sending.number in segments for segments in aside)
        return sending, f"{self._aside_kind} {sending.text}" if is_aside else sending.text

    def _feed(self) -> None:
        sender = self._sender
        if sender.unsent or not (self.aside_waits or self._store):
            return
        payload = self._aside if self.aside_waits else self._store.next
        cut_byte = self._cut_byte if self.aside_waits else self._config.segment_byte
        if sender.room < -(-len(payload) // cut_byte):
            return
        if self.aside_waits:
            self._aside_segments.append(sender.offer(payload, cut_byte, carried_in(payload)))
            self._aside, self.aside_waits = b"", False
        else:
            numbers = sender.offer(self._store.pop(), carries=carried_in(payload))
            self._forwarded.append(numbers.stop)

    def receive(self, report: ReceptionReport, now_ns: int) -> None:
        """Process a report; see `ReliableSender.receive`."""
        self._wake_ns = 0
        self._sender.receive(report, now_ns)

    def resume(self, now_ns: int) -> None:
        """The other end was heard again; see `ReliableSender.resume`."""
        self._wake_ns = 0
        self._sender.resume(now_ns)
