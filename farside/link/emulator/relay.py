"""The Zenoh side of the stand-alone emulator: between two domains, on a wall clock.

A message comes out under the key that it came in under, with its encoding, attachment, priority,
timestamp and kind (put or delete). It goes on with congestion control `BLOCK`, so that none is lost
but by the link: what the far side cannot take makes the emulator wait.

A key may pass both ways. What the relay itself puts into a domain it never takes from there again,
so nothing goes round, if the domains have no other way to each other: one network on both sides is
refused.
"""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import NamedTuple

import msgspec
import zenoh

from farside.link.emulator import Emulator
from farside.link.emulator.control import CONTROL_KEY, COUNTERS_KEY, EmulatorState
from farside.link.node import Direction, Role, to_ns, to_s

_LISTEN = "listen/"
_IDLE_NS = to_ns(0.5)

_LEAST_IMPORTANT = 7
"""Zenoh counts priorities from 1, the most important, to 7, the link the other way round."""

_AT_ONCE = 2000
"""Messages taken before those that are due go out: many, for speed, but not for long."""


_Heard = tuple[int, Direction, zenoh.Sample]
"""When a message came, from where to where, and the message. A plain tuple, for speed."""


class _Asked(NamedTuple):
    """A question, and what gives the answer or raises `ValueError` with one in words."""

    query: zenoh.Query
    answer: Callable[[bytes], EmulatorState]


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
        emulator: Emulator[zenoh.Sample],
    ) -> None:
        if shared := _neighbours(rover) & _neighbours(ground):
            raise ValueError(
                "expected two Zenoh domains that do not know each other, found both sides "
                f"connected to {', '.join(sorted(shared))}"
            )
        self._emulator = emulator
        self._inbox: SimpleQueue[_Heard | _Asked] = SimpleQueue()
        self._far = {Direction.UP: rover, Direction.DOWN: ground}
        self._began_ns = time.monotonic_ns()
        self._hear(ground, Direction.UP, up)
        self._hear(rover, Direction.DOWN, down)
        self._listen(ground, COUNTERS_KEY, lambda _: emulator.state())
        self._listen(ground, CONTROL_KEY, emulator.control)

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

    def run(self, duration_s: float | None = None) -> None:
        """Pass messages on for so long; for ever, where that is `None`."""
        end_ns = None if duration_s is None else self._now_ns() + to_ns(duration_s)
        while end_ns is None or self._now_ns() < end_ns:
            until_ns = self._take(self._patience_s(end_ns))
            for _, direction, payload, sample in self._emulator.advance(until_ns):
                _put(self._far[direction], sample, payload)

    def state(self) -> EmulatorState:
        """Counters and settings now; from any thread."""
        return self._emulator.state()

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
        if waiting > _AT_ONCE and not isinstance(item, _Asked):
            return item[0] - self._began_ns + 1
        return self._now_ns() + 1

    def _take_one(self, item: _Heard | _Asked) -> None:
        if isinstance(item, _Asked):
            with item.query as query:
                _reply(query, item.answer)
            return
        time_ns, direction, sample = item
        self._emulator.send(
            direction,
            time_ns - self._began_ns,
            sample.payload.to_bytes(),
            sample,
            priority=_LEAST_IMPORTANT - int(sample.priority),  # type: ignore[call-overload]
        )


def _neighbours(session: zenoh.Session) -> set[str]:
    info = session.info
    return {str(zid) for zid in (info.zid(), *info.routers_zid(), *info.peers_zid())}


def _reply(query: zenoh.Query, answer: Callable[[bytes], EmulatorState]) -> None:
    payload = b"" if query.payload is None else query.payload.to_bytes()
    try:
        state = answer(payload)
    except ValueError as error:
        query.reply_err(str(error), encoding=zenoh.Encoding.TEXT_PLAIN)
    else:
        encoding = zenoh.Encoding.APPLICATION_JSON
        query.reply(query.key_expr, msgspec.json.encode(state), encoding=encoding)


def _put(far: zenoh.Session, sample: zenoh.Sample, payload: bytes) -> None:
    if sample.kind == zenoh.SampleKind.DELETE:
        far.delete(
            sample.key_expr,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=sample.priority,
            express=sample.express,
            attachment=sample.attachment,
            timestamp=sample.timestamp,
        )
        return
    far.put(
        sample.key_expr,
        payload,
        encoding=sample.encoding,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=sample.priority,
        express=sample.express,
        attachment=sample.attachment,
        timestamp=sample.timestamp,
    )
