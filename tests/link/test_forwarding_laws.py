"""What holds for every plan and all traffic on a way by other nodes."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import msgspec
from channels import channel, fates, frame, pass_through
from hypothesis import given, settings
from hypothesis import strategies as st
from relayed import NODES, apart, by_hand_ns, hop, hops_of, relayed

from farside.frames import Fate, FrameHop
from farside.link import Blackout, LinkConfig, OneWay
from farside.link.profile.config import DropPolicy
from farside.link.profile.hops.graph import BIT_WORK, ContactGraph
from farside.link.profile.impairments import Jitter, Reorder
from farside.node import NEVER_NS, Direction, Frame, Step, to_ns

END_S = 400.0

few = settings(max_examples=40)

# Light takes a second at least from node to node, so windows of a second are allowed.
contacts = st.builds(
    lambda begin, length, pair, rate, owlt: hop(
        begin, begin + length, pair[0], pair[1], rate, owlt
    ),
    st.integers(0, 90).map(float),
    st.integers(1, 60).map(float),
    st.sampled_from([(a, b) for a in NODES for b in NODES if a != b]),
    st.sampled_from([100, 300, 2000]),
    st.sampled_from([1.0, 2.5, 20.0]),
)
some_ways = st.builds(
    OneWay,
    overhead_byte=st.sampled_from([0, 10]),
    drop=st.sampled_from(DropPolicy),
    queue_frame=st.sampled_from([None, 3]),
    lifetime_s=st.sampled_from([None, 5.0]),
    loss=st.sampled_from([0.0, 0.3]),
    jitter=st.sampled_from([None, Jitter(spread_s=3.0)]),
    reorder=st.sampled_from([None, Reorder(share=0.3, hold_s=4.0)]),
    duplicate=st.sampled_from([0.0, 0.4]),
)
links = st.builds(
    lambda hops, way, store, blackouts: relayed(
        hops, way, store_byte=store, blackouts=blackouts, mtu_byte=128
    ),
    st.lists(contacts, max_size=25).map(apart),
    some_ways,
    st.sampled_from([90, 300, 10**6]),
    st.sampled_from([(), (Blackout(start_s=20.0, end_s=40.0),)]),
)
traffic = st.lists(
    st.tuples(
        st.sampled_from(Direction),
        st.integers(0, 990).map(lambda tenths: tenths / 10),
        st.sampled_from([0, 20, 60, 100]),
        st.integers(0, 2),
        st.sampled_from([None, 0.5, 20.0]),
    ),
    max_size=25,
).map(
    lambda sends: [
        frame(way, n, t_s, size_byte, priority, lifetime_s)
        for n, (way, t_s, size_byte, priority, lifetime_s) in enumerate(
            sorted(sends, key=lambda send: send[1])
        )
    ]
)


@few
@given(links, traffic, st.lists(st.integers(1, 4000), max_size=30))
def test_how_time_is_split_into_windows_makes_no_difference(
    config: LinkConfig, frames: Sequence[Frame], cuts: Sequence[int]
) -> None:
    longest_s = min(20.0, config.lookahead_ns / 1e9) or END_S
    steps = int(END_S / longest_s)
    marks_ns = sorted(
        {to_ns(c / 10) for c in cuts} | {to_ns(longest_s * n) for n in range(1, steps + 1)}
    )
    whole, pieces, now_ns = channel(config).advance(marks_ns[-1], frames), Step([], []), 0
    node = channel(config)
    for until_ns in marks_ns:
        step = node.advance(until_ns, [f for f in frames if now_ns <= f.time_ns < until_ns])
        assert all(f.time_ns >= until_ns for f in step.frames)
        assert all(now_ns <= record.log_time_ns < until_ns for record in step.records)
        pieces = Step(pieces.frames + step.frames, pieces.records + step.records)
        now_ns = until_ns
    assert pieces == whole


@few
@given(links, traffic)
def test_every_frame_has_one_fate_and_its_hops_lead_there(
    config: LinkConfig, frames: Sequence[Frame]
) -> None:
    step = pass_through(config, frames, 100_000.0)
    found = {(f.direction, f.sequence): f for f in fates(step.records) if not f.copy}
    assert sorted(n for _, n in found) == [f.sequence for f in frames]
    lives: defaultdict[tuple[Direction, int], list[FrameHop]] = defaultdict(list)
    for one in hops_of(step.records):
        lives[one.direction, one.sequence].append(one)
    assert config.routing is not None
    for (direction, sequence), fate in found.items():
        source, dest = config.routing.ends(direction)
        life = sorted(lives[direction, sequence], key=lambda one: one.hop)
        assert [one.hop for one in life] == list(range(1, len(life) + 1))
        assert life[0].node == source
        assert life[0].received_ns == fate.queued_ns
        for before, after in pairwise(life):
            assert (before.to, before.arrival_ns) == (after.node, after.received_ns)
        last = life[-1]
        if last.fate is None:
            assert last.to == dest
            assert fate.fate in {Fate.DELIVERED, Fate.LOST, Fate.OUTAGE}
        else:
            assert last.fate is fate.fate
        assert len({one.node for one in life}) >= len(life) - 2


@few
@given(links, traffic)
def test_contacts_carry_one_frame_at_a_time_and_stores_keep_their_bound(
    config: LinkConfig, frames: Sequence[Frame]
) -> None:
    assert config.routing is not None
    graph, hopped = ContactGraph(config.routing.hops), hops_of(pass_through(config, frames).records)
    busy: defaultdict[Any, list[tuple[int, int]]] = defaultdict(list)
    for one in hopped:
        source, _ = config.routing.ends(one.direction)
        if one.node != source and one.fate is not Fate.STORE_FULL:
            assert one.stored_byte <= config.routing.store_byte
        if one.sent_ns is None or one.sent_end_ns is None or one.arrival_ns is None:
            continue
        (leg,) = (
            leg
            for leg in graph.legs
            if (leg.sender, leg.receiver) == (one.node, one.to)
            and leg.begin_ns <= one.sent_ns < leg.end_ns
        )
        assert one.received_ns <= one.sent_ns <= one.sent_end_ns <= leg.end_ns
        assert one.arrival_ns == one.sent_end_ns + leg.owlt_ns
        busy[one.direction, leg.number].append((one.sent_ns, one.sent_end_ns))
    for spans in busy.values():
        assert all(before[1] <= after[0] for before, after in pairwise(sorted(spans)))


@few
@given(st.lists(contacts, max_size=12).map(apart), traffic.filter(bool))
def test_a_frame_alone_arrives_as_early_as_any_way_allows(
    hops: Sequence[Any], frames: Sequence[Frame]
) -> None:
    sent = frames[0]
    config = relayed(hops, mtu_byte=128)
    assert config.routing is not None
    work = len(sent.payload) * 8 * BIT_WORK
    ends = config.routing.ends(sent.direction)
    one = msgspec.structs.replace(sent, lifetime_ns=None)
    arrives_ns = by_hand_ns(ContactGraph(hops).legs, *ends, one.time_ns, works=(work, work))
    found = [f.time_ns for f in pass_through(config, [one], 10_000.0).frames]
    assert found == ([] if arrives_ns == NEVER_NS else [arrives_ns])
