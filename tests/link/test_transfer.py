"""The reliable service: whatever happens on the way, everything arrives once, without a storm."""

import heapq
from contextlib import suppress
from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.link import Blackout, LinkConfig, OneWay
from farside.link.endpoint.receiver import ReliableReceiver
from farside.link.endpoint.segments import ReceptionReport, Segment, decode_part, encode_part
from farside.link.endpoint.sender import ReliableSender, TransferFullError
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import FrameError
from farside.link.profile.schedule import Schedule
from farside.node import Direction, to_ns
from farside.topics import OutageReason

UP, DOWN = Direction.UP, Direction.DOWN
GOOD = (0.0,)
LOST = ()
SMALL = TransferConfig(segment_byte=64, window=16, margin_s=1.0, spare=0.0)


@cache
def link(delay_s=1.3, rate_bit_s=8000, passes=0, *, pass_s=20, period_s=100):
    between = (
        Blackout(start_s=n * period_s + pass_s, end_s=(n + 1) * period_s, reason=OutageReason.PASS)
        for n in range(passes)
    )
    one_way = OneWay(delay_s=delay_s, rate_bit_s=rate_bit_s)
    return Schedule(LinkConfig(up=one_way, down=one_way, blackouts=tuple(between)))


class Pair:
    """A sender and a receiver, and between them a link that does as it is told.

    Each frame takes the next of `fates`: the seconds by which its copies are late, none if it is
    lost. When they are used up, all goes well.
    """

    def __init__(self, schedule, fates=(), config=SMALL, *, in_order=True):
        self.schedule, self.config = schedule, config
        self.sender = ReliableSender(DOWN, schedule, config)
        self.receiver = ReliableReceiver(DOWN, schedule, config, in_order=in_order)
        self.now_ns = 0
        self.delivered: list[bytes] = []
        self.sent: list[tuple[int, int]] = []
        self.reported: list[int] = []
        self._fates = iter(fates)
        self._arriving: list[tuple[int, int, bytes]] = []
        self._count = 0

    def run(self, messages=(), until_s=1e6):
        """Offer the messages as there is room, and go on until nothing is left to do."""
        waiting = list(reversed(messages))
        while self.now_ns < to_ns(until_s):
            self._hear()
            while waiting and len(waiting[-1]) <= self.sender.room * self.config.segment_byte:
                if not self.sender.room:
                    break
                self.sender.offer(waiting.pop())
            self._say()
            self._expect_bounds()
            events = [self.sender.next_ns(self.now_ns), self.receiver.next_ns()]
            due = [time_ns for time_ns in events if time_ns is not None]
            due += [entry[0] for entry in self._arriving[:1]]
            if not due:
                return
            assert min(due) > self.now_ns or self._arriving, "what is due has been done"
            self.now_ns = min(due)

    def again(self):
        """The time between one sending of a segment and the next, for all of them."""
        times: dict[int, list[int]] = {}
        for number, time_ns in self.sent:
            times.setdefault(number, []).append(time_ns)
        return [later - sooner for each in times.values() for sooner, later in pairwise(each)]

    def _hear(self):
        while self._arriving and self._arriving[0][0] <= self.now_ns:
            part = decode_part(heapq.heappop(self._arriving)[2])
            if isinstance(part, ReceptionReport):
                self.sender.receive(part, self.now_ns)
            else:
                self.delivered += self.receiver.receive(part, self.now_ns)

    def _say(self):
        while sending := self.sender.take(self.now_ns):
            self.sent.append((sending.number, self.now_ns))
            self._put(DOWN, sending.payload)
        for payload in self.receiver.take(self.now_ns):
            assert len(payload) <= self.config.segment_byte
            self.reported.append(self.now_ns)
            self._put(UP, payload)

    def _put(self, direction, payload):
        begin_ns, end_ns = self.schedule.sends_ns(direction, self.now_ns, len(payload))
        assert begin_ns == self.now_ns, "nothing is sent while the schedule says closed"
        arrival_ns = end_ns + self.schedule.delay_ns(direction, end_ns)
        for late_s in next(self._fates, GOOD):
            heapq.heappush(self._arriving, (arrival_ns + to_ns(late_s), self._count, payload))
            self._count += 1

    def _expect_bounds(self):
        window = self.config.window
        assert len(self.sender._held) <= window
        assert len(self.sender._retransmit) <= window
        assert len(self.receiver._beyond) < window
        assert self.receiver._segments_held <= 2 * window


def message(number, size_byte=64):
    return number.to_bytes(2, "big") * (size_byte // 2)


def test_a_message_arrives_in_one_piece():
    pair = Pair(link())
    pair.run([bytes(range(200))])
    assert pair.delivered == [bytes(range(200))]
    assert [number for number, _ in pair.sent] == [0, 1, 2, 3]
    assert pair.sender.is_done


def test_an_empty_message_arrives_too():
    pair = Pair(link())
    pair.run([b"", b"x"])
    assert pair.delivered == [b"", b"x"]


def test_only_what_was_lost_is_sent_again():
    pair = Pair(link(), fates=[GOOD, LOST, GOOD, LOST])
    pair.run([message(n) for n in range(6)])
    assert [number for number, _ in pair.sent] == [0, 1, 2, 3, 4, 5, 1, 3]


def test_in_order_a_message_waits_for_the_one_before():
    pair = Pair(link(), fates=[LOST])
    pair.run([message(0), message(1)])
    assert pair.delivered == [message(0), message(1)]


def test_out_of_order_it_does_not():
    pair = Pair(link(), fates=[LOST], in_order=False)
    pair.run([message(0), message(1)])
    assert pair.delivered == [message(1), message(0)]


def test_a_lost_report_is_made_good_by_the_next_one():
    pair = Pair(link(), fates=[GOOD, GOOD, LOST])
    pair.run([message(0), message(1)])
    assert len(pair.sent) == 2


def test_the_sender_keeps_to_the_rate():
    pair = Pair(link(rate_bit_s=800))
    pair.run([message(n) for n in range(5)])
    gaps = {later - sooner for (_, sooner), (_, later) in pairwise(pair.sent)}
    size_byte = len(encode_part(Segment(0, 0, True, bytes(64))))
    assert gaps == {to_ns(size_byte * 8 / 800)}


def test_what_is_offered_beyond_the_window_is_refused():
    sender = ReliableSender(DOWN, link(), SMALL)
    assert list(sender.offer(bytes(15 * 64))) == list(range(15))
    assert sender.room == 1
    with pytest.raises(TransferFullError, match="expected a message of 1 segments of 64 bytes"):
        sender.offer(bytes(65))


def test_no_timer_runs_between_contacts():
    """All is lost in the first pass: the next thing to do is in the second one, not before."""
    pair = Pair(link(delay_s=30, passes=50), fates=[LOST] * 16)
    pair.run([message(n) for n in range(16)])
    first_pass = [time_ns for _, time_ns in pair.sent if time_ns < to_ns(20)]
    second_pass = [time_ns for _, time_ns in pair.sent[16:] if time_ns < to_ns(120)]
    assert len(first_pass) == 16
    assert second_pass, "it does not stall"
    assert min(second_pass) >= to_ns(100)
    assert pair.delivered == [message(n) for n in range(16)]


def test_into_silence_go_single_segments_at_intervals_that_double():
    pair = Pair(link(), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(30)], until_s=300)
    probes = [time_ns for _, time_ns in pair.sent[16:]]
    gaps_s = [round((later - sooner) / 1e9) for sooner, later in pairwise(probes)]
    assert gaps_s[:4] == [1, 2, 4, 8]
    assert set(gaps_s[4:]) == {16}
    assert [number for number, _ in pair.sent[16:22]] == [0, 1, 2, 3, 4, 5], "oldest first"


def test_nothing_new_goes_into_silence_if_an_answer_can_come_before_the_contact_ends():
    config = TransferConfig(segment_byte=64, window=200)
    pair = Pair(link(rate_bit_s=800), fates=[LOST] * 1000, config=config)
    pair.run([message(n) for n in range(200)], until_s=60)
    silent_ns = next(time_ns for number, time_ns in pair.sent[1:] if number == 0)
    assert to_ns(2 * 1.3 + 2) < silent_ns < to_ns(10)
    assert all(number < 10 for number, time_ns in pair.sent if time_ns >= silent_ns)


def test_a_report_ends_the_silence():
    """In a second silence the intervals start anew."""
    pair = Pair(link(), fates=[LOST] * 21)
    pair.run([message(n) for n in range(16)])
    first = len(pair.sent)
    pair._fates = iter([LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=pair.now_ns / 1e9 + 40)
    probes = [time_ns for _, time_ns in pair.sent[first + 16 :]]
    assert [round((b - a) / 1e9) for a, b in pairwise(probes)][:4] == [1, 2, 4, 8]


def test_the_intervals_count_open_time_only():
    pair = Pair(link(passes=50), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=1000)
    probes = [time_ns for _, time_ns in pair.sent[16:]]
    open_s = [
        round(pair.schedule.open_ns_between(DOWN, sooner, later) / 1e9)
        for sooner, later in pairwise(probes)
    ]
    assert open_s[:4] == [1, 2, 4, 8]
    assert set(open_s[4:]) == {16}


def test_after_an_unforeseen_blackout_all_goes_on_at_once():
    pair = Pair(link(), fates=[LOST] * 40)
    pair.run([message(n) for n in range(60)])
    assert pair.delivered == [message(n) for n in range(60)]
    assert len(pair.sent) < 60 + 40 + 16


def test_news_goes_out_once_though_answers_are_overdue_where_that_is_asked_for():
    config = TransferConfig(segment_byte=64, window=200, keeps_on=True)
    pair = Pair(link(), fates=[LOST] * 1000, config=config)
    pair.run([message(0)], until_s=100)
    pair.run([message(1)], until_s=130)
    first = next(time_ns for number, time_ns in pair.sent if number == 1)
    assert first < to_ns(120)
    assert max(pair.again()) >= to_ns(15), "what was sent before still backs off"


def test_heard_again_the_oldest_go_out_at_once_and_no_more_than_eight():
    pair = Pair(link(), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=200)
    before = len(pair.sent)
    pair.sender.resume(pair.now_ns)
    oldest = list(pair.sender._retransmit)
    pair._say()
    assert pair.sent[before][1] == pair.now_ns, "the first without waiting, the next behind it"
    assert len(oldest) == 8
    pair.sender.resume(pair.now_ns)
    assert len(pair.sender._retransmit) <= 16


def test_heard_in_time_nothing_is_sent_again():
    pair = Pair(link())
    pair.sender.offer(message(0))
    pair._say()
    pair.sender.resume(to_ns(1))
    assert pair.sender.take(to_ns(1)) is None


def test_a_segment_beyond_the_window_is_refused():
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    receiver.receive(Segment(15, 0, True, b"x"), 0)
    with pytest.raises(FrameError, match="below 16"):
        receiver.receive(Segment(16, 0, True, b"x"), 0)


def test_messages_that_never_end_fill_no_more_than_two_windows():
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    for number in range(32):
        receiver.receive(Segment(number, 0, False, b"x"), 0)
    with pytest.raises(FrameError, match="messages that end"):
        receiver.receive(Segment(32, 0, False, b"x"), 0)


@pytest.mark.parametrize(("spare", "copies"), [(0.0, 1), (0.15, 2), (0.25, 3), (10.0, 4)])
def test_what_is_lost_on_a_long_way_is_sent_in_copies_as_far_as_the_spare_goes(spare, copies):
    config = TransferConfig(segment_byte=64, window=100, spare=spare)
    pair = Pair(link(delay_s=40, passes=50), fates=[LOST] * 3, config=config)
    pair.run([message(n) for n in range(60)])
    assert [n for n, _ in pair.sent if n < 3] == [0, 1, 2] * (1 + copies), "round after round"


def test_a_long_report_comes_in_parts_that_fit():
    config = TransferConfig(segment_byte=64, window=400, margin_s=0.0)
    pair = Pair(link(rate_bit_s=80_000), fates=[GOOD, LOST] * 100, config=config)
    pair.run([message(n) for n in range(200)])
    assert pair.delivered == [message(n) for n in range(200)]
    assert len(pair.sent) == 300


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
)
def test_whatever_happens_everything_arrives_exactly_once(
    schedule, messages, fates, spare, in_order
):
    config = TransferConfig(segment_byte=64, window=16, spare=spare)
    pair = Pair(schedule, fates, config, in_order=in_order)
    pair.run(messages)
    assert pair.sender.is_done
    if in_order:
        assert pair.delivered == messages
    assert sorted(pair.delivered) == sorted(messages)


@settings(deadline=None)
@given(SCHEDULES, st.integers(1, 60), st.lists(FATE, max_size=120))
def test_nothing_is_sent_again_before_its_answer_could_have_come(schedule, count, fates):
    pair = Pair(schedule, fates)
    pair.run([message(n) for n in range(count)])
    there_and_back_ns = 2 * schedule.delay_ns(DOWN, 0)
    assert all(gap_ns >= there_and_back_ns for gap_ns in pair.again())


@settings(deadline=None)
@given(SCHEDULES, st.integers(1, 60))
def test_where_nothing_is_lost_nothing_is_sent_twice(schedule, count):
    pair = Pair(schedule)
    pair.run([message(n) for n in range(count)])
    assert len(pair.sent) == count


@settings(deadline=None)
@given(SCHEDULES, st.lists(st.floats(0, 0.9).map(lambda late_s: (late_s,)), max_size=60))
def test_what_is_late_by_less_than_the_margin_is_not_sent_again(schedule, fates):
    pair = Pair(schedule, fates)
    pair.run([message(n) for n in range(40)])
    assert len(pair.sent) == 40


@given(st.binary(max_size=80))
def test_bytes_that_are_none_of_ours_are_refused(payload):
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
def test_contradictory_segments_raise_one_error_and_take_bounded_memory(segments, in_order):
    receiver = ReliableReceiver(DOWN, link(), SMALL, in_order=in_order)
    for segment in segments:
        try:
            receiver.receive(segment, 0)
        except FrameError:
            continue
        assert receiver._segments_held <= 2 * SMALL.window
        assert len(receiver._beyond) < SMALL.window


@given(st.lists(REPORT, max_size=30))
def test_contradictory_reports_raise_one_error(reports):
    sender = ReliableSender(DOWN, link(), SMALL)
    sender.offer(bytes(64 * 10))
    for now_ns, report in enumerate(reports):
        sender.take(to_ns(now_ns))
        try:
            sender.receive(report, to_ns(now_ns))
        except FrameError:
            continue
        sender.next_ns(to_ns(now_ns))
