"""The control query: changes while messages pass, all of it or nothing."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from changing_links import DELAYED, ChangeStep, changes, live_through
from hypothesis import given

from farside.frames import OutageReason
from farside.link.emulator import Emulator
from farside.link.emulator.control import EmulatorState
from farside.link.emulator.horizon import look_ahead
from farside.link.profile.config import LinkChange, LinkConfig, OneWay
from farside.link.profile.profile import Profile
from farside.node import NEVER_NS, Direction, to_ns

UP, DOWN = Direction.UP, Direction.DOWN
S = 1_000_000_000


def control(subject: Emulator[int], **change: object) -> EmulatorState:
    return subject.control(json.dumps(change).encode())


def delivered(subject: Emulator[int], times: int, until_s: float) -> set[int]:
    """Send so many messages down at once; which of them arrive."""
    for number in range(times):
        subject.send(DOWN, 0, b"x" * 100, number)
    return {cargo for *_, cargo in subject.advance(to_ns(until_s))}


@pytest.mark.parametrize(
    "change",
    [
        {"down": {"rate_trace": {"file": "x"}, "loss": 0.5}},
        {"up": {"loss": 0.5}, "down": {"loss": 2}},
        {"down": {"loss": 0.5, "out": 1}},
        {"both": {"loss": 0.5}, "blackouts": [{"start_s": 2, "end_s": 1}]},
        {"down": {"out": True}, "both": 3},
        {"both": {"loss": 0.5}, "lost": 1},
        {"up": {"out": True}, "contacts": {"file": "no", "ground": 1, "rover": 2}},
    ],
)
def test_a_change_is_made_as_a_whole_or_not_at_all(change: dict[str, Any]) -> None:
    subject: Emulator[int] = Emulator(DELAYED)
    before = subject.state()
    for _ in range(2):
        with pytest.raises(ValueError, match=r"expected .* found"):
            control(subject, **change)
        assert subject.state() == before


@pytest.mark.parametrize(
    ("payload", "found"),
    [
        (b"", "nothing"),
        (b" \n", "nothing"),
        (b"{}", "none"),
        (b'{"up": {}}', "none"),
        (b"[]", "an array"),
        (b"loss=0.5", "what is no JSON: JSON is malformed"),
        (b"\xff", "what is no JSON"),
        (b'{"a":' * 100_000, "tables nested too deeply"),
        (b" " * 5_000_000, "5000000"),
    ],
)
def test_a_payload_that_is_no_change_is_answered_with_what_one_looks_like(
    payload: bytes, found: str
) -> None:
    with pytest.raises(ValueError, match=r"^expected a change such as {") as refusal:
        Emulator[int](DELAYED).control(payload)
    assert f"found {found}" in str(refusal.value)
    assert len(str(refusal.value)) < 200


def test_tables_nested_as_deeply_as_json_may_be_are_refused_in_words() -> None:
    for depth in (1, 10, 100, 300, 600, 800, 900, 950, 980, 990, 1000, 1010, 5000):
        with pytest.raises(ValueError, match=r"expected "):
            Emulator[int](DELAYED).control(b'{"a":' * depth + b"1" + b"}" * depth)


def test_a_table_is_laid_over_the_profile_with_its_files(tmp_path: Path) -> None:
    (tmp_path / "lte.trace").write_text("0\n4\n")
    profile = Profile({"preset": "moon"}, tmp_path)
    subject: Emulator[int] = Emulator(look_ahead(profile))
    state = control(subject, down={"rate_trace": {"file": "lte.trace"}}, preset="earth-geo")
    assert state.down.settings.rate_trace is not None
    assert state.down.settings.rate_trace.times_ms == (0, 4)
    assert state.up.settings.delay_s == 0.25


def test_what_is_said_of_one_direction_goes_before_what_is_said_of_both() -> None:
    subject: Emulator[int] = Emulator(LinkConfig())
    state = control(
        subject, up={"loss": 0.3, "out": False}, both={"loss": 0.1, "corrupt": 0.2, "out": True}
    )
    assert (state.up.settings.loss, state.down.settings.loss) == (0.3, 0.1)
    assert (state.up.settings.corrupt, state.down.settings.corrupt) == (0.2, 0.2)
    assert state.up.outage is None
    assert state.down.outage is not None


def test_the_changes_in_the_documents_are_taken() -> None:
    page = (Path(__file__).parents[2] / "docs" / "link.md").read_text()
    payloads = page.partition("```json\n")[2].partition("```")[0].splitlines()
    assert len(payloads) == 4
    for payload in payloads:
        Emulator[int](DELAYED).control(payload.encode())


def test_a_change_never_waits_for_a_file(tmp_path: Path) -> None:
    """For a pipe to which nobody writes, or for what the kernel has yet to tell."""
    os.mkfifo(pipe := tmp_path / "pipe")
    subject: Emulator[int] = Emulator(DELAYED)
    for path in (str(pipe), "/proc/kmsg", "/dev/zero"):
        for change in (
            {"down": {"rate_trace": {"file": path}}},
            {"contacts": {"file": path, "ground": 1, "rover": 2}},
            {"ephemeris": {"body": -74, "epoch": "2026-01-01", "kernel": path}},
            {"ephemeris": {"epoch": "2026-01-01", "horizons": path}},
        ):
            with pytest.raises(ValueError, match="expected"):
                control(subject, **change)


def test_times_in_a_change_count_from_the_start() -> None:
    subject: Emulator[int] = Emulator(DELAYED)
    subject.advance(10 * S)
    state = control(subject, blackouts=[{"start_s": 5, "end_s": 30}], changes=[])
    assert state.down.outage is not None
    assert (state.down.outage.reason, state.down.outage.left_s) == (OutageReason.BLACKOUT, 20)
    assert control(subject, blackouts=None).down.outage is None


def test_what_is_said_now_holds_until_a_change_that_is_to_come() -> None:
    changes = (LinkChange(at_s=1.0, loss=0.1, corrupt=0.1), LinkChange(at_s=9.0, loss=0.9))
    subject: Emulator[int] = Emulator(LinkConfig(changes=changes))
    subject.advance(5 * S)
    control(subject, up={"loss": 0.5})
    control(subject, up={"duplicate": 0.5})
    up, down = subject.state().up.settings, subject.state().down.settings
    assert up == OneWay(loss=0.5, corrupt=0.1, duplicate=0.5)
    assert down == OneWay(loss=0.1, corrupt=0.1)
    subject.advance(10 * S)
    assert subject.state().up.settings.loss == 0.9


def test_a_change_leaves_the_chance_of_all_else_as_it_was() -> None:
    """Two links of one seed, of which one is changed; the same messages are lost."""
    lossy = LinkConfig(up=OneWay(), down=OneWay(loss=0.5, delay_s=1.0))
    changed, other = Emulator[int](lossy, 7), Emulator[int](lossy, 7)
    assert delivered(changed, 50, 2.0) == delivered(other, 50, 2.0)
    control(changed, down={"rate_bit_s": 10**9, "queue_byte": 10**6}, up={"loss": 1.0})
    assert delivered(changed, 50, 4.0) == delivered(other, 50, 4.0)


def test_a_new_seed_begins_the_random_streams_anew() -> None:
    lossy = OneWay(loss=0.5, delay_s=1.0)
    changed: Emulator[int] = Emulator(LinkConfig(up=lossy, down=lossy), 7)
    other: Emulator[int] = Emulator(LinkConfig(up=lossy, down=lossy, seed=3))
    assert delivered(changed, 50, 2.0) != (expected := delivered(other, 50, 2.0))
    control(changed, seed=3)
    assert delivered(changed, 50, 4.0) == expected


def test_a_queue_that_drops_is_told_of_once_with_the_key_to_set() -> None:
    slow = OneWay(delay_s=0.0, rate_bit_s=800)
    subject: Emulator[int] = Emulator(LinkConfig(up=slow, down=slow))
    for size in (9000, 8000, 5000):
        subject.send(DOWN, 0, bytes(size), 0)
    subject.advance(1)
    [down] = subject.take_warnings()
    assert down == (
        "down: a message of 8,000 bytes was dropped, since no more than 4,096 bytes may wait to be "
        "sent; down.queue_byte sets how much"
    )
    assert subject.take_warnings() == []
    control(subject, down={"queue_frame": 1})
    subject.send(DOWN, 2, bytes(9), 0)
    subject.send(UP, 2, bytes(9), 0)
    subject.send(UP, 2, bytes(5000), 0)
    subject.advance(9 * S)
    [up] = subject.take_warnings()
    assert up.startswith("up: a message of 5,000 bytes was dropped")


GREATEST = {
    "delay_s": 1e9,
    "jitter": {"spread_s": 1e9, "shape": "exponential", "correlation": 0.999},
    "reorder": {"share": 1.0, "hold_s": 1e9},
    "lifetime_s": 1e9,
    "duplicate": 1.0,
    "corrupt": 1.0,
    "overhead_byte": 65_535,
    "rate_bit_s": 1,
}


@pytest.mark.parametrize("absent", [None, *GREATEST])
def test_the_greatest_values_do_no_harm(absent: str | None) -> None:
    subject: Emulator[int] = Emulator(DELAYED)
    control(subject, both={key: value for key, value in GREATEST.items() if key != absent})
    for number in range(20):
        subject.send(UP, number, bytes(3000), number)
        subject.advance(subject.next_ns or number + 1)
    control(subject, both={"rate_bit_s": None, "bit_error_rate": 1.0, "bit_errors": "flip"})
    subject.send(UP, 0, bytes(3000), 20)
    subject.advance(NEVER_NS)
    counters = subject.state().up.counters
    assert counters.received == counters.delivered + counters.queue_full + counters.bit_error == 21
    assert counters.delivered > 0


@given(changes)
def test_no_change_harms_the_link_neither_at_once_nor_at_the_next_message(
    steps: list[ChangeStep],
) -> None:
    live_through(steps)
