"""The reliable service as laws: everything arrives once, without stalls or floods."""

from collections.abc import Sequence
from contextlib import suppress

from hypothesis import given, settings
from hypothesis import strategies as st
from transfers import DOWN, GOOD, LOST, SMALL, Pair, link, message

from farside.link.endpoint.receiver import ReliableReceiver
from farside.link.endpoint.segments import ReceptionReport, Segment, decode_part
from farside.link.endpoint.sender import ReliableSender
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import FrameError
from farside.link.profile.schedule import Schedule
from farside.node import to_ns

FATE = st.one_of(
    st.just(GOOD),
    st.just(LOST),
    st.lists(st.floats(0, 0.9), min_size=1, max_size=3).map(tuple),
    st.lists(st.floats(0, 90), min_size=1, max_size=3).map(tuple),
)
SCHEDULES = st.builds(
    link,
    delay_s=st.sampled_from([0.0, 1.3, 7.0, 40.0, 300.0]),
    rate_bit_s=st.sampled_from([None, 800, 8000]),
    passes=st.sampled_from([0, 10_000]),
    pass_s=st.sampled_from([6, 20, 80]),
)


@settings(deadline=None)
@given(
    SCHEDULES,
    st.lists(st.binary(max_size=300), max_size=30),
    st.lists(FATE, max_size=120),
    st.sampled_from([0.0, 0.25, 2.0]),
    st.booleans(),
    st.booleans(),
)
def test_whatever_happens_everything_arrives_exactly_once(  # noqa: PLR0917 - drawn in this order
    schedule: Schedule,
    messages: Sequence[bytes],
    fates: Sequence[tuple[float, ...]],
    spare: float,
    keeps_on: bool,
    in_order: bool,
) -> None:
    config = TransferConfig(segment_byte=64, window=16, spare=spare, keeps_on=keeps_on)
    pair = Pair(schedule, fates, config, in_order=in_order)
    pair.run(messages)
    assert pair.sender.is_done
    if in_order:
        assert pair.delivered == messages
    assert sorted(pair.delivered) == sorted(messages)


@settings(deadline=None)
@given(SCHEDULES, st.integers(1, 60), st.lists(FATE, max_size=120), st.booleans())
def test_nothing_is_retransmitted_before_its_reply_could_have_come(
    schedule: Schedule, count: int, fates: Sequence[tuple[float, ...]], keeps_on: bool
) -> None:
    config = TransferConfig(segment_byte=64, window=16, margin_s=1.0, spare=0.0, keeps_on=keeps_on)
    pair = Pair(schedule, fates, config)
    pair.run([message(n) for n in range(count)])
    there_and_back_ns = 2 * schedule.delay_ns(DOWN, 0)
    assert all(gap_ns >= there_and_back_ns for gap_ns in pair.again())


@settings(deadline=None)
@given(SCHEDULES, st.integers(1, 60))
def test_where_nothing_is_lost_nothing_is_sent_twice(schedule: Schedule, count: int) -> None:
    pair = Pair(schedule)
    pair.run([message(n) for n in range(count)])
    assert len(pair.sent) == count


@settings(deadline=None)
@given(SCHEDULES, st.lists(st.floats(0, 0.9).map(lambda late_s: (late_s,)), max_size=60))
def test_what_is_late_by_less_than_the_margin_is_not_retransmitted(
    schedule: Schedule, fates: Sequence[tuple[float, ...]]
) -> None:
    pair = Pair(schedule, fates)
    pair.run([message(n) for n in range(40)])
    assert len(pair.sent) == 40


@given(st.binary(max_size=80))
def test_arbitrary_bytes_are_decoded_or_refused(payload: bytes) -> None:
    with suppress(FrameError):
        decode_part(payload)


SEGMENT = st.builds(
    Segment,
    number=st.integers(0, 40),
    index=st.integers(0, 40),
    last=st.booleans(),
    data=st.binary(max_size=3),
)
REPORT = st.builds(
    ReceptionReport,
    made_ns=st.integers(0, 100),
    base=st.integers(0, 30),
    skipped=st.integers(0, 10),
    runs=st.lists(st.integers(1, 5), max_size=6).map(tuple),
    rest=st.booleans(),
)


@given(st.lists(SEGMENT, max_size=200), st.booleans())
def test_contradictory_segments_raise_only_frame_error_and_take_bounded_memory(
    segments: Sequence[Segment], in_order: bool
) -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL, in_order=in_order)
    for segment in segments:
        try:
            receiver.receive(segment, 0)
        except FrameError:
            continue
        assert receiver._segments_held <= 2 * SMALL.window
        assert len(receiver._beyond) < SMALL.window


@given(st.lists(REPORT, max_size=30))
def test_contradictory_reports_raise_only_frame_error(reports: Sequence[ReceptionReport]) -> None:
    sender = ReliableSender(DOWN, link(), SMALL)
    sender.offer(bytes(64 * 10))
    for now_ns, report in enumerate(reports):
        sender.take(to_ns(now_ns))
        try:
            sender.receive(report, to_ns(now_ns))
        except FrameError:
            continue
        sender.next_ns(to_ns(now_ns))
