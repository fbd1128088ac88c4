"""What the tests of links by way of other nodes have in common."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from farside.frames import FrameHop
from farside.link import LinkConfig, OneWay
from farside.link.profile.hops.graph import Leg
from farside.link.profile.hops.routing import Hop, Routing
from farside.link.profile.plans.planned import with_plans
from farside.node import NEVER_NS, Record

GROUND, ROVER = 1, 9
NODES = (GROUND, 4, 5, 6, ROVER)


def hop(  # noqa: PLR0917 - as in a plan
    begin_s: float, end_s: float, sender: int, receiver: int, rate_bit_s: int, owlt_s: float
) -> Hop:
    """A contact, in the order of ION's commands."""
    return Hop(
        begin_s=begin_s,
        end_s=end_s,
        sender=sender,
        receiver=receiver,
        rate_bit_s=rate_bit_s,
        owlt_s=owlt_s,
    )


def relayed(hops: Sequence[Hop], way: OneWay | None = None, **rest: Any) -> LinkConfig:
    """A link between nodes 1 and 9 by these contacts, with its plans."""
    store = {"store_byte": rest.pop("store_byte")} if "store_byte" in rest else {}
    routing = Routing(ground=GROUND, rover=ROVER, hops=tuple(hops), **store)
    one_way = way or OneWay()
    return with_plans(LinkConfig(up=one_way, down=one_way, routing=routing, **rest))


def hops_of(records: Sequence[Record]) -> list[FrameHop]:
    """The hops in a log."""
    decode = msgspec.json.Decoder(FrameHop).decode
    return [decode(record.payload) for record in records if record.topic == "/link/hop"]


def by_hand_ns(
    legs: Sequence[Leg],
    source: int,
    dest: int,
    ready_ns: int,
    *,
    works: tuple[int, int],
    booked_ns: Mapping[int, int] | None = None,
) -> int:
    """The earliest arrival of all ways there are, tried one after the other; `NEVER_NS` for none.

    Args:
        legs: the contacts.
        source: where the frame is.
        dest: where it goes.
        ready_ns: from when on.
        works: of the first sending, and of each other.
        booked_ns: until when a contact is taken, by its number.
    """

    def arrival_ns(node: int, time_ns: int, been: frozenset[int], work: int) -> int:
        if node == dest:
            return time_ns
        found = NEVER_NS
        for leg in legs:
            if leg.sender != node or leg.receiver in been:
                continue
            start_ns = max(time_ns, leg.begin_ns, (booked_ns or {}).get(leg.number, 0))
            end_ns = start_ns - (-work // leg.rate_bit_s)
            if start_ns < leg.end_ns and end_ns <= leg.end_ns:
                on_ns = arrival_ns(
                    leg.receiver, end_ns + leg.owlt_ns, been | {leg.receiver}, works[1]
                )
                found = min(found, on_ns)
        return found

    return arrival_ns(source, ready_ns, frozenset({source}), works[0])


def apart(hops: Sequence[Hop]) -> list[Hop]:
    """Those of each pair of nodes that overlap none before them."""
    kept: list[Hop] = []
    for one in hops:
        pair = one.sender, one.receiver
        own = [other for other in kept if (other.sender, other.receiver) == pair]
        if all(one.end_s <= other.begin_s or other.end_s <= one.begin_s for other in own):
            kept.append(one)
    return kept
