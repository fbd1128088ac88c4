"""Contact-graph routing: the earliest arrival over a plan, against trying all ways."""

from collections.abc import Sequence
from typing import Any

import pytest
from channels import DOWN, fate_of, frame
from hypothesis import given, settings
from hypothesis import strategies as st
from relayed import GROUND, NODES, ROVER, apart, by_hand_ns, hop, relayed

from farside.frames import Fate
from farside.link.profile.hops.graph import BIT_WORK, ContactGraph, Leg, Way
from farside.link.profile.hops.routing import Hop, light_times_ns
from farside.link.profile.schedule import Delay, Schedule
from farside.node import NEVER_NS, NS_PER_S, Direction, to_ns

contacts = st.builds(
    lambda begin, length, pair, rate, owlt: hop(
        begin, begin + length, pair[0], pair[1], rate, owlt
    ),
    st.integers(0, 60).map(float),
    st.integers(1, 40).map(float),
    st.sampled_from([(a, b) for a in NODES for b in NODES if a != b]),
    st.sampled_from([100, 300, 800]),
    st.sampled_from([0.0, 1.0, 2.5, 20.0]),
)


plans = st.lists(contacts, max_size=12).map(apart)
times = st.integers(0, 100 * 10).map(lambda tenths: tenths * NS_PER_S // 10)
works = st.sampled_from([0, 50, 800, 4000]).map(lambda bits: bits * BIT_WORK)


@given(plans, times, works, st.dictionaries(st.integers(0, 11), times, max_size=4))
def test_no_way_arrives_earlier_than_the_one_that_is_found(
    hops: Sequence[Hop], ready_ns: int, work: int, booked_ns: dict[int, int]
) -> None:
    graph = ContactGraph(hops)
    way = graph.earliest(
        ROVER, GROUND, ready_ns, work, busy=lambda leg: booked_ns.get(leg.number, 0)
    )
    by_hand = by_hand_ns(
        graph.legs, ROVER, GROUND, ready_ns, works=(work, work), booked_ns=booked_ns
    )
    assert (NEVER_NS if way is None else way.arrives_ns) == by_hand
    if way is not None:
        assert way.follow(ready_ns, work, lambda leg: booked_ns.get(leg.number, 0)) == by_hand


@given(plans, times, works, st.data())
def test_a_way_holds_for_as_long_as_it_says(
    hops: Sequence[Hop], ready_ns: int, work: int, data: st.DataObject
) -> None:
    graph = ContactGraph(hops)
    way = graph.earliest(ROVER, GROUND, ready_ns, work)
    if way is None:
        return
    assert ready_ns <= way.until_ns
    last_ns = min(way.until_ns, ready_ns + 200 * NS_PER_S)
    later_ns = data.draw(st.sampled_from([ready_ns, last_ns]) | st.integers(ready_ns, last_ns))
    later = graph.earliest(ROVER, GROUND, later_ns, work)
    assert later is not None
    assert later.arrives_ns == way.arrival_ns(later_ns)
    assert way.follow(later_ns, work, lambda _: 0) == later.arrives_ns


@given(plans, st.lists(times, min_size=1, max_size=8), st.sampled_from(Direction))
def test_both_ends_plan_by_the_earliest_arrival(
    hops: Sequence[Hop], moments_ns: Sequence[int], direction: Direction
) -> None:
    link = relayed(hops, mtu_byte=128)
    assert link.routing is not None
    graph, ends = ContactGraph(hops), link.routing.ends(direction)
    delay, schedule = Delay(link.way(direction)), Schedule(link)
    for ready_ns in moments_ns:
        work = 128 * 8 * BIT_WORK
        arrives_ns = by_hand_ns(graph.legs, *ends, ready_ns, works=(0, work))
        if arrives_ns == NEVER_NS:
            assert schedule.opens_ns(direction, ready_ns) >= NEVER_NS
            continue
        # A step of the table takes a microsecond, and is to the safe side.
        soon_ns = by_hand_ns(graph.legs, *ends, ready_ns + 1000, works=(0, work))
        assert arrives_ns - 1 <= ready_ns + delay.at(ready_ns) <= soon_ns + 1
        # What is heard of at that moment was sent then or later, and nothing later is not.
        sent_ns = schedule.sent_by_ns(direction, arrives_ns)
        assert sent_ns >= ready_ns - 1000
        assert sent_ns + delay.at(sent_ns) <= arrives_ns + 1


@settings(max_examples=20)
@given(plans)
def test_no_frame_is_faster_than_the_light_of_the_shortest_way(hops: Sequence[Hop]) -> None:
    least_ns = light_times_ns(hops, ROVER)
    way = ContactGraph(hops).earliest(ROVER, GROUND, 0)
    if way is not None:
        assert way.arrives_ns >= least_ns[GROUND]


def test_of_ways_that_arrive_at_once_the_same_one_always_wins() -> None:
    twins = [hop(0, 10, ROVER, 6, 800, 1.0), hop(0, 10, ROVER, 5, 800, 1.0)]
    last = [hop(0, 10, 5, GROUND, 800, 1.0), hop(0, 10, 6, GROUND, 800, 1.0)]
    direct = [hop(0, 10, ROVER, GROUND, 800, 2.0)]
    for hops in ([*twins, *last], [*reversed(twins), *last], [*last, *twins]):
        way = ContactGraph(hops).earliest(ROVER, GROUND, 0)
        assert way is not None
        assert [leg.receiver for leg in way.legs] == [5, GROUND]
    way = ContactGraph([*twins, *last, *direct]).earliest(ROVER, GROUND, 0)
    assert way is not None
    assert [leg.receiver for leg in way.legs] == [GROUND]


def test_a_later_contact_wins_where_it_arrives_earlier() -> None:
    """The rover could send at once by a far node; a minute later a nearer one rises."""
    hops = [
        hop(0, 100, ROVER, 5, 8000, 1.0),
        hop(0, 400, 5, GROUND, 8000, 300.0),
        hop(60, 100, ROVER, 6, 8000, 1.0),
        hop(0, 400, 6, GROUND, 8000, 10.0),
    ]
    way = ContactGraph(hops).earliest(ROVER, GROUND, 0, 8000 * BIT_WORK)
    assert way is not None
    assert [leg.receiver for leg in way.legs] == [6, GROUND]
    assert way.arrives_ns == to_ns(60 + 1 + 1 + 1 + 10)


@pytest.mark.parametrize(
    "later",
    [
        [hop(60, 100, ROVER, GROUND, 8000, 1.0)],
        [hop(60, 100, ROVER, 5, 8000, 0.5), hop(0, 200, 5, GROUND, 8000, 0.5)],
    ],
)
def test_a_way_holds_until_waiting_for_another_is_better(later: list[Hop]) -> None:
    """What leaves at once takes 10 s; from 51 s on, waiting for the contact at 60 s is sooner."""
    graph = ContactGraph([hop(0, 60, ROVER, GROUND, 8000, 10.0), *later])
    way = graph.earliest(ROVER, GROUND, 0)
    assert way is not None
    assert to_ns(50.0) <= way.until_ns <= to_ns(51.0)
    wait = graph.earliest(ROVER, GROUND, to_ns(52.0))
    assert wait is not None
    assert wait.arrives_ns == to_ns(61.0)


def test_a_way_holds_until_a_node_on_it_is_reached_sooner_otherwise() -> None:
    graph = ContactGraph(
        [
            hop(0, 60, ROVER, 4, 8000, 1.0),
            hop(0, 60, 4, 5, 8000, 1.0),
            hop(3, 60, ROVER, 5, 8000, 0.5),
            hop(0, 60, 5, GROUND, 8000, 10.0),
        ]
    )
    way = graph.earliest(ROVER, GROUND, 0)
    assert way is not None
    assert (len(way.legs), way.until_ns) == (3, to_ns(1.5))


def test_a_plan_of_thousands_of_contacts_is_searched_no_more_often_than_needed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three orbiters in turn, every day of a year: of 6,570 contacts each search looks at a few."""
    hops = []
    for day in range(365):
        for orbiter in (4, 5, 6):
            t_s = day * 86_400.0 + orbiter * 9_000.0
            hops += [
                hop(t_s, t_s + 600.0, ROVER, orbiter, 100_000, 0.01),
                hop(t_s, t_s + 600.0, orbiter, ROVER, 100_000, 0.01),
            ]
            for pair in ((orbiter, GROUND), (GROUND, orbiter)):
                hops.append(hop(t_s + 3_000.0, t_s + 9_000.0, *pair, 10_000, 600.0))
                hops.append(hop(t_s + 30_000.0, t_s + 36_000.0, *pair, 10_000, 600.0))
    looked = searched = 0
    sends_ns, earliest = Leg.sends_ns, ContactGraph.earliest

    def counted(leg: Leg, ready_ns: int, work: int) -> tuple[int, int] | None:
        nonlocal looked
        looked += 1
        return sends_ns(leg, ready_ns, work)

    def search(graph: ContactGraph, *args: Any, **options: Any) -> Way | None:
        nonlocal searched
        searched += 1
        return earliest(graph, *args, **options)

    monkeypatch.setattr(Leg, "sends_ns", counted)
    monkeypatch.setattr(ContactGraph, "earliest", search)
    link = relayed(hops)
    assert len(hops) == 6_570
    assert searched < 2 * len(hops)
    assert looked < 20 * searched
    # A thousand frames, a minute apart: while nothing is in the way, one search serves many.
    searched = 0
    found = fate_of(link, [frame(DOWN, n, 60.0 * n) for n in range(1000)], 400_000.0)
    assert {fate.fate for fate in found.values()} == {Fate.DELIVERED}
    assert searched < 400
