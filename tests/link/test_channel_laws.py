"""What holds for every link and all traffic; random impairments and commands in the channel."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from channels import DOWN, UP, channel, fate_of, fates, frame, link, pass_through
from hypothesis import given
from hypothesis import strategies as st

from farside.frames import Fate, LinkOutage, OutageReason
from farside.link import Affected, Blackout, LinkConfig, OneWay
from farside.link.profile.config import (
    AfterLast,
    BitErrorEffect,
    DelayPoint,
    DelayTrace,
    DropPolicy,
    LinkChange,
    RateStep,
    Trace,
)
from farside.link.profile.impairments import (
    CorrelatedLoss,
    FourState,
    GilbertElliott,
    Jitter,
    JitterShape,
    Reorder,
    Slots,
)
from farside.node import Direction, Frame, Step, to_ns

END_S = 400.0

rates = st.one_of(
    st.just({}),
    st.builds(lambda rate: {"rate_bit_s": rate}, st.integers(300, 5000)),
    st.just(
        {
            "rate_table": tuple(
                RateStep(t_s=t_s, rate_bit_s=rate)
                for t_s, rate in ((0.0, 700), (20.0, 0), (45.0, 3000))
            )
        }
    ),
    st.just({"rate_trace": Trace(times_ms=(500, 500, 7000, 9000))}),
)
WRAPPING = DelayTrace(
    points=(DelayPoint(t_s=5.0, delay_s=3.0), DelayPoint(t_s=30.0, delay_s=2.0)),
    at_end=AfterLast.WRAP,
)
delays = st.sampled_from(
    [
        {"delay_s": 2.0},
        {"delay_table": (DelayPoint(t_s=10.0, delay_s=8.0), DelayPoint(t_s=60.0, delay_s=2.0))},
        {"delay_trace": WRAPPING},
    ]
)
impairments = st.fixed_dictionaries(
    {
        "queue_byte": st.sampled_from([400, 10**6]),
        "overhead_byte": st.sampled_from([0, 10]),
        "drop": st.sampled_from(DropPolicy),
        "bit_errors": st.sampled_from(BitErrorEffect),
    },
    optional={
        "queue_frame": st.integers(1, 5),
        "lifetime_s": st.sampled_from([1.0, 5.0]),
        "loss": st.sampled_from(
            [
                0.3,
                GilbertElliott(p=0.2, r=0.4),
                FourState(p13=0.2, p31=0.5, p32=0.3, p14=0.1),
                CorrelatedLoss(probability=0.3, correlation=-0.2),
            ]
        ),
        "bit_error_rate": st.just(3e-4),
        "corrupt": st.just(0.3),
        "jitter": st.builds(
            lambda shape, correlation: Jitter(
                spread_s=3.0,
                shape=shape,
                correlation=correlation,
                mean_s=2.0 if shape.is_centred else 0.0,
                table=(-8192, 0, 8192, 8192) if shape is JitterShape.TABLE else (),
            ),
            shape=st.sampled_from(JitterShape),
            correlation=st.sampled_from([0.0, 0.8]),
        ),
        "reorder": st.builds(
            Reorder,
            share=st.just(0.3),
            hold_s=st.just(4.0),
            correlation=st.sampled_from([0.0, 0.6, -0.3]),
        ),
        "slots": st.sampled_from(
            [Slots(min_s=1.0), Slots(min_s=0.1, max_s=3.0, frames=3), Slots(min_s=0.5, bytes=200)]
        ),
        "duplicate": st.just(0.4),
    },
)
ways = st.builds(
    lambda *parts: OneWay(**parts[0], **parts[1], **parts[2]), rates, delays, impairments
)
changes = st.lists(
    st.builds(
        LinkChange,
        at_s=st.integers(0, 90).map(float),
        direction=st.sampled_from(Affected),
        rate_bit_s=st.sampled_from([None, 400, 4000]),
        loss=st.sampled_from([None, 0.5, GilbertElliott(p=0.5, r=0.5)]),
        jitter=st.sampled_from([None, Jitter(spread_s=1.0)]),
        duplicate=st.sampled_from([None, 0.0, 0.5]),
        slots=st.sampled_from([None, Slots(min_s=0.0, max_s=2.0, frames=2)]),
    ),
    max_size=2,
).map(tuple)
blackouts = st.sampled_from(
    [
        (),
        (
            Blackout(start_s=20.0, end_s=40.0),
            Blackout(start_s=40.0, end_s=41.0, reason=OutageReason.PASS, direction=Affected.UP),
        ),
    ]
)
links = st.builds(
    lambda up, down, changes, blackouts: link(up, down, changes=changes, blackouts=blackouts),
    ways,
    ways,
    changes,
    blackouts,
)
traffic = st.lists(
    st.tuples(
        st.sampled_from(Direction),
        st.integers(0, 990).map(lambda tenths: tenths / 10),
        st.integers(0, 300),
        st.integers(0, 2),
        st.sampled_from([None, 0.5, 20.0]),
    ),
    max_size=40,
).map(
    lambda sends: [
        frame(way, n, t_s, size_byte, priority, lifetime_s)
        for n, (way, t_s, size_byte, priority, lifetime_s) in enumerate(
            sorted(sends, key=lambda send: send[1])
        )
    ]
)


@given(links, traffic, st.lists(st.integers(1, 4000), max_size=30))
def test_how_time_is_split_into_windows_makes_no_difference(
    config: LinkConfig, frames: Sequence[Frame], cuts: Sequence[int]
) -> None:
    # No window is longer than 2 s, the least delay.
    marks_ns = sorted({to_ns(c / 10) for c in cuts} | {to_ns(2.0 * n) for n in range(1, 201)})
    whole = pass_through(config, frames, END_S)
    node, pieces, now_ns = channel(config), Step([], []), 0
    for until_ns in marks_ns:
        step = node.advance(until_ns, [f for f in frames if now_ns <= f.time_ns < until_ns])
        assert all(f.time_ns >= until_ns for f in step.frames)
        assert all(now_ns <= record.log_time_ns < until_ns for record in step.records)
        pieces = Step(pieces.frames + step.frames, pieces.records + step.records)
        now_ns = until_ns
    assert pieces == whole


@given(links, traffic)
def test_every_frame_has_one_fate_and_what_is_delivered_arrives(
    config: LinkConfig, frames: Sequence[Frame]
) -> None:
    step = pass_through(config, frames, 100_000.0)
    found = fates(step.records)
    ids = [fate.sequence for fate in found if fate.copy == 0]
    # A rate trace or table without an end serves all in time.
    assert sorted(ids) == [f.sequence for f in frames]
    delivered = sorted((f.sequence, f.arrival_ns) for f in found if f.fate is Fate.DELIVERED)
    assert delivered == sorted((f.sequence, f.time_ns) for f in step.frames)
    assert all((fate.arrival_ns is None) is (fate.fate is not Fate.DELIVERED) for fate in found)
    assert all((fate.outage is None) is (fate.fate is not Fate.OUTAGE) for fate in found)


@given(links, traffic)
def test_bits_are_flipped_as_recorded(config: LinkConfig, frames: Sequence[Frame]) -> None:
    step = pass_through(config, frames, END_S)
    sent = {f.sequence: f.payload for f in frames}
    wrong = {
        (f.sequence, f.time_ns): sum(
            (a ^ b).bit_count() for a, b in zip(f.payload, sent[f.sequence], strict=True)
        )
        for f in step.frames
    }
    for fate in fates(step.records):
        if fate.fate is Fate.DELIVERED and fate.arrival_ns is not None:
            assert fate.flipped_bits == wrong[fate.sequence, fate.arrival_ns]


@given(ways, traffic)
def test_nothing_is_overtaken_except_by_reordering_and_duplication(
    way: OneWay, frames: Sequence[Frame]
) -> None:
    calm = msgspec.structs.replace(way, reorder=None, duplicate=0.0)
    arrivals = pass_through(link(calm, calm), frames, END_S).frames
    for direction in Direction:
        own = [f.time_ns for f in arrivals if f.direction is direction]
        assert own == sorted(own)


@given(ways, traffic, st.sampled_from(["rate", "loss", "reorder", "duplicate", "blackout"]))
def test_changing_the_rate_or_one_impairment_leaves_the_rest_unchanged(
    way: OneWay, frames: Sequence[Frame], other: str
) -> None:
    """A frame that arrives either way has the same random impairments in both."""
    free: dict[str, Any] = {"rate_bit_s": None, "rate_table": (), "rate_trace": None}
    way = msgspec.structs.replace(way, **free)
    there = [Blackout(start_s=30.0, end_s=50.0)] if other == "blackout" else []
    changes: dict[str, dict[str, Any]] = {
        "rate": {"rate_bit_s": 300},
        "loss": {"loss": 0.5},
        "reorder": {"reorder": Reorder(share=0.5, hold_s=9.0)},
        "duplicate": {"duplicate": 0.9},
        "blackout": {},
    }
    changed = msgspec.structs.replace(way, **changes[other])
    one = fate_of(link(way, way), frames, END_S)
    two = fate_of(link(changed, changed, blackouts=there), frames, END_S)
    queue, out = {Fate.QUEUE_FULL, Fate.EXPIRED}, {Fate.OUTAGE}
    for number, fate in one.items():
        new_fate = two[number]
        if other != "loss" and not {fate.fate, new_fate.fate} & (queue | out):
            assert (new_fate.fate, new_fate.flipped_bits) == (fate.fate, fate.flipped_bits)
        both = fate.arrival_ns is not None and new_fate.arrival_ns is not None
        if other in {"loss", "duplicate", "blackout"} and both:
            assert new_fate.arrival_ns == fate.arrival_ns


def test_frames_held_back_are_overtaken_and_delay_no_others() -> None:
    config = link(up=OneWay(delay_s=1.0, reorder=Reorder(share=0.3, hold_s=5.0)))
    found = fate_of(config, [frame(UP, n, n) for n in range(100)])
    late = {n: fate.arrival_ns - to_ns(n + 1.0) for n, fate in found.items()}
    assert set(late.values()) == {0, to_ns(5.0)}
    assert any(found[n].arrival_ns > found[n + 1].arrival_ns for n in range(99))


def test_a_duplicate_has_a_fate_of_its_own() -> None:
    jitter = Jitter(spread_s=0.5)
    config = link(up=OneWay(delay_s=1.0, duplicate=1.0, jitter=jitter))
    step = pass_through(config, [frame(UP, n, 10 * n) for n in range(20)])
    found = fates(step.records)
    assert [(f.sequence, f.copy) for f in found] == [(n, c) for n in range(20) for c in (0, 1)]
    gaps = [
        two.arrival_ns - one.arrival_ns for one, two in zip(found[::2], found[1::2], strict=True)
    ]
    assert min(gaps) >= 0
    assert len(set(gaps)) > 5
    assert len(step.frames) == 40


def test_jitter_never_overtakes_even_at_full_spread() -> None:
    config = link(up=OneWay(delay_s=1.0, jitter=Jitter(spread_s=1.0)))
    times = [
        f.time_ns for f in pass_through(config, [frame(UP, n, n / 100) for n in range(300)]).frames
    ]
    assert all(a <= b for a, b in pairwise(times))


def test_the_reason_of_an_outage_is_in_the_fate() -> None:
    outage = Blackout(start_s=5.0, end_s=9.0, reason=OutageReason.CONTACT)
    (fate,) = fates(pass_through(link(blackouts=(outage,)), [frame(DOWN, 0, 6.0)]).records)
    assert (fate.fate, fate.outage) == (Fate.OUTAGE, OutageReason.CONTACT)


def test_outages_that_touch_end_and_begin_in_the_log() -> None:
    config = link(
        blackouts=(
            Blackout(start_s=5.0, end_s=9.0, direction=Affected.UP),
            Blackout(start_s=9.0, end_s=12.0, direction=Affected.UP, reason=OutageReason.PASS),
        )
    )
    records = pass_through(config, []).records
    told = [msgspec.json.decode(record.payload, type=LinkOutage) for record in records]
    assert [(one.down, one.reason) for one in told] == [
        (True, OutageReason.BLACKOUT),
        (False, OutageReason.BLACKOUT),
        (True, OutageReason.PASS),
        (False, OutageReason.PASS),
    ]


def test_a_direction_is_out_for_as_long_as_it_is_commanded() -> None:
    node = channel(link())
    node.advance(to_ns(10.0), [])
    node.set_out(DOWN, True)
    node.set_out(DOWN, True)
    dark = node.advance(to_ns(11.0), [frame(DOWN, 0, 10.5), frame(UP, 0, 10.5)])
    node.set_out(DOWN, False)
    light = node.advance(to_ns(13.0), [frame(DOWN, 1, 11.0)])
    assert [f.direction for f in dark.frames + light.frames] == [UP, DOWN]
    outages = [r for r in dark.records + light.records if r.topic == "/link/outage"]
    told = [msgspec.json.decode(record.payload, type=LinkOutage) for record in outages]
    assert [(one.down, one.reason) for one in told] == [
        (True, OutageReason.CONTROL),
        (False, OutageReason.CONTROL),
    ]
    assert [record.log_time_ns for record in outages] == [to_ns(10.0), to_ns(11.0)]
    assert fates(dark.records)[0].outage is OutageReason.CONTROL


def test_a_downlink_frame_being_sent_is_lost_when_the_direction_is_commanded_out() -> None:
    node = channel(link(down=OneWay(delay_s=1.0, rate_bit_s=800)))
    node.advance(to_ns(0.5), [frame(DOWN, 0, 0.0)])
    node.set_out(DOWN, True)
    assert not node.advance(to_ns(2.0), []).frames


def test_a_shorter_delay_lets_what_follows_overtake() -> None:
    node = channel(link(up=OneWay(delay_s=100.0)))
    slow = node.advance(to_ns(1.0), [frame(UP, 0, 0.0)])
    node.change(UP, OneWay(delay_s=2.0))
    fast = node.advance(to_ns(2.0), [frame(UP, 1, 1.0)])
    assert slow.frames[0].time_ns == to_ns(100.0)
    assert fast.frames[0].time_ns == to_ns(3.0)
    records = node.advance(to_ns(101.0), []).records
    assert [fate.sequence for fate in fates(records)] == [1, 0]


def test_scheduled_changes_take_place_at_their_time() -> None:
    change = LinkChange(at_s=50.0, direction=Affected.UP, loss=1.0)
    frames = [frame(way, n, n) for way in Direction for n in range(100)]
    arrived = pass_through(link(changes=(change,)), frames).frames
    assert [f.sequence for f in arrived if f.direction is UP] == list(range(50))
    assert [f.sequence for f in arrived if f.direction is DOWN] == list(range(100))


@pytest.mark.parametrize("way", Direction)
def test_a_frame_sent_after_the_window_is_refused(way: Direction) -> None:
    with pytest.raises(ValueError, match=f"expected {way} frame 3 to be sent in the window"):
        channel(link()).advance(to_ns(1.0), [frame(way, 3, 1.0)])
