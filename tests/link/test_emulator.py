"""The stand-alone emulator without a clock and without Zenoh."""

import json
from typing import Any

import pytest

from farside.frames import OutageReason
from farside.link.emulator import Delivery, Emulator
from farside.link.emulator.control import OutageState
from farside.link.profile.config import (
    Blackout,
    LinkChange,
    LinkConfig,
    OneWay,
    RateStep,
    Trace,
)
from farside.link.profile.impairments import Jitter, Slots
from farside.node import Direction

UP, DOWN = Direction.UP, Direction.DOWN
MS = 1_000_000


def emulator(**up: Any) -> Emulator[str]:
    return Emulator(LinkConfig(up=OneWay(**up)))


def control(subject: Emulator[str], **change: object) -> None:
    subject.control(json.dumps(change).encode())


def test_a_message_arrives_with_its_cargo_after_its_delay() -> None:
    subject = emulator(delay_s=0.01)
    subject.send(UP, 3, b"north", "cargo")
    assert subject.advance(10 * MS + 3) == []
    assert subject.advance(10 * MS + 4) == [(10 * MS + 3, UP, b"north", "cargo")]


def test_arrivals_are_in_order_of_time_however_they_were_sent() -> None:
    subject: Emulator[str] = Emulator(
        LinkConfig(up=OneWay(delay_s=0.02), down=OneWay(jitter=Jitter(spread_s=0.01)))
    )
    arrived: list[Delivery[str]] = []
    for number in range(100):
        subject.send((UP, DOWN)[number % 2], number * MS, b"x", str(number))
        arrived += subject.advance((number + 1) * MS)
    arrived += subject.advance(1000 * MS)
    assert len(arrived) == 100
    assert [at_ns for at_ns, *_ in arrived] == sorted(at_ns for at_ns, *_ in arrived)


def test_a_message_reported_late_counts_as_sent_now() -> None:
    subject = emulator(delay_s=0.0)
    subject.advance(5 * MS)
    subject.send(UP, 3 * MS, b"x", "late")
    assert subject.advance(5 * MS + 1) == [(5 * MS, UP, b"x", "late")]


def test_every_message_is_in_flight_or_counted_once_by_its_fate() -> None:
    subject = emulator(delay_s=0.01, loss=0.5, duplicate=0.5)
    for number in range(200):
        subject.send(UP, number, b"four", str(number))
    subject.advance(1000)
    assert subject.state().up.counters.in_flight == 200
    arrived = subject.advance(20 * MS)
    counters = subject.state().up.counters
    assert counters.received == counters.delivered + counters.lost == 200
    assert len(arrived) == counters.delivered + counters.duplicated
    assert counters.received_byte == 800
    assert counters.delivered_byte == 4 * counters.delivered
    assert counters.in_flight == 0


def test_it_asks_to_be_called_at_the_next_arrival_and_not_at_all_when_empty() -> None:
    subject = emulator(delay_s=0.0005)
    assert subject.next_ns is None
    subject.send(UP, 0, b"x", "")
    subject.advance(1)
    assert subject.next_ns == 500_000
    subject.advance(500_001)
    assert subject.next_ns is None


@pytest.mark.parametrize(
    "up",
    [
        {"delay_s": 0.05},
        {"rate_bit_s": 8000},
        {"delay_s": 0.05, "rate_bit_s": 8000, "jitter": Jitter(spread_s=0.003)},
        {"delay_s": 0.001, "rate_trace": Trace(times_ms=(7, 7, 90))},
        {"delay_s": 0.01, "slots": Slots(min_s=0.002, max_s=0.03, frames=3)},
        {"rate_bit_s": 80_000, "slots": Slots(max_s=0.01, bytes=40)},
        {"rate_table": (RateStep(t_s=0.0, rate_bit_s=100), RateStep(t_s=0.3, rate_bit_s=800_000))},
    ],
)
def test_called_when_it_asks_to_be_it_is_never_late(up: dict[str, Any]) -> None:
    faster = LinkChange(at_s=0.2, rate_bit_s=16_000)
    subject: Emulator[str] = Emulator(LinkConfig(up=OneWay(**up), changes=(faster,)))
    for number in range(20):
        subject.send(UP, number * MS, bytes(10 + number), "")
    arrived = subject.advance(20 * MS)
    calls = 0
    while (next_ns := subject.next_ns) is not None:
        calls += 1
        arriving = subject.advance(next_ns + 1)
        assert {at_ns for at_ns, *_ in arriving} <= {next_ns}
        arrived += arriving
    assert len(arrived) == 20
    assert calls < 100


def test_a_scheduled_change_survives_a_manual_change_of_another_setting() -> None:
    lossy = LinkChange(at_s=1.0, loss=0.5)
    subject: Emulator[str] = Emulator(LinkConfig(changes=(lossy,)))
    subject.advance(2000 * MS)
    assert subject.state().up.settings == OneWay(loss=0.5)
    control(subject, up={"corrupt": 0.1})
    assert subject.state().up.settings == OneWay(loss=0.5, corrupt=0.1)


def test_it_tells_why_a_direction_is_out() -> None:
    dark = Blackout(start_s=1.0, end_s=2.0)
    subject: Emulator[str] = Emulator(LinkConfig(blackouts=(dark,)))
    assert subject.state().up.outage is None
    subject.advance(1500 * MS)
    assert subject.state().up.outage == OutageState(OutageReason.BLACKOUT, left_s=0.5)
    subject.advance(2000 * MS)
    assert subject.state().up.outage is None
    control(subject, down={"out": True})
    assert subject.state().up.outage is None
    assert subject.state().down.outage == OutageState(OutageReason.CONTROL, left_s=None)


def test_a_rate_replaces_a_rate_table() -> None:
    subject = emulator()
    control(subject, up={"rate_table": [{"t_s": 0.0, "rate_bit_s": 100}]})
    control(subject, up={"rate_bit_s": 50})
    settings = subject.state().up.settings
    assert (settings.rate_bit_s, settings.rate_table) == (50, ())


def test_null_removes_a_setting() -> None:
    subject = emulator(loss=0.5)
    control(subject, both={"loss": None})
    assert subject.state().up.settings == OneWay()


def test_a_partly_invalid_change_is_not_applied_at_all() -> None:
    subject = emulator()
    with pytest.raises(ValueError, match=r"^down\.loss: expected a number >= 0 and <= 1, found 2"):
        control(subject, up={"loss": 0.5, "out": True}, down={"loss": 2})
    assert subject.state() == emulator().state()


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"{",
        b"[]",
        b"{}",
        b"\xff",
        b'{"up": 1}',
        b'{"up": {"out": "yes"}}',
        b'{"up": {"out": []}}',
        b'{"up": {"loss": ' + b"[" * 100_000,
    ],
)
def test_no_payload_raises_anything_but_value_error(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        emulator().control(payload)
