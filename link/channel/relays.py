"""The nodes between the ends of a link: what each stores, queues, and has booked."""

import heapq
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from farside.link.channel.queueing import Transmission
from farside.link.profile.config import DropPolicy, OneWay
from farside.link.profile.hops.graph import Busy, ContactGraph, Leg, Way
from farside.node import NEVER_NS


class Bundle(msgspec.Struct, gc=False):
    """A frame at a node, or on its way to one.

    Attributes:
        transmission: the frame.
        work: of sending it once, see `farside.link.profile.hops.graph.BIT_WORK`.
        hop: which node of its way it is at or goes to, from 1.
        visited: the nodes where it has been, to which it does not return.
        turned: whether it had to return all the same.
        received_ns: when it arrived at the node.
        stored_byte: how much waited there then, this frame included.
        sent_ns: when its first bit left the node.
        is_dropped: whether it waits no more.
    """

    transmission: Transmission
    work: int
    hop: int
    visited: frozenset[int]
    turned: bool = False
    received_ns: int = 0
    stored_byte: int = 0
    sent_ns: int = 0
    is_dropped: bool = False

    @property
    def size_byte(self) -> int:
        """The size of its payload."""
        return self.transmission.size_byte

    @property
    def sequence(self) -> int:
        """The frame's number."""
        return self.transmission.frame.sequence

    @property
    def priority(self) -> int:
        """The frame's priority."""
        return self.transmission.priority


class Line:
    """One contact at its sender: the frames that wait for it, and the one being sent.

    Args:
        leg: the contact.

    Attributes:
        sending: the frame being sent.
        end_ns: when its last bit leaves.
        is_called: whether the line is about to take its next frame.
    """

    def __init__(self, leg: Leg) -> None:
        self.leg = leg
        self.sending: Bundle | None = None
        self.end_ns = 0
        self.is_called = False
        self._waiting: list[tuple[int, int, int, Bundle]] = []
        self._work: dict[int, int] = {}  # of what waits, by priority

    def put(self, bundle: Bundle) -> None:
        """Have a frame wait: the highest priority goes first, then the oldest."""
        frame = bundle.transmission.frame
        heapq.heappush(self._waiting, (-bundle.priority, frame.time_ns, frame.sequence, bundle))
        self._work[bundle.priority] = self._work.get(bundle.priority, 0) + bundle.work

    def take(self) -> Bundle | None:
        """The next frame, which then waits no more; `None` without one."""
        while self._waiting:
            bundle = heapq.heappop(self._waiting)[-1]
            if not bundle.is_dropped:
                self._work[bundle.priority] -= bundle.work
                return bundle
        return None

    def drop(self, bundle: Bundle) -> None:
        """Have a waiting frame wait no more."""
        bundle.is_dropped = True
        self._work[bundle.priority] -= bundle.work

    def free_ns(self, now_ns: int, priority: int) -> int:
        """When a frame of this priority would have its turn."""
        free_ns = max(now_ns, self.leg.begin_ns, self.end_ns if self.sending else 0)
        ahead = sum(work for level, work in self._work.items() if level >= priority)
        return free_ns - (-ahead // self.leg.rate_bit_s)


class Best(NamedTuple):
    """The way by which a frame arrives first while nothing is booked.

    Attributes:
        way: the way.
        other_ns: before this, no frame arrives by any other.
    """

    way: Way
    other_ns: int

    @classmethod
    def found(cls, graph: ContactGraph, dest: int, way: Way, work: int) -> "Best":
        """The way from a node, and how good all others are: each leaves out one of its contacts."""
        place = way.legs[0].sender, dest, way.ready_ns, work
        others = [graph.earliest(*place, without=leg) for leg in way.legs]
        arrivals_ns = (NEVER_NS if other is None else other.arrives_ns for other in others)
        return cls(way, min(arrivals_ns))

    def serves(self, bundle: Bundle, now_ns: int, latest_ns: int, busy: Busy) -> bool:
        """Whether this is the best way for a frame, with all that is booked.

        Bookings only make ways longer, and so does time.
        """
        way = self.way
        if max(now_ns, way.legs[0].begin_ns) > latest_ns or not bundle.visited.isdisjoint(
            leg.receiver for leg in way.legs
        ):
            return False
        arrives_ns = way.follow(now_ns, bundle.work, busy)
        if arrives_ns is None:
            return False
        if arrives_ns <= self.other_ns:
            return True
        return now_ns <= way.until_ns and arrives_ns == way.arrival_ns(now_ns)


class Relay:
    """One node: its lines, its store, and what it reckons that other nodes will have to send.

    Args:
        number: the node's number.

    Attributes:
        held_byte: how much is stored here, in bytes of payload.
        best: the best way by the work of sending; `None` where none leads there any more.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.held_byte = 0
        self.best: dict[int, Best | None] = {}
        self._lines: dict[int, Line] = {}
        # By contact of another node and priority: until when frames of this priority or a higher
        # one are reckoned to take it. What is routed anew stays booked, which costs no frame its
        # way: where all seems booked, it goes as if nothing were.
        self._booked: dict[int, dict[int, int]] = {}

    @property
    def began_ns(self) -> int | None:
        """When the first of the frames being sent began to leave; `None` without one."""
        sending = (line.sending for line in self._lines.values())
        return min((one.sent_ns for one in sending if one is not None), default=None)

    def line(self, leg: Leg) -> Line:
        """The line of a contact of this node."""
        line = self._lines.get(leg.number)
        if line is None:
            line = self._lines[leg.number] = Line(leg)
        return line

    def busy(self, now_ns: int, priority: int) -> Busy:
        """Until when contacts are taken, as this node knows, for a frame of this priority."""
        lines, booked, own = self._lines, self._booked, self.number

        def busy_ns(leg: Leg) -> int:
            if leg.sender == own:
                line = lines.get(leg.number)
                return 0 if line is None else line.free_ns(now_ns, priority)
            levels = booked.get(leg.number)
            return 0 if levels is None else _level_ns(levels, priority)

        return busy_ns

    def book(self, way: Way, now_ns: int, bundle: Bundle) -> None:
        """Reckon with a frame on the later contacts of its way."""
        time_ns, priority = now_ns, bundle.priority
        busy = self.busy(now_ns, priority)
        for index, leg in enumerate(way.legs):
            start_ns = max(time_ns, leg.begin_ns, busy(leg))
            sending_ns = -(-bundle.work // leg.rate_bit_s)
            if index:
                levels = self._booked.setdefault(leg.number, {})
                levels.setdefault(priority, _level_ns(levels, priority))
                for level, free_ns in levels.items():
                    if level <= priority:
                        levels[level] = max(free_ns, start_ns) + sending_ns
            time_ns = start_ns + sending_ns + leg.owlt_ns


def _level_ns(levels: dict[int, int], priority: int) -> int:
    """Until when frames of `priority` or above take a contact."""
    above = [level for level in levels if level >= priority]
    return levels[min(above)] if above else 0


class SendersQueue:
    """What waits at the sender: bounded by its store, in place of the bytes of a transmit queue.

    Args:
        store_byte: how much may wait.

    Attributes:
        bytes: how much waits.
    """

    def __init__(self, store_byte: int) -> None:
        self.bytes = self._frames = 0
        self._store_byte = store_byte
        # By priority and sequence number, in order of hand-over.
        self._waiting: dict[int, dict[int, tuple[Bundle, Line]]] = {}

    def put(self, bundle: Bundle, line: Line) -> None:
        """Have a frame wait for a line, or for another one than before."""
        waiting = self._waiting.setdefault(bundle.priority, {})
        if bundle.sequence not in waiting:
            self.bytes += bundle.size_byte
            self._frames += 1
        waiting[bundle.sequence] = bundle, line

    def remove(self, bundle: Bundle) -> None:
        """Forget a frame that is being sent, or was dropped."""
        waiting = self._waiting.get(bundle.priority, {})
        if waiting.pop(bundle.sequence, None) is not None:
            self.bytes -= bundle.size_byte
            self._frames -= 1

    def excess(self, config: OneWay, newest: Bundle) -> Iterator[tuple[Bundle, Line]]:
        """Remove, one after the other, the frames that do not fit now that `newest` is there."""
        policy = config.drop if newest.size_byte <= self._store_byte else DropPolicy.NEWEST
        most_frames = config.queue_frame or NEVER_NS
        while self.bytes > self._store_byte or self._frames > most_frames:
            bundle, line = self._chosen(policy)
            if self._frames == 1 and line.sending is None:
                return  # it needs no room among others
            self.remove(bundle)
            yield bundle, line

    def _chosen(self, policy: DropPolicy) -> tuple[Bundle, Line]:
        waiting = {level: one for level, one in self._waiting.items() if one}
        match policy:
            case DropPolicy.NEWEST:
                return max((next(reversed(one.values())) for one in waiting.values()), key=_age)
            case DropPolicy.OLDEST:
                return min((next(iter(one.values())) for one in waiting.values()), key=_age)
            case DropPolicy.LOWEST:
                return next(reversed(waiting[min(waiting)].values()))


def _age(waiting: tuple[Bundle, Line]) -> tuple[int, int]:
    frame = waiting[0].transmission.frame
    return frame.time_ns, frame.sequence
