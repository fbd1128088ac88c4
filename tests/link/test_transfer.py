"""The reliable service, step by step: what is sent again, when, and what is not."""

from itertools import pairwise
from statistics import mean

import numpy as np
import pytest
from transfers import DOWN, GOOD, LOST, SMALL, Pair, link, message

from farside.link.endpoint.receiver import ReliableReceiver
from farside.link.endpoint.segments import ReceptionReport, Segment, encode_part
from farside.link.endpoint.sender import ReliableSender, TransferFullError
from farside.link.endpoint.transfer import TransferConfig
from farside.link.endpoint.wire import FrameError
from farside.node import to_ns, to_s


def test_a_message_arrives_in_one_piece() -> None:
    pair = Pair(link())
    pair.run([bytes(range(200))])
    assert pair.delivered == [bytes(range(200))]
    assert [number for number, _ in pair.sent] == [0, 1, 2, 3]
    assert pair.sender.is_done


def test_an_empty_message_arrives_too() -> None:
    pair = Pair(link())
    pair.run([b"", b"x"])
    assert pair.delivered == [b"", b"x"]


def test_only_lost_segments_are_retransmitted() -> None:
    pair = Pair(link(), fates=[GOOD, LOST, GOOD, LOST])
    pair.run([message(n) for n in range(6)])
    assert [number for number, _ in pair.sent] == [0, 1, 2, 3, 4, 5, 1, 3]


def test_in_order_a_message_waits_for_the_one_before() -> None:
    pair = Pair(link(), fates=[LOST])
    pair.run([message(0), message(1)])
    assert pair.delivered == [message(0), message(1)]


def test_out_of_order_it_does_not() -> None:
    pair = Pair(link(), fates=[LOST], in_order=False)
    pair.run([message(0), message(1)])
    assert pair.delivered == [message(1), message(0)]


def test_the_repeat_makes_up_for_a_lost_report() -> None:
    pair = Pair(link(), fates=[GOOD, GOOD, LOST])
    pair.run([message(0), message(1)])
    assert len(pair.sent) == 2


def test_the_sender_keeps_to_the_rate() -> None:
    pair = Pair(link(rate_bit_s=800))
    pair.run([message(n) for n in range(5)])
    gaps = {later - sooner for (_, sooner), (_, later) in pairwise(pair.sent)}
    size_byte = len(encode_part(Segment(0, 0, True, bytes(64))))
    assert gaps == {to_ns(size_byte * 8 / 800)}


def test_a_message_beyond_the_window_is_refused() -> None:
    sender = ReliableSender(DOWN, link(), SMALL)
    assert list(sender.offer(bytes(15 * 64))) == list(range(15))
    assert sender.room == 1
    with pytest.raises(TransferFullError, match="expected a message of 1 segments of 64 bytes"):
        sender.offer(bytes(65))


def test_no_timer_runs_between_contacts() -> None:
    """Everything in the first pass is lost; nothing more happens before the second."""
    pair = Pair(link(delay_s=30, passes=50), fates=[LOST] * 16)
    pair.run([message(n) for n in range(16)])
    first_pass = [time_ns for _, time_ns in pair.sent if time_ns < to_ns(20)]
    second_pass = [time_ns for _, time_ns in pair.sent[16:] if time_ns < to_ns(120)]
    assert len(first_pass) == 16
    assert second_pass, "it must not stall"
    assert min(second_pass) >= to_ns(100)
    assert pair.delivered == [message(n) for n in range(16)]


def probe_gaps_s(pair: Pair, first: int) -> list[float]:
    """The open time between the probes, which begin with this one of all segments sent."""
    times = [time_ns for _, time_ns in pair.sent[first:]]
    return [
        to_s(pair.schedule.open_ns_between(DOWN, sooner, later))
        for sooner, later in pairwise(times)
    ]


def test_during_silence_single_probes_are_sent_two_seconds_apart_on_average() -> None:
    pair = Pair(link(), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(30)], until_s=600)
    gaps_s = probe_gaps_s(pair, 16)
    assert 1.0 <= min(gaps_s) < 1.05
    assert 2.95 < max(gaps_s) < 3.0
    assert mean(gaps_s) == pytest.approx(2.0, abs=0.05)
    assert [number for number, _ in pair.sent[16:22]] == [0, 1, 2, 3, 4, 5], "oldest first"


def test_probes_take_a_tenth_of_the_rate_at_most() -> None:
    pair = Pair(link(rate_bit_s=100), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=20_000)
    sending_s = len(encode_part(Segment(9, 0, True, bytes(64)))) * 8 / 100
    assert mean(probe_gaps_s(pair, 16)) == pytest.approx(10 * sending_s, rel=0.05)


def test_the_waits_between_probes_keep_time_with_no_period() -> None:
    """Whatever the period, the probes of an hour come in all of its tenths alike."""
    pair = Pair(link(), fates=[LOST] * 3000)
    pair.run([message(n) for n in range(16)], until_s=3600)
    probes_s = np.array([to_s(time_ns) for _, time_ns in pair.sent[16:]])
    for period_s in np.arange(5, 90, 0.25):
        counts, _ = np.histogram(probes_s % period_s, bins=10, range=(0, period_s))
        assert counts.min() > len(probes_s) / 10 * 0.6, period_s


def test_nothing_new_is_sent_during_silence_if_a_reply_can_come_within_the_contact() -> None:
    config = TransferConfig(segment_byte=64, window=200)
    pair = Pair(link(rate_bit_s=800), fates=[LOST] * 1000, config=config)
    pair.run([message(n) for n in range(200)], until_s=60)
    silent_ns = next(time_ns for number, time_ns in pair.sent[1:] if number == 0)
    assert to_ns(2 * 1.3 + 2) < silent_ns < to_ns(10)
    assert all(number < 10 for number, time_ns in pair.sent if time_ns >= silent_ns)


def test_a_report_ends_the_silence() -> None:
    """In a second silence the whole time for a reply passes again before the first probe."""
    pair = Pair(link(), fates=[LOST] * 21)
    pair.run([message(n) for n in range(16)])
    first, begin_ns = len(pair.sent), pair.now_ns
    pair._fates = iter([LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=to_s(begin_ns) + 60)
    assert pair.sent[first + 16][1] - begin_ns > to_ns(2 * 1.3 + 2)
    again_s, before_s = probe_gaps_s(pair, first + 16), probe_gaps_s(pair, 16)
    assert max(again_s) < 3.0
    assert again_s[:4] != before_s[:4], "the waits do not start over"


def test_the_waits_between_probes_count_open_time_only() -> None:
    pair = Pair(link(passes=50), fates=[LOST] * 1000)
    pair.run([message(n) for n in range(16)], until_s=4000)
    gaps_s = probe_gaps_s(pair, 16)
    assert min(gaps_s) >= 1.0
    assert max(gaps_s) < 3.1, "one that cannot leave whole waits for the next contact"
    assert mean(gaps_s) == pytest.approx(2.0, abs=0.05)


def test_after_an_unforeseen_blackout_everything_resumes_at_once() -> None:
    pair = Pair(link(), fates=[LOST] * 40)
    pair.run([message(n) for n in range(60)])
    assert pair.delivered == [message(n) for n in range(60)]
    assert len(pair.sent) < 60 + 40 + 16


def test_with_keeps_on_new_segments_are_sent_once_though_replies_are_overdue() -> None:
    config = TransferConfig(segment_byte=64, window=200, keeps_on=True)
    pair = Pair(link(), fates=[LOST] * 1000, config=config)
    pair.run([message(0)], until_s=100)
    pair.run([message(1)], until_s=130)
    first = next(time_ns for number, time_ns in pair.sent if number == 1)
    assert first < to_ns(120)
    assert len(pair.sent) < 130 / 2, "what was sent before is still only probed"


def test_with_keeps_on_what_is_delivered_first_is_probed_whenever_its_reply_is_overdue() -> None:
    config = TransferConfig(segment_byte=64, window=200, keeps_on=True)
    pair = Pair(link(), fates=[LOST] * 3000, config=config)
    pair.run([message(n) for n in range(20)], until_s=1000)
    numbers = [number for number, _ in pair.sent[20:]]
    assert set(numbers) <= {0, 1, 2}, "replies take so long that the next two are probed as well"
    assert numbers.count(0) > len(numbers) * 0.4
    assert min(pair.again()) >= to_ns(2 * 1.3)


def test_when_heard_again_the_oldest_eight_at_most_are_retransmitted_at_once() -> None:
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


def test_while_no_report_comes_ever_fewer_resumptions_do_anything() -> None:
    """A link up for less than a round trip is down again whenever they arrive."""
    pair = Pair(link(), fates=[LOST] * 3000)
    pair.run([message(0)], until_s=100)
    effective = []
    for call in range(1, 17):
        pair.run(until_s=100 + 20 * call)
        while not pair.sender._is_overdue(pair.now_ns):
            pair.now_ns += to_ns(0.1)
        pair.sender.resume(pair.now_ns)
        effective += [call] * bool(pair.sender._retransmit)
    assert effective == [1, 2, 4, 8, 16]
    pair._fates = iter(())
    pair.run()
    assert pair.sender.is_done
    assert pair.sender._resumptions == 0


def test_a_report_tells_of_what_arrived_though_it_was_sent_again_since() -> None:
    pair = Pair(link())
    pair.sender.offer(message(0))
    pair._say()
    pair._put = lambda *_: None  # type: ignore[method-assign]
    pair.run(until_s=60)
    assert len(pair.sent) > 1
    pair.sender.receive(ReceptionReport(to_ns(2), 1, 0, (), rest=True), pair.now_ns)
    assert pair.sender.is_done


def test_the_receiver_reports_at_once_but_only_once_an_interval() -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    made_s = []
    for tenth in range(30):
        now_ns = tenth * to_ns(0.1)
        receiver.receive(Segment(tenth % 16, 0, True, b"x"), now_ns)
        made_s += [tenth / 10] * bool(receiver.take(now_ns))
    assert made_s == [0.0, 1.0, 2.0]


def reports_s(receiver: ReliableReceiver, until_s: float) -> list[float]:
    made_s = []
    while (due_ns := receiver.next_ns()) is not None and due_ns <= to_ns(until_s):
        assert receiver.take(due_ns)
        made_s.append(to_s(due_ns))
    return made_s


def test_a_report_is_repeated_three_times() -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    receiver.receive(Segment(0, 0, True, b"x"), 0)
    assert reports_s(receiver, 1000) == [0.0, 1.0, 3.0, 7.0]


def test_after_a_duplicate_reports_are_repeated_for_as_long_again_as_they_went_unheard() -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    receiver.receive(Segment(0, 0, True, b"x"), 0)
    reports_s(receiver, 200)
    receiver.receive(Segment(0, 0, True, b"x"), to_ns(200))
    made_s = reports_s(receiver, 1000)
    assert made_s[:4] == [200.0, 201.0, 203.0, 207.0], "the first at once"
    gaps_s = [later - sooner for sooner, later in pairwise(made_s[3:])]
    assert min(gaps_s) >= 1.0
    assert max(gaps_s) < 3.0
    assert 400 <= made_s[-1] < 403


def test_when_no_reply_is_overdue_resuming_retransmits_nothing() -> None:
    pair = Pair(link())
    pair.sender.offer(message(0))
    pair._say()
    pair.sender.resume(to_ns(1))
    assert pair.sender.take(to_ns(1)) is None


def test_a_segment_beyond_the_window_is_refused() -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    receiver.receive(Segment(15, 0, True, b"x"), 0)
    with pytest.raises(FrameError, match="below 16"):
        receiver.receive(Segment(16, 0, True, b"x"), 0)


def test_messages_that_never_end_fill_no_more_than_two_windows() -> None:
    receiver = ReliableReceiver(DOWN, link(), SMALL)
    for number in range(32):
        receiver.receive(Segment(number, 0, False, b"x"), 0)
    with pytest.raises(FrameError, match="messages that end"):
        receiver.receive(Segment(32, 0, False, b"x"), 0)


@pytest.mark.parametrize(("spare", "copies"), [(0.0, 1), (0.15, 2), (0.25, 3), (10.0, 4)])
def test_over_long_light_times_lost_segments_are_sent_in_as_many_copies_as_the_spare_allows(
    spare: float, copies: int
) -> None:
    config = TransferConfig(segment_byte=64, window=100, spare=spare)
    pair = Pair(link(delay_s=40, passes=50), fates=[LOST] * 3, config=config)
    pair.run([message(n) for n in range(60)])
    assert [n for n, _ in pair.sent if n < 3] == [0, 1, 2] * (1 + copies), "round after round"


def test_a_long_report_is_split_into_parts_that_fit() -> None:
    config = TransferConfig(segment_byte=64, window=400, margin_s=0.0)
    pair = Pair(link(rate_bit_s=80_000), fates=[GOOD, LOST] * 100, config=config)
    pair.run([message(n) for n in range(200)])
    assert pair.delivered == [message(n) for n in range(200)]
    assert len(pair.sent) == 300
