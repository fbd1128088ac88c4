"""The check: right emulators pass, and wrong ones do not."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from farside.link import Channel, LinkConfig, OneWay
from farside.link.check import CheckReport, CheckVerdict, check_link
from farside.link.check.report import Measurement
from farside.link.profile.config import (
    Affected,
    AtEnd,
    BitErrorEffect,
    Blackout,
    DelayPoint,
    LinkChange,
    RateStep,
    Trace,
)
from farside.link.profile.impairments import FourState, GilbertElliott, Jitter, JitterShape, Reorder
from farside.link.profile.layers import preset_names
from farside.link.profile.profile import load_profile
from farside.node import Direction, Frame, Step

DAYS_S = 200_000.0
NETEM = sorted((Path(__file__).parent / "profiles").glob("netem-*.toml"))

BAD_WAY = OneWay(
    delay_s=1.5,
    rate_bit_s=1_000_000,
    overhead_byte=20,
    queue_byte=65536,
    loss=0.05,
    corrupt=0.01,
    duplicate=0.03,
    jitter=Jitter(spread_s=0.01, shape=JitterShape.EXPONENTIAL, correlation=0.5),
    reorder=Reorder(share=0.1, hold_s=0.5),
)
BAD = LinkConfig(
    up=BAD_WAY,
    down=BAD_WAY,
    blackouts=tuple(Blackout(start_s=100.0 * n, end_s=100.0 * n + 30) for n in range(1, 20)),
)


def one_way(**keys: Any) -> LinkConfig:
    return LinkConfig(up=OneWay(**keys), down=OneWay(delay_s=0.1))


def outside(report: CheckReport) -> set[tuple[str, str]]:
    return {
        (one.direction.value, one.impairment)
        for one in report.measurements
        if one.verdict is CheckVerdict.OUTSIDE
    }


def measured(report: CheckReport, direction: Direction, impairment: str) -> Measurement:
    (found,) = [
        one
        for one in report.measurements
        if (one.direction, one.impairment) == (direction, impairment)
    ]
    return found


# --- right emulators ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_passes_its_check(name: str) -> None:
    report = check_link(load_profile(name, DAYS_S))
    assert outside(report) == set()
    assert {one.direction for one in report.measurements} == {*Direction}


@pytest.mark.parametrize("profile", NETEM, ids=lambda path: path.stem)
def test_losses_come_as_in_the_models_of_netem(profile: Path) -> None:
    report = check_link(load_profile(profile, DAYS_S))
    assert outside(report) == set()
    assert measured(report, Direction.DOWN, "mean loss burst").verdict is CheckVerdict.INSIDE


RIGHT = {
    "everything at once": BAD,
    "even jitter, anticorrelated": one_way(
        delay_s=0.1, jitter=Jitter(spread_s=0.05, correlation=-0.6)
    ),
    "jitter longer than what is held back": one_way(
        delay_s=0.1, jitter=Jitter(spread_s=0.05), reorder=Reorder(share=0.2, hold_s=0.03)
    ),
    "bit errors that lose frames": one_way(bit_error_rate=1e-5, loss=0.01, overhead_byte=50),
    "bit errors that flip bits": one_way(
        bit_error_rate=1e-4, bit_errors=BitErrorEffect.FLIP, overhead_byte=50, corrupt=0.02
    ),
    "a delay that changes": one_way(
        delay_table=(DelayPoint(t_s=0, delay_s=600), DelayPoint(t_s=90_000, delay_s=640)),
        rate_bit_s=8000,
    ),
    "a rate that changes": one_way(
        rate_table=(
            RateStep(t_s=0, rate_bit_s=8000),
            RateStep(t_s=3600, rate_bit_s=0),
            RateStep(t_s=7200, rate_bit_s=64_000),
        )
    ),
    "a trace that wraps": one_way(
        delay_s=0.2, rate_trace=Trace(times_ms=(1, 3, 3, 10, 25)), queue_byte=16384, loss=0.02
    ),
    "a trace that ends": one_way(
        rate_trace=Trace(times_ms=tuple(range(5, 60_000, 7)), at_end=AtEnd.END), queue_byte=16384
    ),
    "changes on the way": LinkConfig(
        up=OneWay(delay_s=1.0, loss=0.01),
        changes=(
            LinkChange(at_s=60, loss=GilbertElliott(p=0.05, r=0.3)),
            LinkChange(at_s=120, direction=Affected.UP, rate_bit_s=9600, loss=0.2),
        ),
    ),
    "a queue bounded by number": one_way(rate_bit_s=100_000, queue_byte=65536, queue_frame=5),
    "a queue bounded by time": one_way(rate_bit_s=100_000, queue_byte=65536, lifetime_s=2.0),
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_emulator_passes(name: str) -> None:
    assert outside(check_link(RIGHT[name], frames=10_000)) == set()


def test_a_check_is_the_same_every_time() -> None:
    assert check_link(BAD, frames=1000, seed=3) == check_link(BAD, frames=1000, seed=3)
    assert check_link(BAD, frames=1000, seed=3) != check_link(BAD, frames=1000, seed=4)


def test_what_was_too_rare_to_be_measured_is_reported_so() -> None:
    report = check_link(one_way(loss=1e-9), frames=100)
    assert measured(report, Direction.UP, "mean loss burst").verdict is CheckVerdict.UNKNOWN
    assert report.passed


def test_progress_grows_to_the_whole() -> None:
    told: list[float] = []
    check_link(BAD, frames=1000, on_progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


# --- wrong emulators ---------------------------------------------------------------------------


Rngs = Mapping[Direction, np.random.Generator]
Tamper = Callable[[list[Frame]], list[Frame]]


def given_else(**keys: Any) -> Callable[[LinkConfig, Rngs], Channel]:
    """An emulator that uses other settings for the uplink than the profile."""

    def make(config: LinkConfig, rngs: Rngs) -> Channel:
        up = msgspec.structs.replace(config.up, **keys)
        return Channel(msgspec.structs.replace(config, up=up), rngs)

    return make


WRONG_VALUES: dict[str, tuple[dict[str, Any], str]] = {
    "loss 5 % is 6 %": ({"loss": 0.06}, "loss"),
    "losses come in bursts": ({"loss": GilbertElliott(p=0.0263, r=0.5)}, "mean loss burst"),
    "delay + 1 ms": ({"delay_s": 1.501}, "delay"),
    "delay - 1 ms": ({"delay_s": 1.499}, "delay"),
    "jitter even, not exponential": (
        {"jitter": Jitter(spread_s=0.01, correlation=0.5)},
        "jitter, distance",
    ),
    "jitter of the same mean, but even": (
        {"jitter": Jitter(spread_s=0.02, correlation=0.5)},
        "jitter, distance",
    ),
    "no jitter": ({"jitter": None}, "jitter, distance"),
    "rate 3 % too fast": ({"rate_bit_s": 1_030_000}, "rate"),
    "rate 3 % too slow": ({"rate_bit_s": 970_000}, "rate"),
    "overhead forgotten": ({"overhead_byte": 0}, "rate"),
    "duplicates missing": ({"duplicate": 0.0}, "duplication"),
    "too many duplicates": ({"duplicate": 0.04}, "duplication"),
    "corruption absent": ({"corrupt": 0.0}, "corruption"),
    "bit errors not asked for": (
        {"bit_error_rate": 1e-4, "bit_errors": BitErrorEffect.FLIP},
        "corruption",
    ),
    "nothing overtakes": ({"reorder": None}, "pairs overtaken"),
    "too much overtakes": ({"reorder": Reorder(share=0.13, hold_s=0.5)}, "pairs overtaken"),
    "a queue too long": ({"queue_byte": 80_000}, "queue"),
    "a queue too short": ({"queue_byte": 50_000}, "queue"),
}


@pytest.mark.parametrize("name", WRONG_VALUES)
def test_a_wrong_emulator_is_caught(name: str) -> None:
    keys, impairment = WRONG_VALUES[name]
    report = check_link(
        BAD, given_else(**keys), frames=40_000 if {"loss", "reorder"} & {*keys} else 10_000
    )
    assert ("up", impairment) in outside(report)
    assert {direction for direction, _ in outside(report)} == {"up"}
    assert not report.passed


def test_jitter_that_is_always_the_same_is_caught() -> None:
    config = one_way(delay_s=0.1, jitter=Jitter(spread_s=0.05))
    report = check_link(config, given_else(jitter=None), frames=2000)
    assert outside(report) == {("up", "jitter, distance"), ("up", "jitter, correlation")}


def test_frames_that_nobody_sent_are_caught() -> None:
    def more(frames: Sequence[Frame]) -> list[Frame]:
        return [*frames, *(changed(frame, sequence=frame.sequence + 10**6) for frame in frames)]

    found = outside(check_link(one_way(delay_s=0.1), tampering(more), frames=1000))
    assert found == {("up", "records that disagree"), ("down", "records that disagree")}


def test_jitter_without_its_correlation_is_caught() -> None:
    config = one_way(delay_s=0.1, jitter=Jitter(spread_s=0.05, correlation=0.3))
    wrong = given_else(jitter=Jitter(spread_s=0.05, correlation=0.25))
    assert outside(check_link(config, wrong)) == {("up", "jitter, correlation")}


@pytest.mark.parametrize(
    ("asked", "wrong"),
    [
        (GilbertElliott(p=0.05, r=0.5), GilbertElliott(p=0.025, r=0.25)),
        (
            GilbertElliott(p=0.02, r=0.2, bad_loss=0.8),
            GilbertElliott(p=0.02, r=0.2, bad_loss=0.64, good_loss=0.016),
        ),
        (
            FourState(p13=0.02, p31=0.2, p32=0.3, p23=0.6, p14=0.01),
            FourState(p13=0.02, p31=0.2, p32=0.1, p23=0.2, p14=0.01),
        ),
    ],
    ids=["Gilbert", "Gilbert-Elliott", "4-state"],
)
def test_a_wrong_burst_length_is_caught(
    asked: GilbertElliott | FourState, wrong: GilbertElliott | FourState
) -> None:
    report = check_link(one_way(loss=asked), given_else(loss=wrong))
    assert ("up", "mean loss burst") in outside(report)


def test_a_bit_error_rate_by_frame_and_not_by_bit_is_caught() -> None:
    asked = one_way(bit_error_rate=1e-5)
    by_frame = 1 - (1 - 1e-5) ** (64 * 8)
    report = check_link(asked, given_else(bit_error_rate=0.0, loss=by_frame))
    assert outside(report) == {("up", "bit errors")}


def test_a_trace_that_runs_late_is_caught() -> None:
    asked = one_way(rate_trace=Trace(times_ms=(1, 3, 10)), queue_byte=16384)
    wrong = given_else(rate_trace=Trace(times_ms=(2, 4, 10)))
    report = check_link(asked, wrong, frames=2000)
    assert ("up", "opportunities missed") in outside(report)


def test_an_outage_that_is_off_by_a_second_is_caught() -> None:
    def late(config: LinkConfig, rngs: Rngs) -> Channel:
        moved = tuple(
            Blackout(start_s=one.start_s + 1, end_s=one.end_s + 1) for one in config.blackouts
        )
        return Channel(msgspec.structs.replace(config, blackouts=moved), rngs)

    asked = LinkConfig(
        up=OneWay(delay_s=2.0),
        down=OneWay(delay_s=2.0),
        blackouts=(Blackout(start_s=60, end_s=90), Blackout(start_s=200, end_s=260)),
    )
    found = outside(check_link(asked, late, frames=2000))
    assert {("up", "delivered in an outage"), ("down", "delivered in an outage")} <= found
    assert {("up", "loss beside outages"), ("down", "loss beside outages")} <= found


@dataclasses.dataclass
class Tampering:
    """A right channel with its outgoing frames tampered with."""

    channel: Channel
    tamper: Callable[[list[Frame]], list[Frame]]

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        step = self.channel.advance(until_ns, arrivals)
        return Step(self.tamper(step.frames), step.records)


def tampering(tamper: Tamper) -> "Callable[[LinkConfig, Rngs], Tampering]":
    return lambda config, rngs: Tampering(Channel(config, rngs), tamper)


def changed(frame: Frame, **keys: Any) -> Frame:
    return msgspec.structs.replace(frame, **keys)


def bits_flipped(count: int) -> Tamper:
    def flip(payload: bytes) -> bytes:
        return bytes([payload[0] ^ (1 << count) - 1, *payload[1:]])

    def tamper(frames: list[Frame]) -> list[Frame]:
        return [
            changed(frame, payload=flip(frame.payload)) if frame.sequence % 100 == 7 else frame
            for frame in frames
        ]

    return tamper


def test_bits_flipped_twice_are_caught() -> None:
    asked = one_way(corrupt=0.01)
    plain = LinkConfig(up=OneWay(), down=OneWay(delay_s=0.1))

    def right(config: LinkConfig, rngs: Rngs) -> Tampering:
        return Tampering(Channel(plain, rngs), bits_flipped(1))

    def wrong(config: LinkConfig, rngs: Rngs) -> Tampering:
        return Tampering(Channel(plain, rngs), bits_flipped(2))

    assert ("up", "bits wrong if corrupt") not in outside(check_link(asked, right, frames=4000))
    assert ("up", "bits wrong if corrupt") in outside(check_link(asked, wrong, frames=4000))


def test_frames_that_are_swapped_are_caught() -> None:
    def swap(frames: Sequence[Frame]) -> list[Frame]:
        moved = {frame.sequence: frame.time_ns for frame in frames}
        return [
            changed(frame, time_ns=moved.get(frame.sequence ^ 1, frame.time_ns)) for frame in frames
        ]

    found = outside(check_link(one_way(delay_s=0.1), tampering(swap), frames=4000))
    assert ("up", "pairs overtaken") in found


def test_frames_delivered_in_an_outage_are_caught() -> None:
    def deaf(config: LinkConfig, rngs: Rngs) -> Channel:
        return Channel(msgspec.structs.replace(config, blackouts=()), rngs)

    found = outside(check_link(BAD, deaf, frames=2000))
    assert found == {("up", "delivered in an outage"), ("down", "delivered in an outage")}


def test_records_that_do_not_agree_with_what_arrives_are_caught() -> None:
    def earlier(frames: Sequence[Frame]) -> list[Frame]:
        return [changed(frame, time_ns=frame.time_ns - 1) for frame in frames]

    def fewer(frames: Sequence[Frame]) -> list[Frame]:
        return [frame for frame in frames if frame.sequence % 1000]

    everywhere = {("up", "records that disagree"), ("down", "records that disagree")}
    link = one_way(delay_s=0.1)
    assert outside(check_link(link, tampering(earlier), frames=4000)) == everywhere
    assert everywhere < outside(check_link(link, tampering(fewer), frames=4000))
