"""Frames on their way by other nodes: waiting, sharing, routed anew, dropped, and told of."""

from collections.abc import Sequence

import msgspec
from channels import DOWN, UP, channel, fate_of, fates, frame, link, pass_through
from relayed import GROUND, ROVER, hop, hops_of, relayed

from farside.frames import Fate, FrameHop, LinkOutage, OutageReason
from farside.link import Affected, Blackout, OneWay
from farside.link.profile.config import DropPolicy
from farside.link.profile.impairments import Jitter
from farside.node import to_ns

ORBITER, STATION = 5, 3

# Rover, orbiter, station, ground: the orbiter hears the rover, and a minute later the station it.
RELAY = [
    hop(0, 50, ROVER, ORBITER, 800, 1.0),
    hop(60, 100, ORBITER, STATION, 8000, 300.0),
    hop(0, 9000, STATION, GROUND, 80_000, 2.0),
    hop(0, 9000, GROUND, STATION, 80_000, 2.0),
    hop(100, 200, STATION, ORBITER, 800, 300.0),
    hop(600, 700, ORBITER, ROVER, 8000, 1.0),
]


def down(hops: Sequence[FrameHop], sequence: int = 0) -> list[FrameHop]:
    return [one for one in hops if one.direction is DOWN and one.sequence == sequence]


# --- one frame ------------------------------------------------------------------------------------


def test_light_times_add_up_and_each_hop_is_told() -> None:
    """100 bytes take 1 s to the orbiter, wait there for a minute, 0.1 s on, then 0.01 s."""
    step = pass_through(relayed(RELAY), [frame(DOWN, 0, 10.0)])
    (arrived,) = step.frames
    assert arrived.time_ns == to_ns(60 + 0.1 + 300 + 0.01 + 2)
    up, over, home = down(hops_of(step.records))
    assert up == FrameHop(
        direction=DOWN,
        sequence=0,
        hop=1,
        node=ROVER,
        received_ns=to_ns(10),
        stored_byte=100,
        to=ORBITER,
        sent_ns=to_ns(10),
        sent_end_ns=to_ns(11),
        arrival_ns=to_ns(12),
    )
    assert (over.node, over.to, over.hop) == (ORBITER, STATION, 2)
    assert (over.received_ns, over.sent_ns) == (to_ns(12), to_ns(60))
    assert (home.node, home.to, home.hop) == (STATION, GROUND, 3)
    assert home.arrival_ns == arrived.time_ns
    (fate,) = fates(step.records)
    assert (fate.sent_ns, fate.sent_end_ns) == (to_ns(10), to_ns(11))
    assert (fate.fate, fate.arrival_ns) == (Fate.DELIVERED, arrived.time_ns)


def test_the_way_up_is_another_one() -> None:
    step = pass_through(relayed(RELAY), [frame(UP, 0, 10.0)])
    (arrived,) = step.frames
    assert arrived.time_ns == to_ns(600 + 0.1 + 1)
    assert [one.node for one in hops_of(step.records)] == [GROUND, STATION, ORBITER]


def test_what_is_sent_after_the_last_contact_has_no_way() -> None:
    step = pass_through(relayed(RELAY), [frame(DOWN, 0, 50.0), frame(UP, 1, 203.0)])
    assert not step.frames
    assert [(f.fate, f.sent_ns) for f in fates(step.records)] == [
        (Fate.NO_ROUTE, to_ns(50)),
        (Fate.NO_ROUTE, to_ns(203)),
    ]


# --- several --------------------------------------------------------------------------------------


def test_the_highest_priority_goes_first_then_the_oldest_at_every_node() -> None:
    sent = [frame(DOWN, n, 10.0 + n, priority=n % 2) for n in range(6)]
    step = pass_through(relayed(RELAY), sent)
    assert [one.sequence for one in step.frames] == [1, 3, 5, 0, 2, 4]


def test_a_frame_that_does_not_leave_whole_before_the_contact_ends_takes_the_next() -> None:
    """The orbiter is heard for 2 s, then, 88 s later, for long: 100 bytes take 1 s."""
    hops = [hop(0, 2, ROVER, GROUND, 800, 5.0), hop(90, 99, ROVER, GROUND, 800, 5.0), *RELAY[3:]]
    step = pass_through(relayed(hops), [frame(DOWN, n, 0.5) for n in range(3)])
    assert [one.time_ns for one in step.frames] == [to_ns(6.5), to_ns(96.0), to_ns(97.0)]


def test_what_a_higher_priority_displaces_is_routed_anew() -> None:
    """Frame 0 would just fit before the orbiter sets; a command takes its place."""
    hops = [
        hop(10, 11.5, ROVER, 5, 800, 1.0),
        hop(0, 200, 5, GROUND, 8000, 5.0),
        hop(20, 40, ROVER, 6, 800, 1.0),
        hop(0, 200, 6, GROUND, 8000, 5.0),
        *RELAY[3:],
    ]
    alone = hops_of(pass_through(relayed(hops), [frame(DOWN, 0, 1.0)]).records)
    assert [one.to for one in down(alone)] == [5, GROUND]
    both = hops_of(
        pass_through(relayed(hops), [frame(DOWN, 0, 1.0), frame(DOWN, 1, 2.0, 100, 2)]).records
    )
    assert [one.to for one in down(both, 1)] == [5, GROUND]
    assert [one.to for one in down(both, 0)] == [6, GROUND]
    assert down(both, 0)[0].sent_ns == to_ns(20)


def test_a_full_contact_sends_what_follows_by_another_way() -> None:
    """The near orbiter passes on 2 frames, so what it cannot goes by the far one from the start."""
    hops = [
        hop(0, 90, ROVER, 5, 8000, 1.0),
        hop(10, 12, 5, GROUND, 800, 1.0),
        hop(0, 90, ROVER, 6, 8000, 1.0),
        hop(20, 90, 6, GROUND, 800, 1.0),
        *RELAY[3:],
    ]
    hopped = hops_of(pass_through(relayed(hops), [frame(DOWN, n, 1.0) for n in range(4)]).records)
    assert [down(hopped, n)[0].to for n in range(4)] == [5, 5, 6, 6]


def test_a_frame_goes_another_way_rather_than_queue_for_longer() -> None:
    """At 80 bit/s a frame takes 10 s, wherever that is; the other way is 4 s longer."""
    for first, last in ((8000, 80), (80, 8000)):
        hops = [
            hop(0, 900, ROVER, 5, first, 1.0),
            hop(0, 900, 5, GROUND, last, 1.0),
            hop(0, 900, ROVER, 6, first, 1.0),
            hop(0, 900, 6, GROUND, last, 5.0),
            *RELAY[3:],
        ]
        sent = [frame(DOWN, n, 1.0) for n in range(4)]
        hopped = hops_of(pass_through(relayed(hops), sent).records)
        assert [down(hopped, n)[0].to for n in range(4)] == [5, 6, 5, 6]


def test_a_frame_returns_only_if_nothing_else_leads_on() -> None:
    """At node 5 a command takes its place. Node 4 would be sooner, but there it has been."""
    hops = [
        hop(0, 9, ROVER, 4, 8000, 0.1),
        hop(0, 90, 4, 5, 8000, 0.1),
        hop(20, 21.9, 5, GROUND, 800, 0.1),
        hop(0, 300, 5, 4, 8000, 0.1),
        hop(100, 110, 4, GROUND, 8000, 0.1),
        *RELAY[3:],
    ]
    onward = [hop(0, 300, 5, 6, 8000, 0.1), hop(200, 210, 6, GROUND, 8000, 0.1)]
    sent = [frame(DOWN, 0, 0.0), frame(DOWN, 1, 1.0, priority=1)]
    for plan, nodes in ((hops, [ROVER, 4, 5, 4]), ([*hops, *onward], [ROVER, 4, 5, 6])):
        life = down(hops_of(pass_through(relayed(plan), sent).records))
        assert [one.node for one in life] == nodes
        assert life[-1].to == GROUND


def test_without_light_time_or_length_all_happens_at_once_and_in_order() -> None:
    hops = [hop(0, 9, a, b, 800, 0.0) for a, b in ((ROVER, 5), (5, 4), (4, GROUND))]
    step = pass_through(relayed(hops), [frame(DOWN, 0, 1.0, 0)])
    assert [one.time_ns for one in step.frames] == [to_ns(1.0)]
    assert [one.node for one in hops_of(step.records)] == [ROVER, 5, 4]
    told = [record.topic for record in step.records if record.topic != "/link/outage"]
    assert told == ["/link/hop"] * 3 + ["/link/frame"]


def test_what_may_not_wait_goes_by_a_later_arrival_that_leaves_in_time() -> None:
    hops = [
        hop(0, 90, ROVER, 5, 8000, 1.0),
        hop(0, 90, 5, GROUND, 8000, 200.0),
        hop(20, 90, ROVER, 6, 8000, 1.0),
        hop(0, 90, 6, GROUND, 8000, 1.0),
        *RELAY[3:],
    ]
    sent = [frame(DOWN, 0, 1.0), frame(DOWN, 1, 1.0, lifetime_s=5.0)]
    hopped = hops_of(pass_through(relayed(hops), sent).records)
    assert [down(hopped, n)[0].to for n in (0, 1)] == [6, 5]
    late = [hop(20, 90, ROVER, 6, 8000, 1.0), hop(0, 90, 6, GROUND, 8000, 1.0), *RELAY[3:]]
    found = fate_of(relayed(late), sent)
    assert [found[n].fate for n in (0, 1)] == [Fate.DELIVERED, Fate.EXPIRED]


# --- stores ---------------------------------------------------------------------------------------


def test_a_frame_that_finds_no_room_at_a_node_is_dropped_there() -> None:
    step = pass_through(relayed(RELAY, store_byte=250), [frame(DOWN, n, 2.0 * n) for n in range(3)])
    assert [f.fate for f in fates(step.records)] == [
        Fate.STORE_FULL,
        Fate.DELIVERED,
        Fate.DELIVERED,
    ]
    last = down(hops_of(step.records), 2)[-1]
    assert (last.node, last.fate, last.stored_byte) == (ORBITER, Fate.STORE_FULL, 300)
    assert last.to is None


def test_what_has_left_a_node_makes_room_there() -> None:
    hops = [hop(0, 60, ROVER, 5, 800, 1.0), hop(0, 99, 5, GROUND, 8000, 5.0), *RELAY[3:]]
    found = fate_of(relayed(hops, store_byte=150), [frame(DOWN, n, 4.0 * n) for n in range(10)])
    assert {fate.fate for fate in found.values()} == {Fate.DELIVERED}


def test_the_senders_store_drops_by_its_policy() -> None:
    for drop, dropped in (
        (DropPolicy.NEWEST, 3),
        (DropPolicy.OLDEST, 0),
        (DropPolicy.LOWEST, 2),
    ):
        late = [hop(100, 200, ROVER, GROUND, 800, 1.0), *RELAY[3:]]
        config = relayed(late, OneWay(drop=drop), store_byte=300)
        sent = [frame(DOWN, n, 1.0 * n, priority=int(n != 2)) for n in range(4)]
        found = fate_of(config, sent)
        lost = {n for n in range(4) if found[n].fate is Fate.QUEUE_FULL}
        assert lost == {dropped}


def test_a_frame_larger_than_the_store_leaves_when_the_contact_is_open_and_free() -> None:
    config = relayed(RELAY, store_byte=50)
    found = fate_of(config, [frame(DOWN, 0, 1.0), frame(DOWN, 1, 1.5), frame(DOWN, 2, 1.5, 40)])
    assert found[0].fate is Fate.STORE_FULL  # which is at the orbiter
    assert found[1].fate is Fate.QUEUE_FULL
    assert found[2].fate is Fate.DELIVERED


# --- outages and impairments ----------------------------------------------------------------------


def test_outages_are_at_the_rovers_end() -> None:
    blackouts = (
        Blackout(start_s=10.0, end_s=12.0, direction=Affected.DOWN),
        Blackout(start_s=601.0, end_s=601.2, direction=Affected.UP),
    )
    config = relayed(RELAY, blackouts=blackouts)
    step = pass_through(config, [frame(DOWN, n, 5.0 * n) for n in range(4)] + [frame(UP, 0, 0.0)])
    assert [(f.sequence, f.fate, f.outage) for f in fates(step.records) if f.direction is DOWN] == [
        (2, Fate.OUTAGE, OutageReason.BLACKOUT),
        *((n, Fate.DELIVERED, None) for n in (0, 1, 3)),
    ]
    assert down(hops_of(step.records), 2)[-1].fate is Fate.OUTAGE
    (up,) = (f for f in fates(step.records) if f.direction is UP)
    assert (up.fate, up.outage) == (Fate.OUTAGE, OutageReason.BLACKOUT)


def test_the_time_without_a_first_contact_is_told_as_an_outage_and_loses_nothing() -> None:
    hops = [hop(0, 10, ROVER, GROUND, 800, 1.0), hop(30, 40, ROVER, GROUND, 800, 1.0), *RELAY[3:]]
    step = pass_through(relayed(hops), [frame(DOWN, 0, 15.0)])
    assert [f.time_ns for f in step.frames] == [to_ns(32.0)]
    decode = msgspec.json.Decoder(LinkOutage).decode
    told = [(r.log_time_ns, decode(r.payload)) for r in step.records if r.topic == "/link/outage"]
    assert [(at_ns, one.down) for at_ns, one in told if one.direction is DOWN] == [
        (to_ns(10.0), True),
        (to_ns(30.0), False),
        (to_ns(40.0), True),
    ]


def test_random_impairments_happen_once_for_the_whole_way() -> None:
    way = OneWay(loss=0.25, duplicate=0.5, jitter=Jitter(spread_s=1.0), corrupt=0.5)
    found = fates(
        pass_through(relayed(RELAY, way), [frame(DOWN, n, 0.01 * n, 4) for n in range(400)]).records
    )
    first = [fate for fate in found if not fate.copy]
    lost = sum(fate.fate is Fate.LOST for fate in first)
    assert 60 < lost < 140
    assert 100 < sum(fate.copy for fate in found) < 200
    assert 100 < sum(fate.flipped_bits > 0 for fate in first) < 200


def test_a_link_by_way_of_others_can_be_commanded_out() -> None:
    node = channel(relayed(RELAY))
    node.advance(to_ns(5.0), [])
    assert node.outage(DOWN) is None
    node.set_out(DOWN, out=True)
    step = node.advance(to_ns(20.0), [frame(DOWN, 0, 6.0)])
    assert [fate.fate for fate in fates(step.records)] == [Fate.OUTAGE]
    node.set_out(DOWN, out=False)
    assert node.advance(to_ns(900.0), [frame(DOWN, 1, 21.0)]).frames
    waiting = node.outage(DOWN)
    assert waiting is not None
    assert waiting.reason is OutageReason.CONTACT


def test_what_is_on_its_way_arrives_when_the_contacts_change() -> None:
    """From a direct link to one by an orbiter and back, while frames are under way on each."""
    direct = link(OneWay(delay_s=100.0), OneWay(delay_s=100.0, rate_bit_s=800))
    node = channel(direct)
    first = node.advance(to_ns(10.5), [frame(DOWN, n, 10.0) for n in (0, 1)])
    node.adopt(relayed(RELAY))
    second = node.advance(to_ns(20.0), [frame(DOWN, 2, 12.0)])
    node.adopt(direct)
    third = node.advance(to_ns(900.0), [frame(DOWN, 3, 20.0)])
    assert not first.frames
    # The one that had begun to leave, and the one behind it, go on; then that of the orbiter.
    assert [f.time_ns for f in second.frames] == [to_ns(111.0), to_ns(112.0)]
    assert sorted((f.sequence, f.time_ns) for f in third.frames) == [
        (2, to_ns(60 + 0.1 + 300 + 0.01 + 2)),
        (3, to_ns(121.0)),
    ]
