"""What both ends know beforehand of a link by way of other nodes, as tables of one direction."""

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from farside.link.profile.config import (
    DELAY_KEYS,
    RATE_KEYS,
    DelayPoint,
    LinkConfig,
    OneWay,
    RateStep,
)
from farside.link.profile.hops.graph import BIT_WORK, ContactGraph
from farside.link.profile.hops.routing import Routing
from farside.link.profile.layers import refused
from farside.node import Direction, to_s

_STEP_NS = 1000  # how long a step takes in a delay table, which is linear between its points
_NEITHER = {key: () if key.endswith("_table") else None for key in (*DELAY_KEYS, *RATE_KEYS)}
_WHY = ", since the link goes by way of other nodes, whose contacts give delays and rates"


class _Piece(NamedTuple):
    """A span in which the delay is constant, or falls as time passes since the arrival stays.

    Attributes:
        begin_ns, end_ns: its first and last moment.
        delay_ns: at its beginning.
        falls: whether the delay falls.
        rate_bit_s: the least rate on the way; 0 while the first contact has not begun.
    """

    begin_ns: int
    end_ns: int
    delay_ns: int
    falls: bool
    rate_bit_s: int

    def delay_at_ns(self, time_ns: int) -> int:
        """The delay at a moment of it, or just after."""
        return self.delay_ns - (time_ns - self.begin_ns if self.falls else 0)


def with_plans(link: LinkConfig) -> LinkConfig:
    """`link` with the delays and rates that follow from its `routing`, if it has one.

    Raises:
        LinkConfigError: if it has others besides.
    """
    routing = link.routing
    if routing is None:
        return link
    if any(change.rate_bit_s is not None or change.slots for change in link.changes):
        raise refused(("changes",), f"expected neither rate_bit_s nor slots{_WHY}")
    ways: dict[str, OneWay] = {}
    for direction in Direction:
        given = link.way(direction)
        if given.slots is not None:
            raise refused((direction.value, "slots"), f"expected none{_WHY}")
        bare = msgspec.structs.replace(given, **_NEITHER)
        ways[direction.value] = planned(routing, direction, bare, link.mtu_byte)
        if given not in (bare, ways[direction.value]):
            full = ways[direction.value]
            others = [key for key in _NEITHER if getattr(given, key) != _NEITHER[key]]
            key = next(
                (one for one in others if getattr(given, one) != getattr(full, one)), others[0]
            )
            raise refused((direction.value, key), f"expected none{_WHY}")
    return msgspec.structs.replace(link, **ways)


def planned(routing: Routing, direction: Direction, one_way: OneWay, mtu_byte: int) -> OneWay:
    """`one_way` with the delays and rates by which both ends plan.

    The delay is that of a frame of `mtu_byte` by contact-graph routing, from when its last bit
    leaves the sender: light times, sending and waiting at the nodes between. The rate is the least
    one on the way, so that what is sent by it does not pile up further on; it is 0 while the sender
    waits for a contact. When nothing leads there any more, it stays 0.

    Args:
        routing: the contacts.
        direction: which way.
        one_way: the settings of this direction.
        mtu_byte: the longest frame.
    """
    graph = ContactGraph(routing.hops)
    work = (mtu_byte + one_way.overhead_byte) * 8 * BIT_WORK
    points: list[DelayPoint] = []
    steps: list[RateStep] = []
    over_ns = 0
    for piece in _merged(_pieces(graph, *routing.ends(direction), work)):
        over_ns = piece.end_ns + 1
        if over_ns - piece.begin_ns < 2 * _STEP_NS:
            continue
        begin_s = to_s(piece.begin_ns) if points else 0.0
        points.append(DelayPoint(t_s=begin_s, delay_s=to_s(piece.delay_ns)))
        last_ns = over_ns - _STEP_NS
        points.append(DelayPoint(t_s=to_s(last_ns), delay_s=to_s(piece.delay_at_ns(last_ns))))
        if not steps or steps[-1].rate_bit_s != piece.rate_bit_s:
            steps.append(RateStep(t_s=begin_s, rate_bit_s=piece.rate_bit_s))
    if not steps or steps[-1].rate_bit_s:
        steps.append(RateStep(t_s=to_s(over_ns) if steps else 0.0, rate_bit_s=0))
    delays = tuple(points) or (DelayPoint(t_s=0.0, delay_s=0.0),)
    return msgspec.structs.replace(one_way, delay_table=delays, rate_table=tuple(steps))


def _pieces(graph: ContactGraph, source: int, dest: int, work: int) -> Iterator[_Piece]:
    time_ns = 0
    while (way := graph.earliest(source, dest, time_ns, work, first_work=0)) is not None:
        opens_ns, end_ns = way.legs[0].begin_ns, way.until_ns
        rate_bit_s = min(leg.rate_bit_s for leg in way.legs)
        if opens_ns > time_ns:
            rate_bit_s, end_ns = 0, min(end_ns, opens_ns - 1)
        yield _Piece(time_ns, end_ns, way.arrives_ns - time_ns, not way.moves, rate_bit_s)
        time_ns = end_ns + 1


def _merged(pieces: Iterator[_Piece]) -> Iterator[_Piece]:
    """The same pieces, those that go on as before as one."""
    last: _Piece | None = None
    for piece in pieces:
        if last is None:
            last = piece
            continue
        goes_on = last.delay_at_ns(piece.begin_ns) == piece.delay_ns
        if goes_on and (last.falls, last.rate_bit_s) == (piece.falls, piece.rate_bit_s):
            last = last._replace(end_ns=piece.end_ns)
        else:
            yield last
            last = piece
    if last is not None:
        yield last
