"""The Zenoh side of the stand-alone emulator: between two domains, on a wall clock.

A message comes out under the key that it came in under, with its encoding, attachment, priority,
timestamp and kind (put or delete). It goes on with congestion control `BLOCK`, so that none is lost
but by the link: what the far side cannot take makes the emulator wait.

A key may pass both ways. What the relay itself puts into a domain it never takes from there again,
so nothing goes round, if the domains have no other way to each other: one network on both sides is
refused.

Zenoh itself connects again when a connection is lost. Until then, what comes out on that side is
heard by nobody; it is counted, and the loss told at once.
"""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
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

_LISTEN = "listen/"
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
"""Those of Zenoh by that of the frame, which counts from the least important."""

_PRIORITY_OF = {int(priority): number for number, priority in enumerate(_PRIORITIES)}  # type: ignore[call-overload]

_AT_ONCE = 2000
"""Messages taken before those that are due go out: many, for speed, but not for long."""


_MOST_KEPT = 4096

_Value = TypeVar("_Value")

_Heard = tuple[int, Direction, zenoh.Sample]
"""When a message came, from where to where, and the message. A plain tuple, for speed."""


Manner = tuple[
    zenoh.KeyExpr, bool, int, bool, zenoh.Encoding, zenoh.ZBytes | None, zenoh.Timestamp | None
]
"""What belongs to a message besides its payload: key, whether it deletes, priority of its frame,
express, encoding, attachment, timestamp. A sample itself takes twice the memory: it holds on to
the whole batch that it came in."""


class _Asked(NamedTuple):
    """A question, and what gives the answer or raises `ValueError` with one in words."""

    query: zenoh.Query
    answer: Callable[[bytes], EmulatorState]


class _Moved(NamedTuple):
    """Somebody came to a side, or left it."""

    side: "_Side"
    node: str
    came: bool


class _Side:
    """One domain: the session with it, and who is there."""

    def __init__(self, role: Role, session: zenoh.Session) -> None:
        self.role, self.session = role, session
        # Zenoh tells of those who are there already, too.
        self.nodes: set[str] = set()
        self.is_alone = not _others(session)
        self.unheard = 0

    def state(self) -> SideState:
        return SideState(len(self.nodes), self.unheard)


@contextmanager
def open_side(side: Role, locator: str) -> Iterator[zenoh.Session]:
    """A session with the domain on one side, closed at the end.

    Args:
        side: the rover's or the ground's.
        locator: of a router or peer to connect to, such as `tcp/192.0.2.1:7447`; with `listen/`
            before it, where to be a router that others connect to.

    Raises:
        ConnectionError: if nobody is there, or the address cannot be listened on.
    """
    listen_at = locator.removeprefix(_LISTEN)
    if listen_at != locator:
        settings: dict[str, object] = {"mode": "router", "listen/endpoints": [listen_at]}
        failure = f"expected a free address to listen on for the {side} side, found {listen_at}"
    else:
        settings = {
            "mode": "client",
            "connect/endpoints": [locator],
            "connect/timeout_ms": 0,
            "connect/exit_on_failure": True,
        }
        failure = f"expected a Zenoh router or peer of the {side} side at {locator}, found none"
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        session = zenoh.open(config)
    except zenoh.ZError as error:
        reason = str(error).partition(" at /")[0].strip()
        raise ConnectionError(f"{failure}: {reason}") from error
    with session:
        yield session


class Relay:
    """Takes messages from either domain, and puts them into the other when the link says so.

    Args:
        rover, ground: sessions with the two domains.
        up: key expressions that pass from the ground to the rover.
        down: those that pass the other way.
        emulator: the link.
        tell: is told in words when nobody is left on a side, and when somebody is there again.

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
        emulator: Emulator[Manner],
        tell: Callable[[str], None],
    ) -> None:
        if shared := _neighbours(rover) & _neighbours(ground):
            raise ValueError(
                "expected two Zenoh domains that do not know each other, found both sides "
                f"connected to {', '.join(sorted(shared))}"
            )
        self._emulator = emulator
        self._tell = tell
        self._keys: dict[zenoh.KeyExpr, zenoh.KeyExpr] = {}
        self._encodings: dict[zenoh.Encoding, zenoh.Encoding] = {}
        self._inbox: SimpleQueue[_Heard | _Asked | _Moved] = SimpleQueue()
        self._rover, self._ground = _Side(Role.ROVER, rover), _Side(Role.GROUND, ground)
        self._far = {Direction.UP: self._rover, Direction.DOWN: self._ground}
        self._began_ns = time.monotonic_ns()
        self._hear(ground, Direction.UP, up)
        self._hear(rover, Direction.DOWN, down)
        self._listen(ground, COUNTERS_KEY, lambda _: self.state())
        self._listen(ground, CONTROL_KEY, self._control)
        self._watch(self._rover)
        self._watch(self._ground)

    def _hear(
        self, near: zenoh.Session, direction: Direction, keys: Sequence[zenoh.KeyExpr]
    ) -> None:
        for number, key in enumerate(keys):
            before = [other for other in keys[:number] if other.intersects(key)]
            hear = self._ear(direction, before)
            near.declare_subscriber(key, hear, allowed_origin=zenoh.Locality.REMOTE)

    def _ear(
        self, direction: Direction, heard_already: Sequence[zenoh.KeyExpr]
    ) -> Callable[[zenoh.Sample], None]:
        clock, put = time.monotonic_ns, self._inbox.put

        def hear(sample: zenoh.Sample) -> None:
            if heard_already and any(key.intersects(sample.key_expr) for key in heard_already):
                return
            put((clock(), direction, sample))

        return hear

    def _listen(
        self, near: zenoh.Session, key: str, answer: Callable[[bytes], EmulatorState]
    ) -> None:
        near.declare_queryable(key, lambda query: self._inbox.put(_Asked(query, answer)))

    def _watch(self, side: _Side) -> None:
        def move(event: zenoh.TransportEvent) -> None:
            came = event.kind == zenoh.SampleKind.PUT
            self._inbox.put(_Moved(side, str(event.transport.zid), came))

        side.session.info.declare_transport_events_listener(move, history=True)

    def run(self, duration_s: float | None = None) -> None:
        """Pass messages on for so long; for ever, where that is `None`."""
        end_ns = None if duration_s is None else self._now_ns() + to_ns(duration_s)
        while end_ns is None or self._now_ns() < end_ns:
            until_ns = self._take(self._patience_s(end_ns))
            for _, direction, payload, manner in self._emulator.advance(until_ns):
                far = self._far[direction]
                if far.is_alone:
                    far.unheard += 1
                _put(far.session, payload, manner)

    def state(self) -> EmulatorState:
        """Counters and settings now; from any thread."""
        sides = {"rover_side": self._rover.state(), "ground_side": self._ground.state()}
        return msgspec.structs.replace(self._emulator.state(), **sides)

    def _control(self, payload: bytes) -> EmulatorState:
        self._emulator.control(payload)
        return self.state()

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._began_ns

    def _patience_s(self, end_ns: int | None) -> float:
        now_ns = self._now_ns()
        moments = (now_ns + _IDLE_NS, self._emulator.next_ns, end_ns)
        return max(0.0, to_s(min(ns for ns in moments if ns is not None) - now_ns))

    def _take(self, patience_s: float) -> int:
        """Wait for something to come in, and take it: up to when all is known that was sent."""
        inbox = self._inbox
        try:
            item = inbox.get(timeout=patience_s)
        except Empty:
            return self._now_ns() + 1
        self._take_one(item)
        waiting = inbox.qsize()
        for _ in range(min(waiting, _AT_ONCE)):
            item = inbox.get()
            self._take_one(item)
        if waiting > _AT_ONCE and not isinstance(item, _Asked | _Moved):
            return item[0] - self._began_ns + 1
        return self._now_ns() + 1

    def _take_one(self, item: _Heard | _Asked | _Moved) -> None:
        if isinstance(item, _Asked):
            with item.query as query:
                _reply(query, item.answer)
            return
        if isinstance(item, _Moved):
            self._move(item)
            return
        time_ns, direction, sample = item
        priority = _PRIORITY_OF[int(sample.priority)]  # type: ignore[call-overload]
        manner = (
            _once(self._keys, sample.key_expr),
            sample.kind == zenoh.SampleKind.DELETE,
            priority,
            sample.express,
            _once(self._encodings, sample.encoding),
            sample.attachment,
            sample.timestamp,
        )
        payload, at_ns = sample.payload.to_bytes(), time_ns - self._began_ns
        self._emulator.send(direction, at_ns, payload, manner, priority=priority)

    def _move(self, moved: _Moved) -> None:
        side = moved.side
        if moved.came:
            side.nodes.add(moved.node)
        else:
            side.nodes.discard(moved.node)
        is_alone = not side.nodes
        if is_alone is not side.is_alone:
            side.is_alone = is_alone
            told = "nobody is connected any more" if side.is_alone else "connected"
            self._tell(f"{side.role} side: {told}")


def _once(kept: dict[_Value, _Value], value: _Value) -> _Value:
    """`value`, or the equal one that others have already: a million messages share few of them."""
    if len(kept) == _MOST_KEPT:
        kept.clear()
    return kept.setdefault(value, value)


def _neighbours(session: zenoh.Session) -> set[str]:
    return {str(session.info.zid()), *_others(session)}


def _others(session: zenoh.Session) -> set[str]:
    return {str(zid) for zid in (*session.info.routers_zid(), *session.info.peers_zid())}


def _reply(query: zenoh.Query, answer: Callable[[bytes], EmulatorState]) -> None:
    payload = b"" if query.payload is None else query.payload.to_bytes()
    try:
        state = answer(payload)
    except ValueError as error:
        query.reply_err(str(error), encoding=zenoh.Encoding.TEXT_PLAIN)
    else:
        encoding = zenoh.Encoding.APPLICATION_JSON
        query.reply(query.key_expr, msgspec.json.encode(state), encoding=encoding)


def _put(far: zenoh.Session, payload: bytes, manner: Manner) -> None:
    key, deletes, priority, express, encoding, attachment, timestamp = manner
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
