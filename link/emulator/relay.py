"""The Zenoh side of the stand-alone emulator: between two domains, on a wall clock.

A key may pass both ways. The relay never takes back what it has itself put into a domain, so
nothing loops unless the domains are connected elsewhere; one network on both sides is refused.

Zenoh reconnects by itself when a connection is lost. Until then, what is delivered on that side is
received by nobody; it is counted, and the loss of the connection reported at once.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from queue import Empty, SimpleQueue

import msgspec
import zenoh

from farside.link.emulator import Emulator, Kind
from farside.link.emulator.apart import refuse_one_network, watch_apart
from farside.link.emulator.control import (
    CONTROL_KEY,
    COUNTERS_KEY,
    EmulatorState,
    SideState,
)
from farside.link.emulator.crossing.presence import Announcement
from farside.link.emulator.crossing.queries import Answer, End, Queries, Question
from farside.link.emulator.crossing.samples import (
    DEFAULT_PRIORITY,
    PRIORITIES,
    Metadata,
    MetadataReader,
    publish,
    subscribe,
)
from farside.link.emulator.crossing.tokens import Tokens
from farside.link.emulator.renewing import Renewal
from farside.node import Direction, Role, to_ns, to_s

_IDLE_NS = to_ns(0.5)

_MANY = 3
"""After so many messages at once, more are gathered before the next turn (project default): a turn
costs as much as several messages, and keeps the threads that receive from running."""

_GATHER_S = 0.001
"""For how long they are gathered, or until a message is due (project default)."""

_MAX_BATCH = 2000
"""Messages taken before those due are delivered: many, for speed, but not for too long."""

_ANNOUNCEMENT_PRIORITY = len(PRIORITIES) - 1
"""Above all else, as Zenoh's own declarations."""

Cargo = Metadata | Question | Answer | End | Announcement
"""What crosses, but for its payload."""

_Task = Callable[[int], None]
"""Something to do, given the time when it came."""

_Item = tuple[int, Direction, zenoh.Sample | _Task]
"""A sample with the time when it came and its direction, or something else to do. A plain tuple,
for speed."""


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


class _Way:
    """From one side to the other: what is asked and told on `near` is asked and told on `far`."""

    def __init__(
        self,
        direction: Direction,
        emulator: Emulator[Cargo],
        later: Callable[[Callable[[int], None]], None],
        notify: Callable[[str], None],
    ) -> None:
        self.direction, self._emulator = direction, emulator
        self.later, self.notify = later, notify

    def ask(
        self,
        time_ns: int,
        payload: bytes,
        question: Question,
        matters: Callable[[], bool] | None,
    ) -> None:
        """Send a query through the link, until it arrives if it `matters`."""
        self._emulator.send(
            self.direction,
            time_ns,
            payload,
            question,
            priority=DEFAULT_PRIORITY,
            kind=Kind.QUERY,
            matters=matters,
        )

    def least_round_trip_ns(self) -> int:
        """How long a query and its reply take at least."""
        return self._emulator.least_round_trip_ns

    def reply(
        self, time_ns: int, payload: bytes, answer: Answer, matters: Callable[[], bool] | None
    ) -> None:
        """Send a reply back through the link, until it arrives if it `matters`."""
        self._emulator.send(
            self.direction.opposite,
            time_ns,
            payload,
            answer,
            priority=DEFAULT_PRIORITY,
            kind=Kind.REPLY,
            matters=matters,
        )

    def end(self, time_ns: int, end: End, matters: Callable[[], bool]) -> None:
        """Send the end of the replies back through the link, until it arrives."""
        self._emulator.send(
            self.direction.opposite,
            time_ns,
            b"",
            end,
            priority=DEFAULT_PRIORITY,
            kind=Kind.REPLY,
            matters=matters,
        )

    def announce(
        self, time_ns: int, announcement: Announcement, matters: Callable[[], bool]
    ) -> None:
        """Send an announcement through the link, until it arrives."""
        self._emulator.send(
            self.direction,
            time_ns,
            b"",
            announcement,
            priority=_ANNOUNCEMENT_PRIORITY,
            kind=Kind.ANNOUNCEMENT,
            matters=matters,
        )


class Relay:
    """Takes messages from either domain, and publishes them in the other when they arrive.

    Args:
        rover, ground: sessions with the two domains.
        up: key expressions that pass from the ground to the rover.
        down: key expressions that pass the other way.
        emulator: the link.
        notify: called with a message when a side loses its last connection, when it is connected
            again, and when a queue drops a message for the first time.

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
        emulator: Emulator[Cargo],
        notify: Callable[[str], None],
    ) -> None:
        if shared := _neighbours(rover) & _neighbours(ground):
            raise ValueError(
                "expected two Zenoh domains that do not know each other, found both sides "
                f"connected to {', '.join(sorted(shared))}"
            )
        self._emulator = emulator
        self._renewal = Renewal(emulator, notify)
        self._notify = notify
        self._reader = MetadataReader()
        self._inbox: SimpleQueue[_Item] = SimpleQueue()
        self._is_busy = False
        self._rover, self._ground = _Side(Role.ROVER, rover), _Side(Role.GROUND, ground)
        self._far = {Direction.UP: self._rover, Direction.DOWN: self._ground}
        self._began_ns = time.monotonic_ns()
        self._serve(ground, COUNTERS_KEY, lambda _: self.state())
        self._serve(ground, CONTROL_KEY, self._control)
        self._queries: dict[Direction, Queries] = {}
        self._tokens: dict[Direction, Tokens] = {}
        for direction, keys in ((Direction.UP, up), (Direction.DOWN, down)):
            self._cross(direction, keys, [*up, *down])
        for direction in Direction:
            self._tokens[direction].begin(self._tokens[direction.opposite])
        self._watch(self._rover)
        self._watch(self._ground)
        self._mark = watch_apart(rover, ground, lambda: self._later(refuse_one_network))

    def _cross(
        self,
        direction: Direction,
        keys: Sequence[zenoh.KeyExpr],
        asked: Sequence[zenoh.KeyExpr],
    ) -> None:
        """Have whatever crosses in one direction taken: samples, queries, tokens."""
        near, far = self._far[direction.opposite].session, self._far[direction].session
        way = _Way(direction, self._emulator, self._later, self._notify)
        subscribe(
            near,
            [*keys, *_of_advanced(keys, "pub")],
            self._listener(direction),
        )
        queries = Queries(near, far, [*asked, *_of_advanced(asked)], way)
        self._queries[direction] = queries
        others = [key for key in asked if key not in keys]
        tokens = [*keys, *_of_advanced(keys, "pub"), *_of_advanced(others, "sub")]
        opposite = direction.opposite
        self._tokens[direction] = Tokens(
            near,
            far,
            tokens,
            way,
            # Tokens of services over there make queryables for them on this side.
            lambda token, present: self._queries[opposite].service(token, present=present),
        )

    def _listener(self, direction: Direction) -> Callable[[zenoh.Sample], None]:
        clock, put = time.monotonic_ns, self._inbox.put
        return lambda sample: put((clock(), direction, sample))

    def _later(self, task: _Task) -> None:
        self._inbox.put((time.monotonic_ns(), Direction.UP, task))

    def _serve(
        self, near: zenoh.Session, key: str, reply: Callable[[bytes], EmulatorState]
    ) -> None:
        def answer(query: zenoh.Query, _time_ns: int) -> None:
            with query:
                _reply(query, key, reply)

        near.declare_queryable(key, lambda query: self._later(partial(answer, query)))

    def _watch(self, side: _Side) -> None:
        def move(event: zenoh.TransportEvent) -> None:
            connected = event.kind == zenoh.SampleKind.PUT
            node = str(event.transport.zid)
            self._later(lambda _: self._connection_changed(side, node, connected=connected))

        side.session.info.declare_transport_events_listener(move, history=True)

    def run(self, duration_s: float | None = None) -> None:
        """Pass messages on for `duration_s`, or for ever.

        Raises:
            ConnectionError: if both sides turn out to be one network.
        """
        end_ns = None if duration_s is None else self._now_ns() + to_ns(duration_s)
        while end_ns is None or self._now_ns() < end_ns:
            until_ns = self._take(self._timeout_s(end_ns))
            arrived = self._emulator.advance(until_ns)
            for time_ns, direction, payload, cargo in arrived:
                far = self._far[direction]
                if far.is_alone:
                    far.unheard += 1
                if isinstance(cargo, tuple):
                    publish(far.session, payload, cargo)
                else:
                    self._deliver(time_ns, direction, payload, cargo)
            for tokens in self._tokens.values():
                tokens.count(until_ns)
            for warning in self._emulator.take_warnings():
                self._notify(warning)
            self._renewal.step(until_ns)

    def _deliver(
        self,
        time_ns: int,
        direction: Direction,
        payload: bytes,
        cargo: Question | Answer | End | Announcement,
    ) -> None:
        match cargo:
            case Question():
                self._queries[direction].arrive(payload, cargo)
            case Announcement():
                self._tokens[direction].arrive(cargo, time_ns)
            case _:
                self._queries[direction.opposite].receive(payload, cargo, time_ns)

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
        if self._is_busy:
            gathering_s = min(timeout_s, _GATHER_S)
            time.sleep(gathering_s)
            timeout_s -= gathering_s
        try:
            item = inbox.get(timeout=timeout_s)
        except Empty:
            self._is_busy = False
            return self._now_ns() + 1
        self._take_one(item)
        waiting = inbox.qsize()
        self._is_busy = waiting + 1 >= _MANY
        for _ in range(min(waiting, _MAX_BATCH)):
            item = inbox.get()
            self._take_one(item)
        return item[0] - self._began_ns + 1 if waiting > _MAX_BATCH else self._now_ns() + 1

    def _take_one(self, item: _Item) -> None:
        time_ns, direction, sample = item
        at_ns = time_ns - self._began_ns
        if not isinstance(sample, zenoh.Sample):
            sample(at_ns)
            return
        metadata = self._reader.read(sample)
        payload = sample.payload.to_bytes()
        self._emulator.send(direction, at_ns, payload, metadata, priority=metadata[2])

    def _connection_changed(self, side: _Side, node: str, *, connected: bool) -> None:
        if connected:
            side.nodes.add(node)
        else:
            side.nodes.discard(node)
        is_alone = not side.nodes
        if is_alone is not side.is_alone:
            side.is_alone = is_alone
            now = "nobody is connected any more" if side.is_alone else "connected"
            self._notify(f"{side.role} side: {now}")


def _of_advanced(keys: Sequence[zenoh.KeyExpr], whose: str = "") -> list[zenoh.KeyExpr]:
    """Where advanced publishers (`pub`), subscribers (`sub`) or both speak of `keys`."""
    suffix = f"@adv/{whose}/**" if whose else "@adv/**"
    return [key.join(suffix) for key in keys]


def _neighbours(session: zenoh.Session) -> set[str]:
    return {str(session.info.zid()), *_others(session)}


def _others(session: zenoh.Session) -> set[str]:
    return {str(zid) for zid in (*session.info.routers_zid(), *session.info.peers_zid())}


def _reply(query: zenoh.Query, key: str, reply: Callable[[bytes], EmulatorState]) -> None:
    if key == CONTROL_KEY and str(query.key_expr) != key:
        return  # who asks for whatever there is asks for no change
    payload = b"" if query.payload is None else query.payload.to_bytes()
    try:
        state = reply(payload)
    except ValueError as error:
        query.reply_err(str(error), encoding=zenoh.Encoding.TEXT_PLAIN)
    else:
        encoding = zenoh.Encoding.APPLICATION_JSON
        query.reply(key, msgspec.json.encode(state), encoding=encoding)
