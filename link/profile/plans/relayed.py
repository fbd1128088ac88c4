"""The link between two nodes of a contact plan by way of others."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

from farside.link.profile.hops.routing import STORE_BYTE, Hop, Routing
from farside.link.profile.plans.contacts import (
    Contact,
    ContactPlanError,
    Plan,
    PlannedLightTimes,
)

_NODES_SHOWN = 20

_Pair = tuple[int, int]
"""A node that sends, and one that receives."""


def has_direct(plan: Plan, ground: int, rover: int) -> bool:
    """Whether the plan has contacts between the two nodes, or lines about them at least."""
    nodes = {ground, rover}
    lines = [{one.source, one.dest} for one in (*plan.problems, *plan.untimed)]
    return nodes in lines or any({one.source, one.dest} == nodes for one in plan.contacts)


def routing_of(plan: Plan, ground: int, rover: int, store_byte: int | None = None) -> Routing:
    """The contacts by which frames may go between `ground` and `rover`, from time 0 on.

    Contacts that lie on no way between the two are left out. Where the light time changes during a
    contact, it counts as two. A direction without a way is out all the time.

    Args:
        plan: the plan.
        ground: node number of the ground.
        rover: node number of the rover.
        store_byte: see `farside.link.profile.hops.routing.Routing`.

    Raises:
        ContactPlanError: if no contacts lead from either to the other, if those of two nodes on the
            way overlap, or a line about them cannot be used.
    """
    pairs = {(one.source, one.dest) for one in plan.contacts}
    useful = _useful(pairs, ground, rover) | _useful(pairs, rover, ground)
    for problem in plan.problems:
        if any(problem.is_about(*pair) for pair in useful):
            raise ContactPlanError(problem.text)
    if not useful:
        raise ContactPlanError(_no_way(pairs, ground, rover))
    light_times: dict[_Pair, PlannedLightTimes] = {}
    hops: list[Hop] = []
    for one in plan.contacts:
        pair = one.source, one.dest
        if pair not in useful or one.end_s <= 0:
            continue
        if pair not in light_times:
            light_times[pair] = PlannedLightTimes(plan, one)
        hops += _hops(one, light_times[pair])
    try:
        return Routing(
            ground=ground,
            rover=rover,
            hops=tuple(hops),
            store_byte=STORE_BYTE if store_byte is None else store_byte,
        )
    except ValueError as error:
        raise ContactPlanError(str(error)) from error


def _useful(pairs: Iterable[_Pair], source: int, dest: int) -> set[_Pair]:
    """The pairs of nodes that lie on any way from `source` to `dest`, times left aside, if any."""
    pairs = {(a, b) for a, b in pairs if b != source and a != dest}
    onward = _reached(source, pairs)
    back = _reached(dest, {(b, a) for a, b in pairs})
    return {(a, b) for a, b in pairs if a in onward and b in back}


def _no_way(pairs: Iterable[_Pair], ground: int, rover: int) -> str:
    nodes = {}
    for node in (ground, rover):
        others = ", ".join(map(str, sorted(_reached(node, pairs) - {node})[:_NODES_SHOWN]))
        nodes[node] = f"from {node} {f'ways to {others} only' if others else 'none'}"
    return (
        f"expected contacts between {ground} and {rover}, directly or by way of other nodes, "
        f"found {' and '.join(nodes.values())}"
    )


def _reached(start: int, pairs: Iterable[_Pair]) -> set[int]:
    following: dict[int, list[int]] = {}
    for a, b in pairs:
        following.setdefault(a, []).append(b)
    reached, new = {start}, [start]
    while new:
        for node in following.get(new.pop(), ()):
            if node not in reached:
                reached.add(node)
                new.append(node)
    return reached


def _hops(contact: Contact, light_time: PlannedLightTimes) -> Iterator[Hop]:
    begin_s = max(0.0, contact.begin_s)
    edges_s = [begin_s, *light_time.changes_s(begin_s, contact.end_s), contact.end_s]
    for start_s, end_s in pairwise(edges_s):
        yield Hop(
            begin_s=start_s,
            end_s=end_s,
            sender=contact.source,
            receiver=contact.dest,
            rate_bit_s=contact.rate_bit_s,
            owlt_s=light_time.from_s(start_s),
        )
