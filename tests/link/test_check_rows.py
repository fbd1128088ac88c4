"""The check of links that are short, degenerate or at the end of a range: none is refused."""

from typing import Any

import pytest
from link_profiles import resolved

from farside.link import LinkConfig, OneWay
from farside.link.check import CheckReport, CheckVerdict, Measurement, check_link
from farside.link.profile.config import (
    AtEnd,
    BitErrorEffect,
    Blackout,
    DelayPoint,
    DropPolicy,
    LinkChange,
    RateStep,
    Trace,
)
from farside.link.profile.impairments import FourState, GilbertElliott, Jitter, JitterShape, Reorder
from farside.node import Direction

INSIDE, UNKNOWN = CheckVerdict.INSIDE, CheckVerdict.UNKNOWN


def up(**keys: Any) -> LinkConfig:
    return LinkConfig(up=OneWay(**keys), down=OneWay(delay_s=0.1))


def both(blackouts: tuple[Blackout, ...], **keys: Any) -> LinkConfig:
    return LinkConfig(up=OneWay(**keys), down=OneWay(**keys), blackouts=blackouts)


def plan(text: str) -> LinkConfig:
    table = {"contacts": {"file": "plan.ionrc", "ground": 1, "rover": 2}}
    return resolved(table, {"plan.ionrc": text})


SHORT = """\
a contact +0 +10 1 2 100
a contact +0 +10 2 1 100
a contact +20 +30 1 2 300
a contact +20 +30 2 1 300
a range +0 +60 1 2 1
"""
BACK_AND_FORTH = """\
a contact +0 +100 1 2 1000
a contact +0 +100 2 1 1000
a contact +100 +200 1 2 2000
a contact +100 +200 2 1 2000
a contact +200 +300 1 2 1000
a contact +200 +300 2 1 1000
a range +0 +300 1 2 1
"""


def every(period_s: float, out_s: float) -> tuple[Blackout, ...]:
    starts_s = (number * period_s for number in range(100))
    return tuple(Blackout(start_s=start_s, end_s=start_s + out_s) for start_s in starts_s)


def rates(*steps: tuple[float, int]) -> tuple[RateStep, ...]:
    return tuple(RateStep(t_s=t_s, rate_bit_s=rate) for t_s, rate in steps)


def delays(*points: tuple[float, float]) -> tuple[DelayPoint, ...]:
    return tuple(DelayPoint(t_s=t_s, delay_s=delay_s) for t_s, delay_s in points)


LINKS = {
    "contacts of ten seconds": plan(SHORT),
    "rates of a plan that come back": plan(BACK_AND_FORTH),
    "passes of two seconds": both(every(20, 18), delay_s=1.0, rate_bit_s=9600),
    "blackouts a second apart": both(every(2, 1), delay_s=1.0, rate_bit_s=9600),
    "rates that change every two seconds": up(
        rate_table=rates(*((2.0 * n, 9600 + n) for n in range(30)))
    ),
    "changes every two seconds": LinkConfig(
        up=OneWay(delay_s=1.0, rate_bit_s=9600),
        down=OneWay(delay_s=1.0),
        changes=tuple(LinkChange(at_s=2.0 * n, loss=n / 20) for n in range(20)),
    ),
    "a rate that comes back": up(rate_table=rates((0, 8000), (60, 16_000), (120, 8000))),
    "no rate at any time": up(rate_table=rates((0, 0))),
    "100 Gbit/s": up(rate_bit_s=100_000_000_000),
    "as fast as a number can be": up(rate_bit_s=2**63 - 1),
    "1 bit/s": up(rate_bit_s=1, overhead_byte=65_535),
    "the longest delay": up(delay_s=1e9, rate_bit_s=1, jitter=Jitter(spread_s=1e9)),
    "a delay that falls faster than time passes": up(
        delay_table=delays((0, 1e9), (1, 0)), rate_bit_s=1000
    ),
    "a delay that rises at once": up(delay_table=delays((0, 0), (1e-9, 1e6)), rate_bit_s=1000),
    "every bit is wrong": up(bit_error_rate=1.0),
    "every bit is flipped": up(
        bit_error_rate=1.0, bit_errors=BitErrorEffect.FLIP, corrupt=0.5, queue_byte=99
    ),
    "every frame is lost, and bits are wrong": up(loss=1.0, bit_error_rate=1e-4),
    "every frame is lost, at a rate": up(loss=1.0, rate_bit_s=9600),
    "every frame is lost, on a trace": up(loss=1.0, rate_trace=Trace(times_ms=(3, 7))),
    "a chain that never leaves its good state": up(loss=GilbertElliott(p=0, r=0)),
    "a chain that hardly ever leaves it": up(loss=GilbertElliott(p=1e-12, r=0)),
    "a chain that never leaves its bad state": up(loss=GilbertElliott(p=0.5, r=0)),
    "a chain that leaves its states slowly": up(loss=GilbertElliott(p=1e-5, r=1e-6)),
    "a chain that leaves its states every time": up(loss=GilbertElliott(p=1, r=1)),
    "four states without losses": up(loss=FourState(p13=0)),
    "four states without losses, told in full": up(loss=FourState(p13=0, p31=0)),
    "four states of which all frames end in one": up(loss=FourState(p13=1e-3, p31=0)),
    "every frame is held back": up(reorder=Reorder(share=1.0, hold_s=0.1)),
    "every frame is held back, and jitters": up(
        reorder=Reorder(share=1.0, hold_s=0.1), jitter=Jitter(spread_s=0.3), delay_s=1.0
    ),
    "every frame twice": up(duplicate=1.0, corrupt=1.0, rate_bit_s=10**6),
    "jitter below a nanosecond": up(jitter=Jitter(spread_s=1e-12)),
    "jitter that hardly changes": up(jitter=Jitter(spread_s=0.1, correlation=1 - 1e-9)),
    "jitter that turns over": up(
        jitter=Jitter(spread_s=0.1, correlation=1e-9 - 1, shape=JitterShape.EXPONENTIAL)
    ),
    "out at all times": both((Blackout(start_s=0, end_s=1e9),), delay_s=1e9),
    "a trace of many opportunities at once": up(rate_trace=Trace(times_ms=(0, 0, 0, 1, 1))),
    "a trace that ends at once": up(rate_trace=Trace(times_ms=(1,), at_end=AtEnd.END)),
    "a trace of frames larger than an opportunity": up(
        rate_trace=Trace(times_ms=(1, 3, 3, 7)),
        overhead_byte=1600,
        queue_byte=10**6,
        reorder=Reorder(share=0.3, hold_s=0.003),
    ),
    "a trace that is slower than the lifetime": up(
        rate_trace=Trace(times_ms=(1000,)), lifetime_s=0.01, queue_byte=10**5
    ),
    "a queue of one byte": up(rate_bit_s=8000, queue_byte=1),
    "a queue of one frame": up(rate_bit_s=8000, queue_byte=10**6, queue_frame=1),
    "a queue of a gigabyte": up(rate_bit_s=8000, queue_byte=10**9, drop=DropPolicy.OLDEST),
    "a queue of many frames": up(rate_bit_s=8000, queue_byte=10**6, queue_frame=10**5),
    "the shortest lifetime": up(rate_bit_s=8000, lifetime_s=1e-12),
}


def check(link: LinkConfig, frames: int = 300) -> CheckReport:
    return check_link(link, frames=frames)


@pytest.mark.parametrize("name", LINKS)
def test_a_right_link_is_not_refused_and_what_is_not_measured_has_its_reason(name: str) -> None:
    for one in check(LINKS[name]).measurements:
        assert one.verdict in {INSIDE, UNKNOWN}, one
        assert bool(one.why) is (one.verdict is UNKNOWN)


def lines(report: CheckReport, name: str, direction: Direction = Direction.UP) -> list[Measurement]:
    return [
        one for one in report.measurements if one.impairment == name and one.direction is direction
    ]


def test_in_a_window_too_short_for_a_full_queue_the_rest_is_measured_all_the_same() -> None:
    report = check(LINKS["contacts of ten seconds"])
    assert [one.verdict for one in lines(report, "rate")] == [INSIDE, INSIDE]
    slow, fast = lines(report, "queue")
    assert (slow.verdict, fast.verdict) == (UNKNOWN, INSIDE)
    assert slow.why == "a full queue takes 42.8 s to be sent, and no window is longer than 10 s"


def test_rates_that_come_back_are_one_setting() -> None:
    rates_of = lines(check(LINKS["a rate that comes back"]), "rate")
    assert [(one.from_s, one.asked) for one in rates_of] == [(0.0, 8000.0), (60.0, 16_000.0)]


@pytest.mark.parametrize(
    ("model", "share"),
    [
        (GilbertElliott(p=0, r=0), 0.0),
        (GilbertElliott(p=0, r=0, good_loss=0.3), 0.3),
        (FourState(p13=0), 0.0),
        (FourState(p13=0, p31=0), 0.0),
        (FourState(p13=0, p31=0, p14=1.0), 0.5),
    ],
)
def test_a_chain_that_never_leaves_its_first_states_is_asked_for_what_these_lose(
    model: GilbertElliott | FourState, share: float
) -> None:
    (loss,) = lines(check(up(loss=model)), "loss")
    assert loss.asked == pytest.approx(share, abs=1e-15)


def test_a_chain_too_slow_for_the_frames_is_asked_for_what_it_loses_in_them() -> None:
    """Left alone it loses every second frame, but it starts in its good state."""
    (loss,) = lines(check(up(loss=GilbertElliott(p=1e-5, r=1e-5)), frames=1000), "loss")
    assert loss.asked == pytest.approx(1000 * 1e-5 / 2, rel=0.01)


def test_many_settings_are_measured_in_part_and_said_to_be() -> None:
    link = up(rate_table=rates(*((60.0 * n, 1000 + n) for n in range(3000))))
    measured = lines(check(link, frames=100), "rate")
    assert len(measured) == 101
    assert [one.why for one in measured if one.why] == [
        "2,900 more settings, of which only 100 are measured"
    ]


def test_a_link_that_is_never_open_has_nothing_measured() -> None:
    report = check(LINKS["no rate at any time"])
    (loss,) = lines(report, "loss")
    assert (loss.verdict, loss.why) == (UNKNOWN, "nothing can be sent at any time")


def test_two_frames_by_way_of_another_node_need_a_queue_for_both() -> None:
    table = {
        "contacts": {"file": "plan.ionrc", "ground": 1, "rover": 2},
        "up": {"queue_frame": 1},
    }
    plan = """\
a contact +0 +100 1 3 1000
a contact +50 +200 3 2 500
a contact +0 +100 2 3 1000
a contact +150 +250 3 1 500
a range +0 +300 1 3 1
a range +0 +300 2 3 1
"""
    report = check(resolved(table, {"plan.ionrc": plan}), frames=100)
    assert report.passed
    (second,) = lines(report, "second frames out of turn")
    assert second.why == "the queue holds one frame"
