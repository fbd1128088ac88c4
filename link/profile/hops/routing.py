"""The link by way of other nodes: a contact plan as plain tables.

The two ends of such a link cannot reach each other directly, or not both ways. Nodes between them
store frames and forward them; `farside.link.profile.hops.graph` finds the way.
"""

import heapq
from collections.abc import Iterable
from itertools import groupby, pairwise
from operator import attrgetter
from typing import Annotated

from msgspec import Meta

from farside.node import Direction, to_ns
from farside.settings import Count, NonNegative, Section
from farside.validation import MEASURED

STORE_BYTE = 64 * 1024 * 1024
"""What a node between the two ends may hold in each direction (project default: 64 MiB)."""

NodeNumber = Annotated[int, Meta(ge=0)]

_pair = attrgetter("sender", "receiver")
_by_pair = attrgetter("sender", "receiver", "begin_s")


class Hop(Section, frozen=True):
    """One node can send to another from `begin_s` up to, not including, `end_s`.

    Attributes:
        begin_s, end_s: the contact, in the sender's time.
        sender, receiver: numbers of the nodes.
        rate_bit_s: the rate in bit/s.
        owlt_s: the light time one way of what is sent then.

    Raises:
        ValueError: if it ends before it begins, or leads nowhere.
    """

    begin_s: NonNegative
    end_s: NonNegative
    sender: NodeNumber
    receiver: NodeNumber
    rate_bit_s: Count
    owlt_s: NonNegative

    def __post_init__(self) -> None:
        if self.end_s <= self.begin_s:
            raise ValueError(
                f"expected a contact that ends after it begins, found begin_s = {self.begin_s:g} "
                f"and end_s = {self.end_s:g}"
            )
        if self.sender == self.receiver:
            raise ValueError(f"expected a contact of two nodes, found {self.sender} twice")


class Routing(Section, frozen=True):
    """The contacts by which frames go from node to node; gives delays, rates and outages.

    Attributes:
        ground: number of the ground's node.
        rover: number of the rover's node.
        hops: the contacts of all nodes.
        store_byte: bytes of frames that each node between the two may hold in each direction; one
            that finds no room is dropped.

    Raises:
        ValueError: if rover and ground are one node, or contacts of two nodes overlap.
    """

    ground: NodeNumber
    rover: NodeNumber
    hops: Annotated[tuple[Hop, ...], MEASURED]
    store_byte: Count = STORE_BYTE

    def __post_init__(self) -> None:
        if self.ground == self.rover:
            raise ValueError(f"expected two nodes, found {self.rover} for rover and ground")
        for (sender, receiver), hops in by_pair(self.hops):
            for before, after in pairwise(hops):
                if after.begin_s < before.end_s:
                    raise ValueError(
                        f"expected no contacts from {sender} to {receiver} that overlap, found "
                        f"{before.begin_s:.12g} s to {before.end_s:.12g} s and "
                        f"{after.begin_s:.12g} s to {after.end_s:.12g} s"
                    )

    def ends(self, direction: Direction) -> tuple[int, int]:
        """Numbers of the nodes that frames of one direction come from and go to."""
        if direction is Direction.UP:
            return self.ground, self.rover
        return self.rover, self.ground

    @property
    def least_delay_ns(self) -> int:
        """The least sum of light times from one end to the other: no frame arrives sooner."""
        sums = (
            light_times_ns(self.hops, source).get(dest)
            for source, dest in map(self.ends, Direction)
        )
        return min((ns for ns in sums if ns is not None), default=0)


def light_times_ns(hops: Iterable[Hop], source: int) -> dict[int, int]:
    """The least sum of light times, in ns, from a node to each that its frames may ever reach."""
    least: dict[int, list[tuple[int, int]]] = {}
    for (sender, receiver), own in by_pair(hops):
        owlt_ns = min(to_ns(hop.owlt_s) for hop in own)
        least.setdefault(sender, []).append((owlt_ns, receiver))
    found: dict[int, int] = {}
    heap = [(0, source)]
    while heap:
        time_ns, node = heapq.heappop(heap)
        if node not in found:
            found[node] = time_ns
            for owlt_ns, receiver in least.get(node, ()):
                heapq.heappush(heap, (time_ns + owlt_ns, receiver))
    return found


def by_pair(hops: Iterable[Hop]) -> Iterable[tuple[tuple[int, int], list[Hop]]]:
    """The contacts by sender and receiver, those of each pair in order of time."""
    return ((pair, list(own)) for pair, own in groupby(sorted(hops, key=_by_pair), key=_pair))
