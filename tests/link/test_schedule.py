"""What both ends know beforehand, compared with what the channel does."""

from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.frames import Fate, FrameFate, OutageReason
from farside.link import Blackout, Channel, LinkConfig, OneWay
from farside.link.profile.config import DelayPoint, RateStep, Trace
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, Direction, Frame, to_ns

UP, DOWN = Direction.UP, Direction.DOWN
PASS, BLACKOUT = OutageReason.PASS, OutageReason.BLACKOUT


def link(*outages: tuple[float, float, OutageReason], way: OneWay | None = None) -> LinkConfig:
    way = way or OneWay(delay_s=5.0, rate_bit_s=800)
    return LinkConfig(
        up=way,
        down=way,
        blackouts=tuple(Blackout(start_s=a, end_s=b, reason=why) for a, b, why in outages),
    )


def test_an_uplink_contact_is_one_light_time_before_that_at_the_rover() -> None:
    schedule = Schedule(link((10, 20, PASS)))
    assert schedule.opens_ns(DOWN, to_ns(12)) == to_ns(20)
    assert schedule.opens_ns(UP, to_ns(7)) == to_ns(15)
    assert schedule.opens_ns(UP, to_ns(15)) == to_ns(15)
    assert schedule.closes_ns(UP, to_ns(0)) == to_ns(5)
    assert schedule.closes_ns(DOWN, to_ns(20)) == NEVER_NS


def test_a_blackout_is_not_in_the_schedule() -> None:
    schedule = Schedule(link((10, 20, BLACKOUT)))
    assert schedule.opens_ns(DOWN, to_ns(12)) == to_ns(12)
    assert schedule.closes_ns(DOWN, 0) == NEVER_NS


def test_a_blackout_hides_no_scheduled_outage() -> None:
    schedule = Schedule(link((5, 100, BLACKOUT), (10, 20, PASS)))
    assert schedule.opens_ns(DOWN, to_ns(12)) == to_ns(20)


def test_a_frame_waits_for_a_contact_that_it_fits_into() -> None:
    schedule = Schedule(link((10, 20, PASS), (20.5, 30, PASS)))
    assert schedule.sends_ns(DOWN, to_ns(8), 100) == (to_ns(8), to_ns(9))
    assert schedule.sends_ns(DOWN, to_ns(9.5), 100) == (to_ns(30), to_ns(31))
    assert schedule.sends_ns(DOWN, to_ns(9.5), 20) == (to_ns(9.5), to_ns(9.7))


def test_at_rate_zero_there_is_no_contact() -> None:
    steps = (RateStep(t_s=0, rate_bit_s=800), RateStep(t_s=10, rate_bit_s=0))
    schedule = Schedule(link(way=OneWay(delay_s=5.0, rate_table=steps)))
    assert schedule.sends_ns(DOWN, to_ns(9.5), 100)[0] >= NEVER_NS
    assert schedule.opens_ns(UP, to_ns(10)) == NEVER_NS


def test_a_trace_counts_with_its_mean_rate() -> None:
    way = OneWay(rate_trace=Trace(times_ms=(250, 500, 1000)))
    assert Schedule(link(way=way)).sends_ns(DOWN, 0, 4500) == (0, to_ns(1))


SPANS = st.lists(
    st.tuples(st.integers(0, 90), st.integers(1, 30), st.sampled_from([PASS, BLACKOUT])).map(
        lambda span: (span[0], span[0] + span[1], span[2])
    ),
    max_size=6,
)
WAYS = st.sampled_from(
    [
        OneWay(delay_s=5.0, rate_bit_s=800, queue_byte=10**6),
        OneWay(delay_s=0.0),
        OneWay(
            rate_bit_s=4000,
            overhead_byte=20,
            queue_byte=10**6,
            delay_table=(DelayPoint(t_s=10, delay_s=40), DelayPoint(t_s=100, delay_s=3)),
        ),
    ]
)
TIMES = st.integers(0, 150)


@given(SPANS, WAYS, st.sampled_from(Direction), TIMES, TIMES)
def test_open_time_adds_up(
    spans: Sequence[tuple[int, int, OutageReason]],
    way: OneWay,
    direction: Direction,
    one_s: int,
    other_s: int,
) -> None:
    schedule = Schedule(link(*spans, way=way))
    begin_ns, end_ns = sorted((to_ns(one_s), to_ns(other_s)))
    open_ns = schedule.open_ns_between(direction, begin_ns, end_ns)
    time_ns, expected_ns = begin_ns, 0
    while (time_ns := schedule.opens_ns(direction, time_ns)) < end_ns:
        closes_ns = min(end_ns, schedule.closes_ns(direction, time_ns))
        expected_ns += closes_ns - time_ns
        time_ns = closes_ns
    assert open_ns == expected_ns
    after_ns = schedule.after_open_ns(direction, begin_ns, open_ns)
    assert schedule.open_ns_between(direction, begin_ns, after_ns) == open_ns
    assert after_ns <= end_ns


@given(SPANS, WAYS, st.sampled_from(Direction), TIMES, st.integers(1, 1500))
def test_what_is_sent_when_the_schedule_says_arrives_when_it_says(
    spans: Sequence[tuple[int, int, OutageReason]],
    way: OneWay,
    direction: Direction,
    time_s: int,
    size_byte: int,
) -> None:
    known = [span for span in spans if span[2] is PASS]
    config = link(*known, way=way)
    schedule = Schedule(config)
    begin_ns, end_ns = schedule.sends_ns(direction, to_ns(time_s), size_byte)
    channel = Channel(config, {each: np.random.default_rng(0) for each in Direction})
    step = channel.advance(to_ns(1000), [Frame(direction, 0, begin_ns, bytes(size_byte))])
    (arrived,) = step.frames
    assert arrived.time_ns == end_ns + schedule.delay_ns(direction, end_ns)


@pytest.mark.parametrize("direction", Direction)
@given(SPANS, WAYS, TIMES)
def test_what_is_sent_while_the_schedule_says_closed_is_lost(
    direction: Direction, spans: Sequence[tuple[int, int, OutageReason]], way: OneWay, time_s: int
) -> None:
    known = [span for span in spans if span[2] is PASS]
    config = link(*known, way=way)
    if Schedule(config).opens_ns(direction, to_ns(time_s)) == to_ns(time_s):
        return
    channel = Channel(
        msgspec.structs.replace(
            config,
            up=msgspec.structs.replace(way, rate_bit_s=None),
            down=msgspec.structs.replace(way, rate_bit_s=None),
        ),
        {each: np.random.default_rng(0) for each in Direction},
    )
    step = channel.advance(to_ns(1000), [Frame(direction, 0, to_ns(time_s), b"x")])
    fates = [
        msgspec.json.decode(record.payload, type=FrameFate)
        for record in step.records
        if record.topic == "/link/frame"
    ]
    assert [fate.fate for fate in fates] == [Fate.OUTAGE]
