"""The link between programs that know nothing of it: the channel with other people's messages.

Without clock and Zenoh, which `farside.link.emulator.relay` adds. Times are nanoseconds since the
start.
"""

import heapq
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from itertools import count
from operator import attrgetter, itemgetter
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec
import numpy as np

from farside.frames import Fate
from farside.link.channel.node import Channel
from farside.link.emulator.control import (
    EmulatorState,
    OutageState,
    WayCounters,
    WayState,
    read_change,
)
from farside.link.emulator.horizon import Ahead, look_ahead
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.profile import Profile
from farside.node import NEVER_NS, Direction, Frame, to_ns, to_s

_COUNT_NS = 20_000_000
"""How often the counters are updated with what does not arrive."""

_NO_ROOM = {Fate.QUEUE_FULL, Fate.STORE_FULL}

AGAIN_NS = to_ns(1.0)
"""How long after it was lost a message is sent again that must arrive (project default)."""

_Cargo = TypeVar("_Cargo")


Delivery = tuple[int, Direction, bytes, _Cargo]
"""A message: time of arrival, direction, payload, perhaps with wrong bits, and its cargo, which is
whatever was sent with it. A plain tuple, for speed."""


class Kind(StrEnum):
    """What is counted apart among the messages: the names of their counters."""

    QUERY = "queries"
    REPLY = "replies"
    ANNOUNCEMENT = "announcements"


class _Outcome(msgspec.Struct, gc=False):
    """The fields of a `FrameFate` that are of interest here."""

    direction: Direction
    sequence: int
    size_byte: int
    fate: Fate
    copy: int = 0
    flipped_bits: int = 0


_time = itemgetter(0)
_time_ns = attrgetter("time_ns")
_parts_of = attrgetter("direction", "sequence", "time_ns", "payload")
_decode_outcome = msgspec.json.Decoder(_Outcome).decode


class _Assured(NamedTuple, Generic[_Cargo]):
    """A message that is sent until it arrives, while it matters."""

    payload: bytes
    cargo: _Cargo
    priority: int
    kind: Kind | None
    matters: Callable[[], bool]


class _Way(Generic[_Cargo]):
    """One direction: the cargo of the frames that have no fate yet, and the counters."""

    def __init__(self) -> None:
        self.cargo: dict[int, _Cargo] = {}
        self.in_flight = 0
        self.counters = WayCounters()
        self.sequence = 0
        self.assured: dict[int, _Assured[_Cargo]] = {}
        self.failed: list[_Assured[_Cargo]] = []

    def settle(self, outcome: _Outcome) -> None:
        counters = self.counters
        if outcome.flipped_bits:
            counters.corrupted += 1
        if outcome.copy:
            counters.duplicated += 1
            return
        self.in_flight -= 1
        self.cargo.pop(outcome.sequence, None)
        assured = self.assured.pop(outcome.sequence, None) if self.assured else None
        if assured is not None and outcome.fate is not Fate.DELIVERED:
            self.failed.append(assured)
        if outcome.fate is Fate.DELIVERED:
            counters.delivered += 1
            counters.delivered_byte += outcome.size_byte
        else:
            name = outcome.fate.replace("-", "_")
            setattr(counters, name, getattr(counters, name) + 1)


class Emulator(Generic[_Cargo]):
    """Takes messages with their cargo, and gives them back when they arrive.

    Args:
        link: the link, resolved as a whole, or what is known of it by now, from `look_ahead`. Then
            the emulator looks farther ahead when it has to; somebody else may do so before.
        seed: of the random streams, if the link has none of its own.
    """

    def __init__(self, link: LinkConfig | Ahead, seed: int = 0) -> None:
        self._ahead = link if isinstance(link, Ahead) else Ahead(Profile.of(link), link)
        self._seed = seed
        config = self._ahead.config
        self._channel = Channel(config, self._rngs(config))
        self._ways: dict[Direction, _Way[_Cargo]] = {one: _Way() for one in Direction}
        self._now_ns = 0
        self._last_ns = 0
        self._again_ns: int | None = None
        self._sent: list[Frame] = []
        # Sorted batches as (time of the next delivery, tie-breaker, index of it, deliveries).
        self._coming: list[tuple[int, int, int, list[Delivery[_Cargo]]]] = []
        self._order = count()
        self._warnings: list[str] = []

    def send(
        self,
        direction: Direction,
        time_ns: int,
        payload: bytes,
        cargo: _Cargo,
        *,
        priority: int = 0,
        kind: Kind | None = None,
        matters: Callable[[], bool] | None = None,
    ) -> None:
        """Accept a message sent at `time_ns`, or now if that is in the past.

        `cargo` is given back with it. It counts as a sample unless `kind` says otherwise. If it is
        lost and still `matters`, it is sent again `AGAIN_NS` later, or once the link is in service.
        """
        way = self._ways[direction]
        time_ns = max(time_ns, self._last_ns)
        self._last_ns = time_ns
        self._sent.append(Frame(direction, way.sequence, time_ns, payload, priority))
        way.cargo[way.sequence] = cargo
        way.in_flight += 1
        way.sequence += 1
        way.counters.received_byte += len(payload)
        if kind is not None:
            setattr(way.counters, kind, getattr(way.counters, kind) + 1)
        if matters is not None:
            way.assured[way.sequence - 1] = _Assured(payload, cargo, priority, kind, matters)

    def _send_again(self) -> None:
        if self._again_ns is None or self._now_ns < self._again_ns:
            return
        self._again_ns = None
        for direction, way in self._ways.items():
            way.failed = [one for one in way.failed if one.matters()]
            if way.failed and self._channel.outage(direction) is not None:
                self._again_ns = self._now_ns + AGAIN_NS
                continue
            failed, way.failed = way.failed, []
            for payload, cargo, priority, kind, matters in failed:
                self.send(
                    direction,
                    self._now_ns,
                    payload,
                    cargo,
                    priority=priority,
                    kind=kind,
                    matters=matters,
                )

    def advance(self, until_ns: int) -> list[Delivery[_Cargo]]:
        """Advance up to, not including, `until_ns`; returns what arrives, in order of arrival.

        Raises:
            LinkConfigError: if it has to look farther ahead and a file is no longer there.
        """
        self._send_again()
        until_ns = max(until_ns, self._now_ns, *(frame.time_ns + 1 for frame in self._sent[-1:]))
        arrived: list[Delivery[_Cargo]] = []
        while self._ahead.latest_ns < min(until_ns, NEVER_NS):
            arrived += self._advance(self._next_window_ns(until_ns))
            self.renew(look_ahead(self._ahead.profile, self._now_ns))
        return arrived + self._advance(until_ns)

    def _next_window_ns(self, until_ns: int) -> int:
        """When the next window is to begin: years without a message need none in between."""
        latest_ns = max(self._ahead.latest_ns, self._now_ns)
        sent_ns = min([until_ns, *(frame.time_ns for frame in self._sent[:1])])
        if sum(way.in_flight for way in self._ways.values()) > len(self._sent):
            return latest_ns
        return max(latest_ns, sent_ns)

    def _advance(self, until_ns: int) -> list[Delivery[_Cargo]]:
        end = bisect_left(self._sent, until_ns, key=_time_ns)
        sent, self._sent = self._sent[:end], self._sent[end:]
        step = self._channel.advance(until_ns, sent)
        self._now_ns = self._last_ns = until_ns
        if step.frames:
            self._expect(step.frames)
        for record in step.records:
            if record.topic == "/link/frame":
                outcome = _decode_outcome(record.payload)
                self._settle(outcome)
        if self._again_ns is None and any(way.failed for way in self._ways.values()):
            self._again_ns = until_ns + AGAIN_NS
        return self._arrived(until_ns)

    def _settle(self, outcome: _Outcome) -> None:
        way = self._ways[outcome.direction]
        way.settle(outcome)
        counters, config = way.counters, self._ahead.config
        if config.routing is not None:
            if outcome.fate in _NO_ROOM and counters.queue_full + counters.store_full == 1:
                self._warnings.append(_store_too_small(outcome, config.routing.store_byte))
        elif outcome.fate is Fate.QUEUE_FULL and counters.queue_full == 1:
            settings = self._channel.settings(outcome.direction)
            self._warnings.append(_too_small(outcome, settings))

    def take_warnings(self) -> list[str]:
        """What its user should know and has not been told, one line each."""
        taken, self._warnings = self._warnings, []
        return taken

    def _expect(self, frames: Sequence[Frame]) -> None:
        ways = self._ways
        coming: list[Delivery[_Cargo]] = [
            (at_ns, direction, payload, ways[direction].cargo[sequence])
            for direction, sequence, at_ns, payload in map(_parts_of, frames)
        ]
        # A frame and its duplicate are given back together, so the cargo is not needed again.
        for frame in frames:
            ways[frame.direction].cargo.pop(frame.sequence, None)
        coming.sort(key=_time)
        heapq.heappush(self._coming, (coming[0][0], next(self._order), 0, coming))

    def _arrived(self, until_ns: int) -> list[Delivery[_Cargo]]:
        arrived: list[Delivery[_Cargo]] = []
        while self._coming and self._coming[0][0] < until_ns:
            _, order, begin, part = heapq.heappop(self._coming)
            end = bisect_left(part, until_ns, lo=begin, key=_time)
            arrived += part[begin:end]
            if end < len(part):
                heapq.heappush(self._coming, (part[end][0], order, end, part))
        arrived.sort(key=_time)
        return arrived

    @property
    def next_ns(self) -> int | None:
        """When to advance at the latest if nothing is sent before; `None` if none is in flight."""
        moments = [] if self._again_ns is None else [self._again_ns]
        if any(way.in_flight for way in self._ways.values()):
            moments += [self._now_ns + _COUNT_NS, *(coming[0] for coming in self._coming[:1])]
            queue_ns = self._channel.next_ns
            if queue_ns is not None:
                moments.append(queue_ns)
        return min(moments, default=None)

    @property
    def least_round_trip_ns(self) -> int:
        """The shortest propagation delays of both directions together, as the link is now."""
        return sum(self._channel.settings(direction).least_delay_ns for direction in Direction)

    def control(self, payload: bytes) -> EmulatorState:
        """Apply a change; see `farside.link.emulator.control`.

        Raises:
            ValueError: if the change is invalid; nothing of it is then applied.
        """
        change = read_change(payload)
        if change.layer:
            self._adopt(self._changed(change.layer))
        for direction, out in change.out.items():
            self._channel.set_out(direction, out)
        return self.state()

    def _changed(self, layer: Mapping[str, Any]) -> Ahead:
        try:
            profile = self._ahead.profile.changed(layer, now_ns=self._now_ns)
            return look_ahead(profile, self._now_ns)
        except LinkConfigError as error:
            # What is wrong is in the change, not in the profile that it lies over.
            raise LinkConfigError(*error.problems) from error

    @property
    def ahead(self) -> Ahead:
        """What is known of the link by now."""
        return self._ahead

    def renew(self, ahead: Ahead) -> None:
        """Go on with what is now known of the link, unless the link has changed meanwhile."""
        if ahead.profile is self._ahead.profile:
            self._adopt(ahead)

    def _adopt(self, ahead: Ahead) -> None:
        if ahead.config.seed != self._ahead.config.seed:
            self._channel.reseed(self._rngs(ahead.config))
        self._channel.adopt(ahead.config)
        self._ahead = ahead

    def _rngs(self, config: LinkConfig) -> dict[Direction, np.random.Generator]:
        sequence = np.random.SeedSequence(self._seed if config.seed is None else config.seed)
        rngs = map(np.random.default_rng, sequence.spawn(len(Direction)))
        return dict(zip(Direction, rngs, strict=True))

    def state(self) -> EmulatorState:
        """Current counters, outages and settings."""
        up, down = self._way_state(Direction.UP), self._way_state(Direction.DOWN)
        return EmulatorState(to_s(self._now_ns), up, down)

    def _way_state(self, direction: Direction) -> WayState:
        way = self._ways[direction]
        counters = msgspec.structs.replace(
            way.counters, received=way.sequence, in_flight=way.in_flight
        )
        return WayState(counters, self._outage(direction), self._channel.settings(direction))

    def _outage(self, direction: Direction) -> OutageState | None:
        outage = self._channel.outage(direction)
        if outage is None:
            return None
        left_s = to_s(outage.end_ns - self._now_ns) if outage.end_ns < NEVER_NS else None
        return OutageState(outage.reason, left_s)


def _store_too_small(outcome: _Outcome, store_byte: int) -> str:
    """The warning that a node has dropped a message."""
    return (
        f"{outcome.direction}: a message of {outcome.size_byte:,} bytes was dropped, since no more "
        f"than {store_byte:,} bytes may wait at a node; contacts.store_byte sets how much"
    )


def _too_small(outcome: _Outcome, config: OneWay) -> str:
    """The warning that the transmit queue has dropped a message."""
    limits = [
        ("queue_byte", config.queue_byte, "bytes"),
        ("queue_frame", config.queue_frame, "messages"),
    ]
    given = [
        (f"{outcome.direction}.{key}", f"{most:,} {unit}") for key, most, unit in limits if most
    ]
    keys, most = (" or ".join(parts) for parts in zip(*given, strict=True))
    return (
        f"{outcome.direction}: a message of {outcome.size_byte:,} bytes was dropped, since no more "
        f"than {most} may wait to be sent; {keys} sets how much"
    )
