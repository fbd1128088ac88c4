"""The transmit queue and the transmitter: which frames wait, go first, or are dropped."""

from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from channels import UP, channel, fate_of, fates, frame, link, pass_through

from farside.frames import Fate
from farside.link import LinkConfig, OneWay
from farside.link.profile.config import AtEnd, DropPolicy, LinkChange, RateStep, Trace
from farside.node import Frame, to_ns, to_s


def slow(**rest: Any) -> LinkConfig:
    """A hundred bytes take a second."""
    return link(up=OneWay(delay_s=1.0, rate_bit_s=800, **rest))


def traced(*times_ms: int, at_end: AtEnd = AtEnd.WRAP, **rest: Any) -> LinkConfig:
    trace = Trace(times_ms=times_ms, at_end=at_end)
    return link(up=OneWay(delay_s=1.0, rate_trace=trace, queue_byte=10**6, **rest))


def sending(
    config: LinkConfig, frames: Sequence[Frame], until_s: float = 1000.0
) -> dict[int, tuple[float, float]]:
    """When each frame began and ended to be sent, in seconds."""
    found = fate_of(config, frames, until_s)
    return {n: (to_s(fate.sent_ns), to_s(fate.sent_end_ns)) for n, fate in found.items()}


def test_the_highest_priority_is_sent_first_and_the_oldest_of_it() -> None:
    frames = [frame(UP, n, 0.1 * n, priority=p) for n, p in enumerate([0, 0, 1, 2, 1])]
    step = pass_through(slow(), frames)
    assert [f.sequence for f in step.frames] == [0, 3, 2, 4, 1]
    assert [fate.priority for fate in fates(step.records)] == [0, 2, 1, 1, 0]


def test_of_frames_handed_over_at_once_the_highest_priority_is_sent_first() -> None:
    step = pass_through(slow(), [frame(UP, 0, 0, priority=1), frame(UP, 1, 0, priority=2)])
    assert [f.sequence for f in step.frames] == [1, 0]


@pytest.mark.parametrize(
    ("policy", "dropped"),
    [(DropPolicy.NEWEST, {4, 5}), (DropPolicy.OLDEST, {1, 2}), (DropPolicy.LOWEST, {2, 3})],
)
@pytest.mark.parametrize("bound", [{"queue_frame": 3}, {"queue_byte": 300}])
def test_a_full_queue_drops_by_its_policy(
    policy: DropPolicy, dropped: set[int], bound: Mapping[str, int]
) -> None:
    # 0 is on the transmitter; 3 is the newest of the least important, then 2.
    priorities = [9, 5, 1, 1, 7, 6]
    frames = [frame(UP, n, 0.1 * n, priority=p) for n, p in enumerate(priorities)]
    found = fate_of(slow(drop=policy, **bound), frames)
    assert {n for n, fate in found.items() if fate.fate is Fate.QUEUE_FULL} == dropped


def test_the_frame_dropped_may_be_the_one_just_handed_over() -> None:
    frames = [frame(UP, n, 0.1 * n, priority=p) for n, p in enumerate([1, 1, 0])]
    found = fate_of(slow(drop=DropPolicy.LOWEST, queue_frame=1), frames)
    assert found[2].fate is Fate.QUEUE_FULL


def test_a_frame_too_large_for_the_queue_displaces_no_other() -> None:
    config = slow(drop=DropPolicy.OLDEST, queue_byte=250)
    found = fate_of(config, [frame(UP, 0, 0), frame(UP, 1, 0.1), frame(UP, 2, 0.2, 300)])
    assert [found[n].fate for n in range(3)] == [Fate.DELIVERED, Fate.DELIVERED, Fate.QUEUE_FULL]


def test_a_frame_larger_than_the_queue_passes_while_the_line_is_free() -> None:
    """The third comes while the second is sent, the fourth as its last bit leaves."""
    times_s = [0.0, 3.0, 4.0, 6.0]
    frames = [frame(UP, n, at_s, 300) for n, at_s in enumerate(times_s)]
    found = fate_of(slow(queue_byte=1), frames)
    assert {n for n, fate in found.items() if fate.fate is Fate.QUEUE_FULL} == {2}
    assert [to_s(found[n].sent_end_ns) for n in (0, 1, 3)] == [3.0, 6.0, 9.0]


def test_a_frame_larger_than_the_queue_does_not_pass_what_waits() -> None:
    frames = [frame(UP, 0, 0), frame(UP, 1, 0), frame(UP, 2, 0, 300)]
    assert fate_of(slow(queue_byte=200), frames)[2].fate is Fate.QUEUE_FULL


@pytest.mark.parametrize("window_s", [0.05, 0.6, 1000.0])
@pytest.mark.parametrize(
    ("first_s", "second_s", "dropped"),
    [(0.4, 0.55, {3, 4}), (0.45, 0.55, {1, 3, 4}), (0.4, 0.45, {1, 3, 4})],
)
def test_a_large_frame_that_waits_for_the_line_to_open_takes_no_room_in_the_queue(
    window_s: float, first_s: float, second_s: float, dropped: set[int]
) -> None:
    """The line is closed from 0.5 s to 2 s; what came first has left by then, or half of it has."""
    steps = [(0.0, 800), (0.5, 0), (2.0, 800)]
    table = tuple(RateStep(t_s=at_s, rate_bit_s=rate) for at_s, rate in steps)
    subject = channel(link(up=OneWay(delay_s=1.0, rate_table=table, queue_byte=150)))
    sizes = [(first_s, 10), (second_s, 300), (0.6, 100), (0.7, 100), (0.8, 300)]
    frames = [frame(UP, n, at_s, size) for n, (at_s, size) in enumerate(sizes)]
    records, now_ns = [], 0
    while now_ns < to_ns(10.0):
        until_ns = now_ns + to_ns(window_s)
        own = [one for one in frames if now_ns <= one.time_ns < until_ns]
        records += subject.advance(until_ns, own).records
        now_ns = until_ns
    full = {fate.sequence for fate in fates(records) if fate.fate is Fate.QUEUE_FULL}
    assert full == dropped


def test_a_drop_is_recorded_when_the_queue_overflows() -> None:
    config = slow(drop=DropPolicy.OLDEST, queue_frame=1)
    step = pass_through(config, [frame(UP, n, 0.25 * n) for n in range(3)])
    assert fates(step.records)[0].sequence == 1
    assert step.records[0].log_time_ns == to_ns(0.5)


def test_a_frame_whose_turn_comes_too_late_expires() -> None:
    frames = [frame(UP, 0, 0), frame(UP, 1, 0.5), frame(UP, 2, 0.5), frame(UP, 3, 0.5, 100, 0, 9.0)]
    step = pass_through(slow(lifetime_s=1.0), frames)
    found = {fate.sequence: fate for fate in fates(step.records)}
    # 1 has waited for half a second at 1 s; 2 for 1.5 s at 2 s; 3 brought more patience.
    assert [found[n].fate for n in range(4)] == [
        Fate.DELIVERED,
        Fate.DELIVERED,
        Fate.EXPIRED,
        Fate.DELIVERED,
    ]
    assert found[2].sent_end_ns == found[2].queued_ns
    assert found[3].sent_ns == to_ns(2.0)


def test_without_a_rate_limit_nothing_waits() -> None:
    config = link(up=OneWay(delay_s=1.0, queue_byte=1, queue_frame=1, lifetime_s=1e-9))
    assert len(pass_through(config, [frame(UP, n, 0) for n in range(9)]).frames) == 9


def test_sending_the_overhead_takes_time() -> None:
    assert sending(slow(overhead_byte=50), [frame(UP, 0, 0)]) == {0: (0.0, 1.5)}


def test_a_frame_still_waiting_has_no_fate_yet() -> None:
    node = channel(slow())
    assert not node.advance(to_ns(1.0), [frame(UP, 0, 0), frame(UP, 1, 0)]).frames
    step = node.advance(to_ns(2.5), [])
    assert [f.sequence for f in step.frames] == [0, 1]
    assert [fate.sequence for fate in fates(step.records)] == [0]


def test_a_rate_table_is_integrated_over_its_steps() -> None:
    steps = ((0.0, 800), (0.5, 0), (10.0, 1600), (20.0, 0))
    table = tuple(RateStep(t_s=t_s, rate_bit_s=rate) for t_s, rate in steps)
    config = link(up=OneWay(delay_s=1.0, rate_table=table))
    frames = [frame(UP, 0, 0.0), frame(UP, 1, 1.0), frame(UP, 2, 30.0)]
    # Half of 0 is sent before the pause; 1 follows; 2 comes too late for ever.
    assert sending(config, frames) == {0: (0.0, 10.25), 1: (10.25, 10.75)}


def test_frames_that_wait_for_a_rate_are_sent_by_priority_and_lifetime() -> None:
    table = (RateStep(t_s=0.0, rate_bit_s=0), RateStep(t_s=100.0, rate_bit_s=800))
    config = link(up=OneWay(delay_s=1.0, rate_table=table))
    frames = [frame(UP, 0, 1.0), frame(UP, 1, 2.0, lifetime_s=50.0), frame(UP, 2, 3.0, priority=1)]
    found = fate_of(config, frames)
    assert found[1].fate is Fate.EXPIRED
    assert [to_s(found[n].sent_ns) for n in (2, 0)] == [100.0, 101.0]


def test_frames_share_an_opportunity_and_a_large_one_takes_several() -> None:
    frames = [frame(UP, 0, 0, 1000), frame(UP, 1, 0, 2000), frame(UP, 2, 0, 1500)]
    # 1500 bytes at 10, 20, 30 … ms: 0 and a third of 1; the rest of 1 with 2 sharing its last.
    assert sending(traced(10), frames) == {0: (0.01, 0.01), 1: (0.01, 0.02), 2: (0.03, 0.03)}


def test_what_an_opportunity_leaves_unused_is_lost() -> None:
    frames = [frame(UP, 0, 0, 100), frame(UP, 1, 0.0105, 100)]
    assert sending(traced(10), frames) == {0: (0.01, 0.01), 1: (0.02, 0.02)}


def test_a_trace_wraps_at_the_time_of_its_last_line() -> None:
    frames = [frame(UP, n, 0, 1500) for n in range(6)]
    times = [start_s for start_s, _ in sending(traced(0, 3, 3), frames).values()]
    assert times == [0.0, 0.003, 0.003, 0.003, 0.006, 0.006]


def test_after_the_end_of_a_trace_frames_wait_for_ever() -> None:
    config = traced(1, 2, at_end=AtEnd.END)
    frames = [frame(UP, 0, 0, 1500), frame(UP, 1, 0, 1501), frame(UP, 2, 0, 1)]
    assert list(sending(config, frames)) == [0]


def test_a_trace_without_times_is_refused() -> None:
    with pytest.raises(ValueError, match="expected the times of a trace, found none"):
        channel(traced())


def test_a_change_of_rate_applies_to_the_rest_of_the_frame_being_sent() -> None:
    config = link(
        up=OneWay(delay_s=1.0, rate_bit_s=800), changes=(LinkChange(at_s=0.75, rate_bit_s=80),)
    )
    assert sending(config, [frame(UP, 0, 0), frame(UP, 1, 0)]) == {0: (0.0, 3.25), 1: (3.25, 13.25)}


def test_when_the_rate_limit_is_lifted_all_waiting_frames_are_sent_at_once() -> None:
    node = channel(slow())
    node.advance(to_ns(0.5), [frame(UP, 0, 0), frame(UP, 1, 0), frame(UP, 2, 0, priority=1)])
    node.change(UP, OneWay(delay_s=1.0))
    step = node.advance(to_ns(1.5), [frame(UP, 3, 0.6)])
    assert [(f.sequence, to_s(f.time_ns)) for f in step.frames] == [
        (2, 1.5),
        (0, 1.5),
        (1, 1.5),
        (3, 1.6),
    ]


def test_at_twenty_minutes_delay_nothing_is_lost_to_a_hidden_limit() -> None:
    node = channel(link(up=OneWay(delay_s=1200.0)))
    count, window_s, arriving = 60_000, 100.0, []
    each = count // 12
    for window in range(12):
        begin_s = window * window_s
        frames = [
            frame(UP, window * each + n, begin_s + n * window_s / each, 1) for n in range(each)
        ]
        step = node.advance(to_ns(begin_s + window_s), frames)
        assert not step.records  # all in flight
        arriving += step.frames
    assert [f.sequence for f in arriving] == list(range(count))
    assert len(node.advance(to_ns(2400.0), []).records) == count
