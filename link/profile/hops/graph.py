"""Contact-graph routing: the earliest arrival over a plan of contacts.

Sources: S. Burleigh, Contact Graph Routing, draft-burleigh-dtnrg-cgr-01 (2010); CCSDS 734.3-B-1,
Schedule-Aware Bundle Routing (2019); J. Fraire, O. De Jonckère, S. Burleigh, Routing in the space
Internet: a contact graph routing tutorial, JNCA 174 (2021). As there, a frame that reaches a node
waits for a contact, leaves whole within it, and arrives one light time after its last bit; and
Dijkstra's algorithm finds the earliest arrival. Here it runs over nodes rather than contacts, which
is as exact, since whatever is earlier at a node is later nowhere else. It also finds until when the
result holds, so that a way is computed once for all frames that may go by it.
"""

import heapq
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple

from farside.link.profile.hops.routing import Hop
from farside.node import NEVER_NS, NS_PER_S, to_ns

BIT_WORK = NS_PER_S
"""The work of sending one bit, as in `farside.link.profile.rate`: the rate is work per ns."""

Busy = Callable[["Leg"], int]
"""Until when a contact is taken by what has been booked on it, in nanoseconds."""


class Leg(NamedTuple):
    """A contact of the plan in whole nanoseconds; see `farside.link.profile.hops.routing.Hop`.

    Attributes:
        number: its place in the plan, in order of beginning, end, sender and receiver.
    """

    begin_ns: int
    end_ns: int
    sender: int
    receiver: int
    rate_bit_s: int
    owlt_ns: int
    number: int

    def sends_ns(self, ready_ns: int, work: int) -> tuple[int, int] | None:
        """When the first and the last bit leave; `None` if the contact ends before that."""
        start_ns = max(ready_ns, self.begin_ns)
        end_ns = start_ns - (-work // self.rate_bit_s)
        return (start_ns, end_ns) if start_ns < self.end_ns and end_ns <= self.end_ns else None


class Way(NamedTuple):
    """The way by which a frame arrives first.

    Attributes:
        legs: the contacts that it takes.
        ready_ns: when it was at the first node.
        arrives_ns: when it arrives.
        moves: whether one that is there later arrives by as much later; else it arrives just then.
        until_ns: for what is there up to this moment, nothing booked, all of this holds.
    """

    legs: tuple[Leg, ...]
    ready_ns: int
    arrives_ns: int
    moves: bool
    until_ns: int

    def arrival_ns(self, ready_ns: int) -> int:
        """When a frame arrives that is at the first node later, up to `until_ns`."""
        return self.arrives_ns + (ready_ns - self.ready_ns if self.moves else 0)

    def follow(self, ready_ns: int, work: int, busy: Busy) -> int | None:
        """When a frame arrives by these contacts, what is booked counted; `None` if it cannot."""
        time_ns = ready_ns
        for leg in self.legs:
            sends_ns = leg.sends_ns(max(time_ns, busy(leg)), work)
            if sends_ns is None:
                return None
            time_ns = sends_ns[1] + leg.owlt_ns
        return time_ns


class _Pair(NamedTuple):
    """The contacts from one node to another, in order; they do not overlap."""

    receiver: int
    ends_ns: list[int]
    legs: list[Leg]
    least_owlt_ns: int


class ContactGraph:
    """The nodes of a plan and the contacts between them.

    Args:
        hops: the contacts.
    """

    def __init__(self, hops: Sequence[Hop]) -> None:
        rows = sorted(
            (to_ns(h.begin_s), to_ns(h.end_s), h.sender, h.receiver, h.rate_bit_s, to_ns(h.owlt_s))
            for h in hops
        )
        self.legs = [Leg(*row, number) for number, row in enumerate(rows)]
        pairs: dict[tuple[int, int], list[Leg]] = {}
        for leg in self.legs:
            pairs.setdefault((leg.sender, leg.receiver), []).append(leg)
        self._from: dict[int, list[_Pair]] = {}
        for (sender, receiver), legs in sorted(pairs.items()):
            ends_ns, least_ns = [leg.end_ns for leg in legs], min(leg.owlt_ns for leg in legs)
            self._from.setdefault(sender, []).append(_Pair(receiver, ends_ns, legs, least_ns))

    def earliest(  # noqa: C901 - a call in this loop would double its time
        self,
        source: int,
        dest: int,
        ready_ns: int,
        work: int = 0,
        *,
        first_work: int | None = None,
        busy: Busy | None = None,
        avoiding: frozenset[int] = frozenset(),
        latest_ns: int = NEVER_NS,
        without: Leg | None = None,
    ) -> Way | None:
        """The way by which a frame arrives first; `None` if none leads there any more.

        Of several ways that arrive at once, one whose arrival stays the same a little later wins,
        then the one with fewer contacts, then with those of lower number.

        Args:
            source: the node where the frame is.
            dest: the node that it is for.
            ready_ns: from when on it can leave.
            work: of sending it, `BIT_WORK` per bit.
            first_work: of sending it the first time, if that is not `work`.
            busy: until when contacts are booked. Then `until_ns` of the way means nothing.
            avoiding: nodes that it does not go by.
            latest_ns: when its first bit leaves the first node at the latest.
            without: a contact that it does not take.
        """
        labels: dict[int, tuple[int, bool]] = dict.fromkeys(avoiding - {source}, (0, False))
        if without is not None:
            busy = _without(without, busy)
        holds_ns = NEVER_NS  # by how much later the frame may be there before another way is better
        heap: list[_Label] = [(ready_ns, True, 0, (), source)]
        while heap:
            time_ns, moves, count, numbers, node = heapq.heappop(heap)
            if node in labels:
                if not moves and labels[node][1]:
                    holds_ns = min(holds_ns, time_ns - labels[node][0])
                continue
            if node == dest:
                if moves:
                    still = (one[0] for one in heap if not one[1])
                    holds_ns = min(holds_ns, min(still, default=NEVER_NS) - time_ns)
                legs = tuple(self.legs[number] for number in numbers)
                slack_ns = _slack_ns(legs, ready_ns, work, first_work)
                until_ns = ready_ns + (min(slack_ns, holds_ns) if moves else slack_ns)
                return Way(legs, ready_ns, time_ns, moves, until_ns)
            labels[node] = time_ns, moves
            leg_work, by_ns = work, NEVER_NS
            if node == source:
                leg_work, by_ns = work if first_work is None else first_work, latest_ns
            for pair in self._from.get(node, ()):
                if pair.receiver in labels:
                    continue
                found, pair_holds_ns = _first(
                    pair, time_ns, moves, leg_work, busy=busy, latest_ns=by_ns
                )
                holds_ns = min(holds_ns, pair_holds_ns)
                if found is not None:
                    at_ns, still_moves, number = found
                    label = at_ns, still_moves, count + 1, (*numbers, number), pair.receiver
                    heapq.heappush(heap, label)
        return None


def _without(taken: Leg, busy: Busy | None) -> Busy:
    def busy_ns(leg: Leg) -> int:
        if leg.number == taken.number:
            return NEVER_NS
        return 0 if busy is None else busy(leg)

    return busy_ns


_Label = tuple[int, bool, int, tuple[int, ...], int]
"""When a frame gets to a node, whether that moves, by how many and which contacts; the node."""


def _slack_ns(legs: Sequence[Leg], ready_ns: int, work: int, first_work: int | None) -> int:
    """By how much later a frame may be ready to go by these contacts and arrive as predicted.

    That is at the same time if it waits anywhere, otherwise by as much later.
    """
    slack_ns, time_ns = NEVER_NS, ready_ns
    for index, leg in enumerate(legs):
        leg_work = work if index or first_work is None else first_work
        sends_ns = leg.sends_ns(time_ns, leg_work)
        if sends_ns is None:
            return 0
        start_ns, end_ns = sends_ns
        if start_ns > time_ns:
            return min(slack_ns, start_ns - time_ns)
        slack_ns = min(slack_ns, leg.end_ns - end_ns, leg.end_ns - 1 - start_ns)
        time_ns = end_ns + leg.owlt_ns
    return slack_ns


def _first(
    pair: _Pair,
    time_ns: int,
    moves: bool,  # noqa: FBT001 - a state of what is at the sender
    work: int,
    *,
    busy: Busy | None,
    latest_ns: int,
) -> tuple[tuple[int, bool, int] | None, int]:
    """How a frame that is at the sender at `time_ns` gets to the receiver first.

    Returns:
        arrival, whether it moves with `time_ns`, and the contact; and by how much later the frame
        may be there before another contact is better.
    """
    best: tuple[int, bool, int] | None = None
    holds_ns = NEVER_NS
    legs = pair.legs
    for index in range(bisect_right(pair.ends_ns, time_ns), len(legs)):
        leg = legs[index]
        least_ns = leg.begin_ns + pair.least_owlt_ns
        if best is not None and least_ns >= best[0]:
            if best[1]:
                holds_ns = min(holds_ns, least_ns - best[0])
            break
        free_ns = time_ns if busy is None else max(time_ns, busy(leg))
        sends_ns = leg.sends_ns(free_ns, work)
        if sends_ns is None or sends_ns[0] > latest_ns:
            continue
        found = sends_ns[1] + leg.owlt_ns, moves and sends_ns[0] == time_ns, leg.number
        if best is not None:
            found, other = sorted((best, found))
            if found[1] and not other[1]:
                holds_ns = min(holds_ns, other[0] - found[0])
        best = found
    return best, holds_ns
