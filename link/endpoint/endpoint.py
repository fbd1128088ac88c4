"""The endpoint: a node's end of the link, between its messages and the frames.

A message is packed (MessagePack), cut if it is larger than a frame, numbered and sealed. Its type
decides the service, see `farside.link.endpoint.services`: *expedited*, where only the latest counts
and nothing is retransmitted, or *reliable*, in order and until it has arrived. What is made while
the link is out can wait in a store. When the link is back it is sent by a reliable stream of its
own, below everything else and in what that leaves of the rate.
"""

import heapq
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Generic, NamedTuple, TypeVar

import msgspec

from farside.frames import Carried, FrameEvent, FrameStage
from farside.link.endpoint.fragments import Fragmenter, Reassembler
from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.receiver import ReliableReceiver
from farside.link.endpoint.segments import ReceptionReport, Segment, decode_part
from farside.link.endpoint.sender import ReliableSender, Sending
from farside.link.endpoint.services import SERVICES, Service, carried, part_of
from farside.link.endpoint.stored import StoredStream, StoreState
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import OVERHEAD_BYTE, Flag, FrameError, Opener, Sealer, unpack
from farside.link.profile.config import LinkConfig
from farside.link.profile.schedule import Schedule
from farside.messages import Downlink, Telemetry, Uplink
from farside.node import NEVER_NS, NS_PER_S, Direction, Frame, Journal, Topic
from farside.topics import GROUND_FRAME, ROVER_FRAME

_SEGMENT_OVERHEAD_BYTE = 24
FRAMED_BYTE = OVERHEAD_BYTE + _SEGMENT_OVERHEAD_BYTE
"""By how much the frame of a short reliable message is longer than the message, at most."""
_REASSEMBLY_NS = 600 * NS_PER_S
_SILENCE_NS = 10 * NS_PER_S
_LIVE_SHARE = 0.8  # of the rate for telemetry, so that there is room for all else
_LIVE_SHARE_BESIDE_STORED = 0.5
_BURST_NS = NS_PER_S // 10
_BURST_BYTE = 2048  # what is sent from the store at once must fit into the transmit queue
_STORED_MARGIN_S = 10.0  # what is sent from the store waits for all else

_Out = TypeVar("_Out", bound=msgspec.Struct)
_In = TypeVar("_In", bound=msgspec.Struct)

_encode = msgspec.msgpack.Encoder().encode

_SEGMENT = Service(reliable=True, priority=3)
_REPORT = Service(reliable=True, priority=3)
_STORED = Service(reliable=True, priority=0)
_PLAIN = Flag(0)
_STORED_SEGMENT, _STORED_REPORT = Flag.STORED | Flag.RELIABLE, Flag.STORED | Flag.REPORT


class LinkTerms(NamedTuple):
    """What both ends have agreed on beforehand.

    Attributes:
        key: the mission key.
        schedule: light times, rates and contacts.
        mtu_byte: the longest frame.
        store_byte: capacity of the store at each end.
        light_time_ns: the shortest uplink propagation delay, before which nothing can be heard.
        round_trip_ns: the longest propagation delay both ways.
        heartbeat_ns: interval between the ground's heartbeats.
    """

    key: bytes
    schedule: Schedule
    mtu_byte: int
    store_byte: int
    light_time_ns: int
    round_trip_ns: int
    heartbeat_ns: int = 2 * NS_PER_S

    @classmethod
    def simulated(
        cls, config: LinkConfig, seed: int, heartbeat_ns: int = 2 * NS_PER_S
    ) -> "LinkTerms":
        """The terms of a simulated run, whose key follows from its seed."""
        return cls(
            key=simulated_key(seed),
            schedule=Schedule(config),
            mtu_byte=config.mtu_byte,
            store_byte=config.store_byte,
            light_time_ns=config.up.least_delay_ns,
            round_trip_ns=config.round_trip_ns,
            heartbeat_ns=heartbeat_ns,
        )


class Arrival(NamedTuple, Generic[_In]):
    """A message that has arrived.

    Attributes:
        message: the message.
        size_byte: the length of the frame that completed it.
        stored: whether it waited in the other end's store.
    """

    message: _In
    size_byte: int
    stored: bool


def telemetry_interval_ns(
    schedule: Schedule, now_ns: int, size_byte: int, *, beside_stored: bool
) -> int:
    """The least time between telemetry messages that leaves room for all else on the downlink.

    They take four fifths of the rate, and half of it while stored ones wait (project defaults).

    Args:
        schedule: of the link.
        now_ns: when one is sent.
        size_byte: its length on the link.
        beside_stored: whether stored ones wait.
    """
    begin_ns, end_ns = schedule.sends_ns(Direction.DOWN, now_ns, size_byte)
    return int((end_ns - begin_ns) / (_LIVE_SHARE_BESIDE_STORED if beside_stored else _LIVE_SHARE))


class Endpoint(Generic[_Out, _In]):
    """Turns messages into frames of one direction, and arriving frames into messages.

    Args:
        outgoing: the direction in which this end sends.
        decoder: for the messages that arrive.
        terms: agreed on with the other end.
        journal: the journal of the node.
        topic: where this end records what it does with frames.

    Attributes:
        in_shadow: whether terrain hides the other end now: what is sent or arrives is then lost.
        heard_ns: when a genuine frame last arrived; `None` before the first.
    """

    def __init__(
        self,
        outgoing: Direction,
        decoder: msgspec.msgpack.Decoder[_In],
        terms: LinkTerms,
        journal: Journal,
        topic: Topic[FrameEvent],
    ) -> None:
        incoming = outgoing.opposite
        transfer = TransferConfig(
            segment_byte=terms.mtu_byte - OVERHEAD_BYTE - _SEGMENT_OVERHEAD_BYTE, keeps_on=True
        )
        self.in_shadow = False
        self.heard_ns: int | None = None
        self._outgoing = outgoing
        self._decoder = decoder
        self._schedule = terms.schedule
        self._journal, self._topic = journal, topic
        self._sealer = Sealer(terms.key, outgoing)
        self._opener = Opener(terms.key, incoming, relayed=not terms.schedule.is_direct)
        self._fragmenter = Fragmenter(terms.mtu_byte)
        self._reassembler = Reassembler(_REASSEMBLY_NS)
        self._sender = ReliableSender(outgoing, terms.schedule, transfer)
        self._receiver = ReliableReceiver(incoming, terms.schedule, transfer)
        self._segment_byte = transfer.segment_byte
        self._backlog: deque[tuple[bytes, Carried]] = deque()
        self._wake_ns = 0
        stored = TransferConfig(
            segment_byte=transfer.segment_byte, margin_s=_STORED_MARGIN_S, repeats=1
        )
        self._stored = StoredStream(outgoing, terms.schedule, stored, terms.store_byte)
        self._stored_receiver = ReliableReceiver(incoming, terms.schedule, stored)
        self._telemetry_byte = 0
        self._busy_ns = 0  # until then the transmitter sends what it was given so far
        self._outbox: list[Frame] = []
        self._inbox: list[tuple[int, int, int, Frame]] = []
        self._expected = 0

    # --- out -----------------------------------------------------------------------------------

    def send(self, message: _Out, now_ns: int) -> None:
        """Send `message` by its service."""
        service = SERVICES[type(message)]
        payload = _encode(message)
        if service.reliable:
            self._backlog.append((payload, carried(message)))
            self._wake_ns = now_ns
            self.pump(now_ns)
        else:
            if isinstance(message, Telemetry):
                self._telemetry_byte = len(payload) + OVERHEAD_BYTE
            self._send(payload, message, now_ns, service)

    def store(self, message: _Out, made_ns: int) -> int:
        """Keep `message` for when the link returns; returns how many stored ones were dropped."""
        return self._stored.keep(_encode(message), made_ns, SERVICES[type(message)].priority)

    @property
    def store_state(self) -> StoreState:
        """What has become of the messages that were stored."""
        return self._stored.state

    def send_aside(self, message: _Out, now_ns: int) -> bool:
        """Have `message` sent by `forward` before what is stored; false if it is too long.

        For what can be made anew at any time: it takes the place of the last one if that has not
        begun to be sent, and none of the store. It has arrived once the other end says so.
        """
        return self._stored.put_aside(_encode(message), type(message).__name__, now_ns)

    @property
    def aside_waits(self) -> bool:
        """Whether what was last sent aside has not begun to be sent."""
        return self._stored.aside_waits

    def forward(self, now_ns: int) -> None:
        """Send from the store, and repeat what was lost of it, as far as the transmitter is idle.

        To be called often while the link is up.
        """
        most_byte, until_ns = _BURST_BYTE, now_ns + _BURST_NS
        while most_byte > 0 and self._busy_ns <= until_ns:
            taken = self._stored.take(now_ns, until_ns)
            if taken is None:
                return
            sending, what = taken
            most_byte -= len(sending.payload)
            self._put_segment(sending, what, now_ns, _STORED, _STORED_SEGMENT)

    def telemetry_interval_ns(self, now_ns: int) -> int:
        """See the function of this name; of what was last sent, with what waits in the store."""
        waits = self._stored.state.waiting > 0
        return telemetry_interval_ns(
            self._schedule, now_ns, self._telemetry_byte, beside_stored=waits
        )

    def pump(self, now_ns: int) -> None:
        """Let the reliable service send what is due: segments, retransmissions, reports."""
        if now_ns < self._wake_ns:
            return
        sender, receiver = self._sender, self._receiver
        while self._backlog and sender.room >= self._segments(self._backlog[0][0]):
            payload, whole = self._backlog.popleft()
            sender.offer(payload, carries=whole)
        while (sending := sender.take(now_ns)) is not None:
            self._put_segment(sending, sending.text, now_ns, _SEGMENT, Flag.RELIABLE)
        for report in receiver.take(now_ns):
            self._put(report, "report", now_ns, _REPORT, Flag.REPORT)
        for report in self._stored_receiver.take(now_ns):
            self._put(report, "report", now_ns, _REPORT, _STORED_REPORT)
        due_ns = sender.next_ns(now_ns), receiver.next_ns(), self._stored_receiver.next_ns()
        self._wake_ns = min((due for due in due_ns if due is not None), default=NEVER_NS)

    def queued_until_ns(self, now_ns: int) -> int:
        """Until when, by plan, the transmitter sends what it was given so far, all that waits."""
        until_ns = max(now_ns, self._busy_ns)
        waiting = [*self._sender.waiting_byte, *(len(payload) for payload, _ in self._backlog)]
        for size_byte in waiting:
            framed_byte = size_byte + FRAMED_BYTE
            until_ns = self._schedule.sends_ns(self._outgoing, until_ns, framed_byte)[1]
        return until_ns

    def take_sent(self) -> list[Frame]:
        """The frames sent since the last call, in order."""
        sent, self._outbox = self._outbox, []
        return sent

    def _segments(self, payload: bytes) -> int:
        return max(1, -(-len(payload) // self._segment_byte))

    def _send(self, payload: bytes, message: _Out, now_ns: int, service: Service) -> None:
        bodies = self._fragmenter.cut(payload, self._sealer.next_sequence)
        flags = Flag.FRAGMENT if len(bodies) > 1 else _PLAIN
        what, whole = type(message).__name__, carried(message)
        for index, body in enumerate(bodies):
            carries = (part_of(whole, index + 1, len(bodies)),)
            self._put(body, what, now_ns, service, flags, carries=carries)

    def _put_segment(
        self, sending: Sending, what: str, now_ns: int, service: Service, flags: Flag
    ) -> None:
        self._put(sending.payload, what, now_ns, service, flags, carries=sending.carries)

    def _put(
        self,
        body: bytes,
        what: str,
        now_ns: int,
        service: Service,
        flags: Flag,
        *,
        carries: tuple[Carried, ...] = (),
    ) -> None:
        sequence = self._sealer.next_sequence
        wire = self._sealer.seal(body, flags)
        frame = Frame(self._outgoing, sequence, now_ns, wire, service.priority, service.lifetime_ns)
        self._tell(frame, FrameStage.MADE, what, now_ns, flags, carries=carries)
        ready_ns = max(now_ns, self._busy_ns)
        if ready_ns - now_ns <= (service.lifetime_ns or NEVER_NS):  # else it expires in the queue
            begin_ns, end_ns = self._schedule.sends_ns(self._outgoing, ready_ns, len(wire))
            # What is sent outside contacts leaves all the same, and is lost.
            self._busy_ns = ready_ns + end_ns - begin_ns
        if self.in_shadow:
            self._tell(frame, FrameStage.SHADOWED, what, now_ns, flags, carries=carries)
        else:
            self._outbox.append(frame)

    # --- in ------------------------------------------------------------------------------------

    def expect(self, frames: Iterable[Frame]) -> None:
        """Take frames that will arrive, to be received when they are due."""
        for frame in frames:
            self._expected += 1
            heapq.heappush(self._inbox, (frame.time_ns, frame.sequence, self._expected, frame))

    def received(self, now_ns: int) -> Iterator[Arrival[_In]]:
        """The messages that have arrived by `now_ns`, in order of arrival.

        Anything but a genuine frame of the other end is refused, which is only recorded.
        """
        while self._inbox and self._inbox[0][0] <= now_ns:
            frame = heapq.heappop(self._inbox)[-1]
            if self.in_shadow:
                self._tell(frame, FrameStage.SHADOWED, "", now_ns)
                continue
            try:
                yield from self._open(frame, now_ns)
            except FrameError as error:
                self._tell(frame, FrameStage.REFUSED, error.reason, now_ns)

    def _open(self, frame: Frame, now_ns: int) -> list[Arrival[_In]]:
        """The messages that this frame completes."""
        _, flags, body = self._opener.open(frame.payload)
        self._hear(frame.time_ns)
        self._wake_ns = now_ns
        what = ""
        payloads: list[bytes] = []
        if flags & (Flag.RELIABLE | Flag.REPORT):
            part = decode_part(body)
            what = "segment" if isinstance(part, Segment) else "report"
            payloads = self._take_part(part, frame.time_ns, stored=bool(flags & Flag.STORED))
        else:
            whole = self._reassembler.add(body, now_ns) if flags & Flag.FRAGMENT else body
            what = "fragment"
            if whole is not None:
                payloads.append(whole)
        messages = [unpack(payload, self._decoder) for payload in payloads]
        if messages:
            what = ", ".join(type(message).__name__ for message in messages)
        carries = tuple(map(carried, messages))
        self._tell(frame, FrameStage.USED, what, now_ns, flags, carries=carries)
        stored = bool(flags & Flag.STORED)
        return [Arrival(message, len(frame.payload), stored) for message in messages]

    def _hear(self, arrival_ns: int) -> None:
        if self.heard_ns is not None and arrival_ns - self.heard_ns >= _SILENCE_NS:
            self._sender.resume(arrival_ns)
            self._stored.resume(arrival_ns)
        self.heard_ns = arrival_ns

    def _take_part(
        self, part: Segment | ReceptionReport, arrival_ns: int, *, stored: bool
    ) -> list[bytes]:
        if isinstance(part, ReceptionReport):
            (self._stored if stored else self._sender).receive(part, arrival_ns)
            return []
        receiver = self._stored_receiver if stored else self._receiver
        return receiver.receive(part, arrival_ns)

    def _tell(
        self,
        frame: Frame,
        stage: FrameStage,
        what: str,
        now_ns: int,
        flags: Flag = _PLAIN,
        *,
        carries: tuple[Carried, ...] = (),
    ) -> None:
        event = FrameEvent(
            direction=frame.direction,
            sequence=frame.sequence,
            stage=stage,
            size_byte=len(frame.payload),
            what=what,
            stored=bool(flags & Flag.STORED),
            carries=carries,
        )
        self._journal.note(self._topic, event, log_time_ns=now_ns)


def rover_endpoint(terms: LinkTerms, journal: Journal) -> Endpoint[Downlink, Uplink]:
    """The rover's end: sends down, receives up."""
    return Endpoint(Direction.DOWN, msgspec.msgpack.Decoder(Uplink), terms, journal, ROVER_FRAME)


def ground_endpoint(terms: LinkTerms, journal: Journal) -> Endpoint[Uplink, Downlink]:
    """The ground's end: sends up, receives down."""
    return Endpoint(Direction.UP, msgspec.msgpack.Decoder(Downlink), terms, journal, GROUND_FRAME)
