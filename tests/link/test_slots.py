"""Slots: frames gather, and are let through in bursts."""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import msgspec
import numpy as np
import pytest
from channels import UP, channel, fate_of, frame, link, pass_through
from scipy import stats  # type: ignore[import-untyped]

from farside.frames import Fate
from farside.link import OneWay
from farside.link.profile.config import LinkChange, RateStep, Trace
from farside.link.profile.impairments import Jitter, JitterShape, Slots
from farside.node import Frame, to_ns, to_s


def left_s(frames: Sequence[Frame], slots: Slots | None, **rest: Any) -> dict[int, float]:
    """When the first bit of each frame left, in seconds, of those that were sent."""
    keys = {"delay_s": 1.0, "queue_byte": 10**6} | rest
    found = fate_of(link(up=OneWay(slots=slots, **keys)), frames, 1e4)
    return {n: to_s(fate.sent_ns) for n, fate in found.items() if fate.fate is Fate.DELIVERED}


def at(*times_s: float, size_byte: int = 100) -> list[Frame]:
    return [frame(UP, n, t_s, size_byte) for n, t_s in enumerate(times_s)]


def test_frames_gather_until_their_slot_opens_and_leave_together() -> None:
    # The second slot is asked for when there is something to send again.
    found = left_s(at(10.0, 10.5, 11.9, 12.1, 20.0), Slots(min_s=2.0))
    assert found == {0: 12.0, 1: 12.0, 2: 12.0, 3: 14.1, 4: 22.0}


def test_a_slot_carries_no_more_frames_than_it_may() -> None:
    found = left_s(at(*[10.0] * 5), Slots(min_s=2.0, frames=2))
    assert found == {0: 12.0, 1: 12.0, 2: 14.0, 3: 14.0, 4: 16.0}


def test_a_slot_ends_with_the_frame_that_fills_its_bytes() -> None:
    found = left_s(at(*[10.0] * 5), Slots(min_s=2.0, bytes=250), overhead_byte=10)
    assert found == {0: 12.0, 1: 12.0, 2: 12.0, 3: 14.0, 4: 14.0}


def test_within_a_slot_frames_leave_one_after_the_other_at_the_rate() -> None:
    # 100 bytes take a second. Frame 3 comes while there is something to send, and joins.
    found = left_s(at(10.0, 10.1, 10.2, 14.9, 16.5), Slots(min_s=2.0), rate_bit_s=800)
    assert found == {0: 12.0, 1: 13.0, 2: 14.0, 3: 15.0, 4: 18.5}


def test_the_next_slot_is_asked_for_when_the_last_frame_has_left() -> None:
    found = left_s(at(10.0, 10.1), Slots(min_s=2.0, frames=1), rate_bit_s=800)
    assert found == {0: 12.0, 1: 15.0}


def test_what_does_not_fit_into_the_queue_while_it_waits_is_dropped() -> None:
    assert set(left_s(at(*[10.0] * 5), Slots(min_s=2.0), queue_byte=300)) == {0, 1, 2}
    assert set(left_s(at(10.0, 11.5), Slots(min_s=2.0), lifetime_s=1.0)) == {1}


def test_the_most_important_of_what_waits_goes_first() -> None:
    frames = [frame(UP, n, 10.0, priority=priority) for n, priority in enumerate([0, 3, 1])]
    found = left_s(frames, Slots(min_s=2.0, frames=1))
    assert sorted(found, key=found.__getitem__) == [1, 2, 0]


def test_waits_are_uniform_between_their_limits() -> None:
    found = left_s(at(*(10.0 * n for n in range(1, 400))), Slots(min_s=2.0, max_s=5.0))
    waits = [left - 10.0 * (n + 1) for n, left in found.items()]
    assert stats.kstest(waits, stats.uniform(2.0, 3.0).cdf).pvalue > 1e-4


@pytest.mark.parametrize(
    "rate",
    [
        {"rate_table": (RateStep(t_s=0, rate_bit_s=0), RateStep(t_s=30, rate_bit_s=800_000))},
        {"rate_trace": Trace(times_ms=(30_000, 31_000))},
    ],
)
def test_a_slot_opens_when_the_rate_allows_it(rate: dict[str, Any]) -> None:
    assert left_s(at(10.0), Slots(min_s=2.0), **rate) == {0: 30.0}


def test_slots_may_begin_and_change_on_the_way() -> None:
    config = link(
        up=OneWay(delay_s=1.0),
        changes=(
            LinkChange(at_s=20.0, slots=Slots(min_s=3.0)),
            LinkChange(at_s=41.0, slots=Slots(min_s=5.0)),
        ),
    )
    found = fate_of(config, at(10.0, 25.0, 40.0))
    # The third waits for a slot when they change, and asks again.
    assert [to_s(one.sent_ns) for one in found.values()] == [10.0, 28.0, 46.0]


def test_without_slots_what_waits_for_one_leaves_at_once() -> None:
    node = channel(link(up=(slotted := OneWay(delay_s=1.0, slots=Slots(min_s=60.0)))))
    assert node.advance(to_ns(20.0), at(10.0)).frames == []
    node.change(UP, msgspec.structs.replace(slotted, slots=None))
    (sent,) = node.advance(to_ns(40.0), []).frames
    assert to_s(sent.time_ns) == 21.0


def test_slots_that_are_off_change_no_other_draw() -> None:
    impaired: dict[str, Any] = {"delay_s": 1.0, "loss": 0.3, "duplicate": 0.3, "corrupt": 0.3}
    frames = at(*(float(n) for n in range(200)))
    plain, slotted = (
        pass_through(link(up=OneWay(**impaired, slots=slots)), frames, 1e4)
        for slots in (None, Slots(min_s=0.1, max_s=0.2))
    )
    assert [(f.sequence, f.payload) for f in plain.frames] == [
        (f.sequence, f.payload) for f in slotted.frames
    ]


def test_bursts_are_seen_at_the_other_end() -> None:
    slots = Slots(min_s=0.0, max_s=4.0, frames=5)
    sent = at(*np.arange(10.0, 40.0, 0.5).tolist())
    step = pass_through(link(up=OneWay(delay_s=1.0, slots=slots, queue_byte=10**6)), sent)
    sizes = [len(list(burst)) for _, burst in groupby(step.frames, key=lambda f: f.time_ns)]
    assert sum(sizes) == 60
    assert max(sizes) > 2
    assert max(sizes) <= 5


def test_waits_have_the_distribution_given() -> None:
    wait = Jitter(spread_s=0.5, shape=JitterShape.NORMAL, mean_s=3.0)
    found = left_s(at(*(10.0 * n for n in range(1, 400))), Slots(wait=wait))
    waits = [left - 10.0 * (n + 1) for n, left in found.items()]
    assert stats.kstest(waits, stats.norm(3.0, 0.5).cdf).pvalue > 1e-4


def test_waits_of_two_kinds_or_with_a_memory_are_refused() -> None:
    with pytest.raises(ValueError, match="expected either min_s and max_s or wait, found both"):
        Slots(min_s=1.0, wait=Jitter(spread_s=1.0))
    with pytest.raises(ValueError, match=r"expected waits without correlation, found 0\.5"):
        Slots(wait=Jitter(spread_s=1.0, correlation=0.5))


@pytest.mark.parametrize(("min_s", "max_s"), [(0.0, None), (2.0, 1.0), (0.0, 0.0)])
def test_slots_without_a_wait_or_with_one_the_wrong_way_round_are_refused(
    min_s: float, max_s: float | None
) -> None:
    with pytest.raises(ValueError, match="expected max_s above 0, and min_s or more, found min_s"):
        Slots(min_s=min_s, max_s=max_s)


def test_how_time_is_split_into_windows_makes_no_difference() -> None:
    config = link(up=OneWay(delay_s=1.0, slots=Slots(min_s=0.2, max_s=3.0, frames=2)))
    sent = at(*np.arange(1.0, 20.0, 0.7).tolist())
    whole = pass_through(config, sent, 100.0)
    node, arrived = channel(config), list[Frame]()
    for number in range(200):
        own = [one for one in sent if number * 0.5 <= to_s(one.time_ns) < (number + 1) * 0.5]
        arrived += node.advance(to_ns((number + 1) * 0.5), own).frames
    assert arrived == whole.frames
