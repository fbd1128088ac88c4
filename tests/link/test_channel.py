"""What the channel does to frames, told frame by frame."""

from collections.abc import Sequence

import pytest
from channels import DOWN, UP, channel, fates, frame, link, pass_through
from hypothesis import given
from hypothesis import strategies as st

from farside.frames import Fate
from farside.link import Affected, Blackout, OneWay
from farside.node import Direction, Step, to_ns


def test_a_frame_arrives_after_serialisation_and_propagation() -> None:
    config = link(up=OneWay(delay_s=1.28, rate_bit_s=2000))
    step = pass_through(config, [frame(UP, 0, 10.0, size_byte=25)])
    (fate,) = fates(step.records)
    assert fate.sent_end_ns == to_ns(10.0) + 25 * 8 * 10**9 // 2000
    assert step.frames[0].time_ns == fate.arrival_ns == to_ns(10.1 + 1.28)
    assert step.records[-1].log_time_ns == fate.arrival_ns


def test_frames_wait_for_each_other_but_not_for_the_other_direction() -> None:
    slow = OneWay(delay_s=0.0, rate_bit_s=800)
    step = pass_through(
        link(up=slow, down=slow), [frame(UP, 0, 0), frame(UP, 1, 0), frame(DOWN, 0, 0)]
    )
    assert [(f.direction, f.time_ns) for f in step.frames] == [
        (DOWN, to_ns(1)),
        (UP, to_ns(1)),
        (UP, to_ns(2)),
    ]


def test_a_full_queue_drops_the_newest_frame_and_records_it() -> None:
    narrow = OneWay(delay_s=0.0, rate_bit_s=800, queue_byte=250)
    step = pass_through(link(up=narrow), [frame(UP, n, 0) for n in range(4)])
    by_sequence = {fate.sequence: fate for fate in fates(step.records)}
    assert [by_sequence[n].fate for n in range(4)] == [
        Fate.DELIVERED,
        Fate.DELIVERED,
        Fate.QUEUE_FULL,
        Fate.QUEUE_FULL,
    ]
    assert by_sequence[3].arrival_ns is None
    assert by_sequence[3].sent_end_ns == by_sequence[3].queued_ns


def test_the_queue_empties_as_frames_leave() -> None:
    narrow = OneWay(delay_s=0.0, rate_bit_s=800, queue_byte=250)
    frames = [frame(UP, 0, 0.0), frame(UP, 1, 0.0), frame(UP, 2, 0.5), frame(UP, 3, 0.6)]
    kept = {f.sequence for f in pass_through(link(up=narrow), frames).frames}
    assert kept == {0, 1, 2}


@pytest.mark.parametrize(
    ("direction", "sent_s", "fate"),
    [
        (UP, 8.9, Fate.DELIVERED),  # arrives at 9.9, before the outage
        (UP, 9.0, Fate.OUTAGE),  # arrives at 10.0, as it begins
        (UP, 18.9, Fate.OUTAGE),  # sent and nearly over, but arrives within it
        (UP, 19.0, Fate.DELIVERED),  # sent during the outage, arrives as it ends
        (DOWN, 9.9, Fate.DELIVERED),  # sent before, on its way while the rover is dark
        (DOWN, 10.0, Fate.OUTAGE),
        (DOWN, 19.9, Fate.OUTAGE),
        (DOWN, 20.0, Fate.DELIVERED),
    ],
)
def test_an_outage_is_at_the_rovers_end(direction: Direction, sent_s: float, fate: Fate) -> None:
    config = link(blackouts=[Blackout(start_s=10.0, end_s=20.0)])
    (found,) = fates(pass_through(config, [frame(direction, 0, sent_s)]).records)
    assert found.fate is fate


def test_a_downlink_frame_is_lost_if_any_of_it_is_sent_in_the_outage() -> None:
    config = link(
        down=OneWay(delay_s=1.0, rate_bit_s=800),
        blackouts=[Blackout(start_s=10.0, end_s=20.0)],
    )
    step = pass_through(config, [frame(DOWN, 0, 9.5), frame(DOWN, 1, 19.0)])
    assert {fate.sequence: fate.fate for fate in fates(step.records)} == {
        0: Fate.OUTAGE,  # 9.5 to 10.5
        1: Fate.OUTAGE,  # 19.0 to 20.0 begins within it
    }


def test_a_blackout_of_one_direction_leaves_the_other() -> None:
    config = link(blackouts=[Blackout(start_s=0.0, end_s=20.0, direction=Affected.UP)])
    step = pass_through(config, [frame(UP, 0, 5), frame(DOWN, 0, 5)])
    assert [f.direction for f in step.frames] == [DOWN]


def test_overlapping_blackouts_are_one_outage_in_the_log() -> None:
    config = link(
        blackouts=[
            Blackout(start_s=15.0, end_s=30.0, direction=Affected.UP),
            Blackout(start_s=10.0, end_s=20.0, direction=Affected.UP),
        ]
    )
    records = pass_through(config, []).records
    assert [(r.topic, r.log_time_ns) for r in records] == [
        ("/link/outage", to_ns(10)),
        ("/link/outage", to_ns(30)),
    ]


def test_losses_are_as_frequent_as_asked_for() -> None:
    config = link(down=OneWay(delay_s=1.0, loss=0.2))
    frames = [frame(DOWN, n, n * 0.1) for n in range(5000)]
    lost = 5000 - len(pass_through(config, frames).frames)
    # five standard deviations of a binomial either way
    assert abs(lost - 1000) < 5 * (5000 * 0.2 * 0.8) ** 0.5


def test_a_blackout_leaves_the_losses_of_other_frames_as_they_were() -> None:
    lossy = OneWay(delay_s=1.0, loss=0.3)
    frames = [frame(UP, n, n) for n in range(200)]
    without = {f.sequence for f in pass_through(link(up=lossy), frames).frames}
    dark = link(up=lossy, blackouts=[Blackout(start_s=50.0, end_s=100.0)])
    with_blackout = {f.sequence for f in pass_through(dark, frames).frames}
    assert with_blackout == {n for n in without if not 50 <= n + 1 < 100}


def test_a_frame_from_another_time_is_refused() -> None:
    node = channel(link())
    node.advance(to_ns(5), [])
    with pytest.raises(ValueError, match=r"expected up frame 7 to be sent in the window"):
        node.advance(to_ns(6), [frame(UP, 7, 4.0)])


@given(
    sends=st.lists(
        st.tuples(st.sampled_from(Direction), st.integers(0, 99), st.integers(1, 300)), max_size=40
    ),
    cuts=st.lists(st.integers(1, 99), max_size=8),
)
def test_how_time_is_split_into_windows_makes_no_difference(
    sends: Sequence[tuple[Direction, int, int]], cuts: Sequence[int]
) -> None:
    config = link(
        up=OneWay(delay_s=0.5, rate_bit_s=900, queue_byte=500, loss=0.2),
        down=OneWay(delay_s=3.0, loss=0.1),
        blackouts=[Blackout(start_s=20.0, end_s=40.0), Blackout(start_s=60.0, end_s=61.0)],
    )
    frames = [
        frame(direction, n, t_s, size)
        for n, (direction, t_s, size) in enumerate(sorted(sends, key=lambda send: send[1]))
    ]
    whole = pass_through(config, frames, until_s=500)
    pieces, node = Step([], []), channel(config)
    for begin, end in zip([0, *sorted(cuts)], [*sorted(cuts), 500], strict=True):
        now = [f for f in frames if to_ns(begin) <= f.time_ns < to_ns(end)]
        step = node.advance(to_ns(end), now)
        pieces = Step(pieces.frames + step.frames, pieces.records + step.records)
    assert pieces == whole


@given(
    st.lists(
        st.tuples(st.sampled_from(Direction), st.integers(0, 99), st.integers(1, 300)), max_size=40
    )
)
def test_every_frame_has_one_fate_and_none_overtakes(
    sends: Sequence[tuple[Direction, int, int]],
) -> None:
    config = link(
        up=OneWay(delay_s=1.0, rate_bit_s=900, queue_byte=500, loss=0.2),
        blackouts=[Blackout(start_s=20.0, end_s=40.0)],
    )
    frames = [
        frame(direction, n, t_s, size)
        for n, (direction, t_s, size) in enumerate(sorted(sends, key=lambda send: send[1]))
    ]
    step = pass_through(config, frames)
    assert sorted(f.sequence for f in fates(step.records)) == [f.sequence for f in frames]
    for way in Direction:
        arrivals = [f.time_ns for f in step.frames if f.direction is way]
        assert arrivals == sorted(arrivals)
    earliest = {f.sequence: f.time_ns + to_ns(1.0) for f in frames}
    assert all(f.time_ns >= earliest[f.sequence] for f in step.frames)
