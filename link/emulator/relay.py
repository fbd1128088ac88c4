"""The Zenoh side of the stand-alone emulator: between two domains, on a wall clock.

A message keeps its key, encoding, attachment, priority, timestamp and kind (put or delete). It is
published with congestion control `BLOCK`, so none is lost except by the link: a slow receiver makes
the emulator wait.

A key may pass both ways. The relay never takes back what it has itself put into a domain, so
nothing loops unless the domains are connected elsewhere; one network on both sides is refused.

Zenoh reconnects by itself when a connection is lost. Until then, what is delivered on that side is
received by nobody; it is counted, and the loss of the connection reported at once.
"""

import time
from collections.abc import Callable, Sequence
from queue import Empty, SimpleQueue
from typing import NamedTuple, TypeVar

import msgspec
import zenoh

from farside.link.emulator import Emulator
from farside.link.emulator.control import (
    CONTROL_KEY,
    COUNTERS_KEY,
    EmulatorState,
    SideState,
)
from farside.node import Direction, Role, to_ns, to_s

_IDLE_NS = to_ns(0.5)

_PRIORITIES = (
    zenoh.Priority.BACKGROUND,
    zenoh.Priority.DATA_LOW,
    zenoh.Priority.DATA,
    zenoh.Priority.DATA_HIGH,
    zenoh.Priority.INTERACTIVE_LOW,
    zenoh.Priority.INTERACTIVE_HIGH,
    zenoh.Priority.REAL_TIME,
)
"""Zenoh's priorities by frame priority, from the lowest."""

_PRIORITY_OF = {int(priority): number for number, priority in enumerate(_PRIORITIES)}  # type: ignore[call-overload]

_MAX_BATCH = 2000
"""Messages taken before those due are delivered: many, for speed, but not for too long."""

_MAX_SHARED = 4096

_Value = TypeVar("_Value")

_Received = tuple[int, Direction, zenoh.Sample]
"""A message: when it was received, its direction, the sample. A plain tuple, for speed."""

Metadata = tuple[
    zenoh.KeyExpr, bool, int, bool, zenoh.Encoding, zenoh.ZBytes | None, zenoh.Timestamp | None
]
"""Everything of a sample but its payload: key, whether it deletes, frame priority, express,
encoding, attachment, timestamp. The sample itself would take twice the memory, since it keeps alive
the whole batch that it was received in."""


class _Request(NamedTuple):
    """A query, and what computes its reply or raises `ValueError` with an error message."""

    query: zenoh.Query
    reply: Callable[[bytes], EmulatorState]


class _ConnectionEvent(NamedTuple):
    """A node connected to a side, or disconnected from it."""

    side: "_Side"
    node: str
    connected: bool


class _Side:
    """One domain: the session with it, and which nodes are connected."""

    def __init__(self, role: Role, session: zenoh.Session) -> None:
        self.role, self.session = role, session
        # Zenoh reports those connected already, too.
        self.nodes: set[str] = set()
        self.is_alone = not _others(session)
        self.unheard = 0

    def state(self) -> SideState:
        return SideState(len(self.nodes), self.unheard)


class Relay:
    """Takes messages from either domain, and publishes them in the other when they arrive.

    Args:
        rover, ground: sessions with the two domains.
        up: key expressions that pass from the ground to the rover.
        down: key expressions that pass the other way.
        emulator: the link.
        notify: called with a message when a side loses its last connection, and when it is
            connected again.

    Raises:
        ValueError: if both sessions are in one network.
    """

    def __init__(
        self,
        rover: zenoh.Session,
        ground: zenoh.Session,
        *,
        up: Sequence[zenoh.KeyExpr],
        down: Sequence[zenoh.KeyExpr],
        emulator: Emulator[Metadata],
        notify: Callable[[str], None],
    ) -> None:
        if shared := _neighbours(rover) & _neighbours(ground):
            raise ValueError(
                "expected two Zenoh domains that do not know each other, found both sides "
                f"connected to {', '.join(sorted(shared))}"
            )
        self._emulator = emulator
        self._notify = notify
        self._keys: dict[zenoh.KeyExpr, zenoh.KeyExpr] = {}
        self._encodings: dict[zenoh.Encoding, zenoh.Encoding] = {}
        self._inbox: SimpleQueue[_Received | _Request | _ConnectionEvent] = SimpleQueue()
        self._rover, self._ground = _Side(Role.ROVER, rover), _Side(Role.GROUND, ground)
        self._far = {Direction.UP: self._rover, Direction.DOWN: self._ground}
        self._began_ns = time.monotonic_ns()
        self._subscribe(ground, Direction.UP, up)
        self._subscribe(rover, Direction.DOWN, down)
        self._serve(ground, COUNTERS_KEY, lambda _: self.state())
        self._serve(ground, CONTROL_KEY, self._control)
        self._watch(self._rover)
        self._watch(self._ground)

    def _subscribe(
        self, near: zenoh.Session, direction: Direction, keys: Sequence[zenoh.KeyExpr]
    ) -> None:
        for number, key in enumerate(keys):
            # What a subscriber before takes as well is not taken twice.
            earlier = [other for other in keys[:number] if other.intersects(key)]
            listener = self._listener(direction, earlier)
            near.declare_subscriber(key, listener, allowed_origin=zenoh.Locality.REMOTE)

    def _listener(
        self, direction: Direction, earlier: Sequence[zenoh.KeyExpr]
    ) -> Callable[[zenoh.Sample], None]:
        clock, put = time.monotonic_ns, self._inbox.put

        def listen(sample: zenoh.Sample) -> None:
            if earlier and any(key.intersects(sample.key_expr) for key in earlier):
                return
            put((clock(), direction, sample))

        return listen

    def _serve(
        self, near: zenoh.Session, key: str, reply: Callable[[bytes], EmulatorState]
    ) -> None:
        near.declare_queryable(key, lambda query: self._inbox.put(_Request(query, reply)))

    def _watch(self, side: _Side) -> None:
        def move(event: zenoh.TransportEvent) -> None:
            connected = event.kind == zenoh.SampleKind.PUT
            self._inbox.put(_ConnectionEvent(side, str(event.transport.zid), connected))

        side.session.info.declare_transport_events_listener(move, history=True)

    def run(self, duration_s: float | None = None) -> None:
        """Pass messages on for `duration_s`, or for ever."""
        end_ns = None if duration_s is None else self._now_ns() + to_ns(duration_s)
        while end_ns is None or self._now_ns() < end_ns:
            until_ns = self._take(self._timeout_s(end_ns))
            for _, direction, payload, metadata in self._emulator.advance(until_ns):
                far = self._far[direction]
                if far.is_alone:
                    far.unheard += 1
                _put(far.session, payload, metadata)

    def state(self) -> EmulatorState:
        """Current counters, outages and settings; may be called from any thread."""
        sides = {"rover_side": self._rover.state(), "ground_side": self._ground.state()}
        return msgspec.structs.replace(self._emulator.state(), **sides)

    def _control(self, payload: bytes) -> EmulatorState:
        self._emulator.control(payload)
        return self.state()

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._began_ns

    def _timeout_s(self, end_ns: int | None) -> float:
        now_ns = self._now_ns()
        moments = (now_ns + _IDLE_NS, self._emulator.next_ns, end_ns)
        return max(0.0, to_s(min(ns for ns in moments if ns is not None) - now_ns))

    def _take(self, timeout_s: float) -> int:
        """Wait for input and take it; returns up to when all that was sent is known."""
        inbox = self._inbox
        try:
            item = inbox.get(timeout=timeout_s)
        except Empty:
            return self._now_ns() + 1
        self._take_one(item)
        waiting = inbox.qsize()
        for _ in range(min(waiting, _MAX_BATCH)):
            item = inbox.get()
            self._take_one(item)
        if waiting > _MAX_BATCH and not isinstance(item, _Request | _ConnectionEvent):
            return item[0] - self._began_ns + 1
        return self._now_ns() + 1

    def _take_one(self, item: _Received | _Request | _ConnectionEvent) -> None:
        if isinstance(item, _Request):
            with item.query as query:
                _reply(query, item.reply)
            return
        if isinstance(item, _ConnectionEvent):
            self._connection_changed(item)
            return
        time_ns, direction, sample = item
        priority = _PRIORITY_OF[int(sample.priority)]  # type: ignore[call-overload]
        metadata = (
            _shared(self._keys, sample.key_expr),
            sample.kind == zenoh.SampleKind.DELETE,
            priority,
            sample.express,
            _shared(self._encodings, sample.encoding),
            sample.attachment,
            sample.timestamp,
        )
        payload, at_ns = sample.payload.to_bytes(), time_ns - self._began_ns
        self._emulator.send(direction, at_ns, payload, metadata, priority=priority)

    def _connection_changed(self, event: _ConnectionEvent) -> None:
        side = event.side
        if event.connected:
            side.nodes.add(event.node)
        else:
            side.nodes.discard(event.node)
        is_alone = not side.nodes
        if is_alone is not side.is_alone:
            side.is_alone = is_alone
            now = "nobody is connected any more" if side.is_alone else "connected"
            self._notify(f"{side.role} side: {now}")


def _shared(kept: dict[_Value, _Value], value: _Value) -> _Value:
    """`value`, or an equal one kept before: a million messages share few different ones."""
    if len(kept) == _MAX_SHARED:
        kept.clear()
    return kept.setdefault(value, value)


def _neighbours(session: zenoh.Session) -> set[str]:
    return {str(session.info.zid()), *_others(session)}


def _others(session: zenoh.Session) -> set[str]:
    return {str(zid) for zid in (*session.info.routers_zid(), *session.info.peers_zid())}


def _reply(query: zenoh.Query, reply: Callable[[bytes], EmulatorState]) -> None:
    payload = b"" if query.payload is None else query.payload.to_bytes()
    try:
        state = reply(payload)
    except ValueError as error:
        query.reply_err(str(error), encoding=zenoh.Encoding.TEXT_PLAIN)
    else:
        encoding = zenoh.Encoding.APPLICATION_JSON
        query.reply(query.key_expr, msgspec.json.encode(state), encoding=encoding)


def _put(far: zenoh.Session, payload: bytes, metadata: Metadata) -> None:
    key, deletes, priority, express, encoding, attachment, timestamp = metadata
    if deletes:
        far.delete(
            key,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=_PRIORITIES[priority],
            express=express,
            attachment=attachment,
            timestamp=timestamp,
        )
        return
    far.put(
        key,
        payload,
        encoding=encoding,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=_PRIORITIES[priority],
        express=express,
        attachment=attachment,
        timestamp=timestamp,
    )
