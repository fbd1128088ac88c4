"""The way of frames from node to node: stored, and forwarded by contact-graph routing.

Each node knows the plan, what waits in its own queues, and what it has itself booked on later
contacts; of other nodes it knows nothing (as in CCSDS 734.3-B-1). So a node can be simulated ahead
of the ends by as long as light takes to get there, and a frame's arrival is known beforehand by the
light time of the whole way. For the same reason the two directions share neither stores nor rates.
"""

import heapq
from collections.abc import Sequence
from itertools import count

from farside.frames import Fate, FrameHop, OutageReason
from farside.link.channel.agenda import PendingRecord
from farside.link.channel.chance import Draw
from farside.link.channel.outages import Outages
from farside.link.channel.queueing import Dropped, Transmission, transmissions
from farside.link.channel.relays import Best, Bundle, Line, Relay, SendersQueue
from farside.link.profile.config import OneWay
from farside.link.profile.hops.graph import BIT_WORK, ContactGraph, Way
from farside.link.profile.hops.routing import Routing, light_times_ns
from farside.node import NEVER_NS, Direction, Frame

_MOST_HOPS = 1 << 32

_LEAVES, _ARRIVES, _STARTS = range(3)
"""What happens at a node, in the order in which it does at one moment."""

_Event = tuple[int, int, int, int, int, int, Bundle | Line]
"""Time less the light time to the node, the node, what happens, by which contact, to which frame,
a tie-breaker, and what it happens to. Their order does not depend on how time is cut."""


class Forwarder:
    """One direction of a link by way of other nodes, in place of a transmitter.

    Frames share the rate of a contact in order of priority, then age. One that does not leave whole
    before the contact ends is routed anew. One that finds no room at a node, or from where nothing
    leads on, is dropped.

    Args:
        direction: which one.
        routing: the contacts.
        config: the settings of the direction.
        outages: those at the rover's end: what is sent there during one is lost.

    Attributes:
        least_delay_ns: the light time of the shortest way.
    """

    def __init__(
        self, direction: Direction, routing: Routing, config: OneWay, outages: Outages
    ) -> None:
        self._direction, self._config, self._outages = direction, config, outages
        self._graph = ContactGraph(routing.hops)
        self._source, self._dest = routing.ends(direction)
        self._store_byte = routing.store_byte
        self._ahead_ns = light_times_ns(routing.hops, self._source)
        self.least_delay_ns = self._ahead_ns.get(self._dest, 0)
        self._relays: dict[int, Relay] = {}
        self._queue = SendersQueue(routing.store_byte)
        self._events: list[_Event] = []
        self._order = count()
        self._sent: list[Transmission] = []
        self._dropped: list[Dropped] = []
        self._hops: list[PendingRecord] = []

    def take(self) -> tuple[list[Transmission], list[Dropped]]:
        """The frames that arrive, in order of arrival, and those dropped, since the last call."""
        taken = self._sent, self._dropped
        self._sent, self._dropped = [], []
        return taken

    def take_hops(self) -> list[PendingRecord]:
        """The hops that are decided since the last call."""
        taken, self._hops = self._hops, []
        return taken

    @property
    def next_ns(self) -> int | None:
        """When something happens next, less the light time from the sender; `None` if never."""
        return self._events[0][0] if self._events else None

    @property
    def began_ns(self) -> int | None:
        """When the first of the frames that the sender sends began to leave."""
        sender = self._relays.get(self._source)
        return None if sender is None else sender.began_ns

    def change(self, now_ns: int, config: OneWay) -> None:  # noqa: ARG002 - as a transmitter
        """Use `config` from now on."""
        self._config = config

    def run(self, until_ns: int, frames: Sequence[Frame], draw: Draw) -> None:
        """Take the frames handed over before `until_ns`, in order, and forward all until then."""
        for one in transmissions(frames, draw, self._config):
            work = (one.size_byte + self._config.overhead_byte) * 8 * BIT_WORK
            bundle = Bundle(one, work, 1, frozenset((self._source,)))
            self._plan(one.start_ns, self._source, _ARRIVES, -1, bundle)
        events = self._events
        while events and events[0][0] < until_ns:
            early_ns, node, kind, _, _, _, item = heapq.heappop(events)
            now_ns = early_ns + self._ahead_ns[node]
            if isinstance(item, Bundle):
                self._arrive(node, item, now_ns)
            elif kind == _LEAVES:
                self._leave(self._relays[node], item, now_ns)
            else:
                item.is_called = False
                self._start(self._relays[node], item, now_ns)

    def _plan(self, time_ns: int, node: int, kind: int, number: int, item: Bundle | Line) -> None:
        sequence = item.sequence if isinstance(item, Bundle) else -1
        early_ns = time_ns - self._ahead_ns[node]
        event = early_ns, node, kind, number, sequence, next(self._order), item
        heapq.heappush(self._events, event)

    def _arrive(self, node: int, bundle: Bundle, now_ns: int) -> None:
        if node == self._dest:
            bundle.transmission.arrives_ns = now_ns
            self._sent.append(bundle.transmission)
            return
        relay = self._relays.setdefault(node, Relay(node))
        bundle.received_ns = now_ns
        bundle.stored_byte = relay.held_byte + bundle.size_byte
        if node != self._source and bundle.stored_byte > self._store_byte:
            self._drop(relay, bundle, Fate.STORE_FULL, now_ns)
            return
        relay.held_byte += bundle.size_byte
        self._route(relay, bundle, now_ns)
        if node == self._source:
            for excess, line in self._queue.excess(self._config, bundle):
                line.drop(excess)
                relay.held_byte -= excess.size_byte
                self._drop(relay, excess, Fate.QUEUE_FULL, now_ns)

    def _route(self, relay: Relay, bundle: Bundle, now_ns: int) -> None:
        """Have a frame wait for the first contact of the way by which it arrives first."""
        way = self._way(relay, bundle, now_ns)
        if way is None:
            relay.held_byte -= bundle.size_byte
            self._queue.remove(bundle)
            self._drop(relay, bundle, Fate.NO_ROUTE, now_ns)
            return
        relay.book(way, now_ns, bundle)
        line = relay.line(way.legs[0])
        line.put(bundle)
        if relay.number == self._source:
            self._queue.put(bundle, line)
        self._call(relay, line, now_ns)

    def _way(self, relay: Relay, bundle: Bundle, now_ns: int) -> Way | None:
        work, dest, earliest = bundle.work, self._dest, self._graph.earliest
        busy = relay.busy(now_ns, bundle.priority)
        latest_ns = bundle.transmission.latest_ns if bundle.hop == 1 else NEVER_NS
        best = relay.best.get(work)
        if best is None and work in relay.best:
            return None
        if best is not None and best.serves(bundle, now_ns, latest_ns, busy):
            return best.way
        if best is None or now_ns > best.way.until_ns:
            way = earliest(relay.number, dest, now_ns, work)
            best = None if way is None else Best.found(self._graph, dest, way, work)
            relay.best[work] = best
            if best is None:
                return None
            if best.serves(bundle, now_ns, latest_ns, busy):
                return best.way
        place, visited = (relay.number, dest, now_ns, work), bundle.visited
        # What is not to wait for so long goes the next best way, if there is one.
        way = earliest(*place, busy=busy, avoiding=visited, latest_ns=latest_ns)
        # Where no contact has room, it waits as if nothing were booked, to be routed anew then.
        way = way or earliest(*place, busy=busy, avoiding=visited)
        way = way or earliest(*place, avoiding=visited)
        if way is None and not bundle.turned:
            bundle.turned, bundle.visited = True, frozenset((relay.number,))
            way = earliest(*place, busy=busy) or earliest(*place)
        return way

    def _call(self, relay: Relay, line: Line, now_ns: int) -> None:
        """Have a line take its next frame as soon as it can, after all that happens until then."""
        if line.sending is None and not line.is_called:
            line.is_called = True
            begin_ns = max(now_ns, line.leg.begin_ns)
            self._plan(begin_ns, relay.number, _STARTS, line.leg.number, line)

    def _start(self, relay: Relay, line: Line, now_ns: int) -> None:
        while (bundle := line.take()) is not None:
            if bundle.hop == 1 and now_ns > bundle.transmission.latest_ns:
                self._queue.remove(bundle)
                relay.held_byte -= bundle.size_byte
                self._drop(relay, bundle, Fate.EXPIRED, now_ns)
                continue
            sends_ns = line.leg.sends_ns(now_ns, bundle.work)
            if sends_ns is None:
                self._route(relay, bundle, now_ns)
                continue
            self._queue.remove(bundle)
            bundle.sent_ns, line.end_ns = sends_ns
            line.sending = bundle
            self._plan(line.end_ns, relay.number, _LEAVES, line.leg.number, line)
            return

    def _leave(self, relay: Relay, line: Line, now_ns: int) -> None:
        bundle, leg = line.sending, line.leg
        line.sending = None
        self._call(relay, line, now_ns)
        if bundle is None:
            return
        relay.held_byte -= bundle.size_byte
        if bundle.hop == 1:
            one = bundle.transmission
            one.start_ns, one.end_ns = bundle.sent_ns, now_ns
            if self._direction is Direction.DOWN:
                reasons = self._outages.reasons([one.start_ns], [one.end_ns])
                if reasons and (reason := reasons[0]) is not None:
                    self._drop(relay, bundle, Fate.OUTAGE, now_ns, reason)
                    return
        arrival_ns = now_ns + leg.owlt_ns
        self._note(
            now_ns,
            FrameHop(
                direction=self._direction,
                sequence=bundle.sequence,
                hop=bundle.hop,
                node=relay.number,
                received_ns=bundle.received_ns,
                stored_byte=bundle.stored_byte,
                to=leg.receiver,
                sent_ns=bundle.sent_ns,
                sent_end_ns=now_ns,
                arrival_ns=arrival_ns,
            ),
        )
        bundle.hop += 1
        bundle.visited |= {leg.receiver}
        self._plan(arrival_ns, leg.receiver, _ARRIVES, leg.number, bundle)

    def _drop(
        self,
        relay: Relay,
        bundle: Bundle,
        fate: Fate,
        now_ns: int,
        outage: OutageReason | None = None,
    ) -> None:
        self._dropped.append(Dropped(bundle.transmission, fate, now_ns, outage))
        self._note(
            now_ns,
            FrameHop(
                direction=self._direction,
                sequence=bundle.sequence,
                hop=bundle.hop,
                node=relay.number,
                received_ns=bundle.received_ns,
                stored_byte=bundle.stored_byte,
                dropped_ns=now_ns,
                fate=fate,
            ),
        )

    def _note(self, time_ns: int, hop: FrameHop) -> None:
        # In order, and before the frame's fate, where all happens at the same time.
        place = time_ns, self._direction, hop.sequence, hop.hop - _MOST_HOPS
        self._hops.append(PendingRecord(*place, hop))
