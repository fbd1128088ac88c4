"""Random impairments: each has its distribution, and none affects another."""

import math
import sys
from collections.abc import Sequence
from itertools import accumulate, groupby
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats  # type: ignore[import-untyped]

from farside.frames import Fate
from farside.link import OneWay
from farside.link.channel.chance import UNIMPAIRED, RandomImpairments
from farside.link.profile.config import BitErrorEffect
from farside.link.profile.impairments import (
    CorrelatedLoss,
    FourState,
    GilbertElliott,
    Jitter,
    JitterShape,
    Reorder,
)
from farside.link.profile.statistics import loss_statistics
from farside.node import Direction, Frame

COUNT = 20_000
GE = GilbertElliott(p=0.05, r=0.25, bad_loss=0.8, good_loss=0.01)
EVERYTHING: dict[str, Any] = {
    "loss": GE,
    "bit_error_rate": 1e-3,
    "bit_errors": BitErrorEffect.FLIP,
    "corrupt": 0.1,
    "jitter": Jitter(spread_s=0.01, correlation=0.6),
    "reorder": Reorder(share=0.2, hold_s=1.0),
    "duplicate": 0.3,
}


def frames(count: int = COUNT, size_byte: int = 20) -> list[Frame]:
    return [Frame(Direction.UP, n, n, bytes(size_byte)) for n in range(count)]


def chance(seed: int = 7, **impairments: Any) -> RandomImpairments:
    return RandomImpairments(np.random.default_rng(seed), OneWay(**impairments))


class Drawn(NamedTuple):
    """A frame's jitter and `farside.link.channel.chance.Impairment`."""

    loss: Fate | None
    flips: tuple[int, ...]
    jitter_ns: int
    hold_ns: int
    copy_ns: int | None


def bits_of(number: int) -> tuple[int, ...]:
    return tuple(bit for bit in range(number.bit_length()) if number >> bit & 1)


def drawn(node: RandomImpairments, frames: Sequence[Frame]) -> list[Drawn]:
    """What each frame draws from `node`."""
    jitters_ns, others = node.draw(frames)
    assert len(jitters_ns) == len(frames)
    found = [others.get(index, UNIMPAIRED) for index in range(len(frames))]
    return [
        Drawn(one.loss, bits_of(one.flips), jitter_ns, one.hold_ns, one.copy_ns)
        for one, jitter_ns in zip(found, jitters_ns, strict=True)
    ]


def draw(count: int = COUNT, size_byte: int = 20, **impairments: Any) -> list[Drawn]:
    return drawn(chance(**impairments), frames(count, size_byte))


def losses(**impairments: Any) -> list[bool]:
    return [one.loss is not None for one in draw(**impairments)]


def near(
    share: float | np.floating, expected: float, count: int = COUNT, spread: float = 1.0
) -> bool:
    """Within five standard deviations of a share of independent trials, `spread` times as wide."""
    return abs(float(share) - expected) < 5 * spread * math.sqrt(expected * (1 - expected) / count)


def mean_burst(lost: Sequence[bool]) -> float:
    runs = [len(list(run)) for was_lost, run in groupby(lost) if was_lost]
    return sum(runs) / len(runs)


def test_random_losses_are_as_frequent_as_asked_for() -> None:
    assert near(np.mean(losses(loss=0.2)), 0.2)


def test_gilbert_elliott_loses_by_the_share_of_its_states() -> None:
    bad = GE.p / (GE.p + GE.r)
    expected = bad * GE.bad_loss + (1 - bad) * GE.good_loss
    # Correlation widens the spread by √((1 + ρ)/(1 − ρ)) at most, with ρ = 1 − p − r.
    assert near(np.mean(losses(loss=GE)), expected, spread=math.sqrt(1.7 / 0.3))


def test_gilbert_bursts_are_as_long_as_the_bad_state() -> None:
    lost = losses(loss=GilbertElliott(p=0.05, r=0.25))
    bursts = sum(lost) * 0.25
    assert abs(mean_burst(lost) - 4.0) < 5 * math.sqrt(0.75) / 0.25 / math.sqrt(bursts)


def test_four_states_stay_as_long_as_their_chain_says() -> None:
    # p31 alone ends a loss, so that bursts are geometric with its mean.
    lost = losses(loss=FourState(p13=0.02, p31=0.2))
    assert mean_burst(lost) == pytest.approx(5.0, rel=0.2)
    assert np.mean(lost) == pytest.approx(0.02 / 0.22, rel=0.2)


def test_four_states_with_p13_alone_lose_each_frame_independently() -> None:
    lost = np.array(losses(loss=FourState(p13=0.1)))
    assert near(lost.mean(), 0.1)
    after_loss = lost[1:][lost[:-1]]
    assert near(after_loss.mean(), 0.1, count=len(after_loss))


def test_a_loss_alone_in_a_gap_is_never_followed_by_another() -> None:
    lost = losses(loss=FourState(p13=0.0, p14=0.3))
    assert sum(lost) > 1000
    assert mean_burst(lost) == 1.0


CORRELATED = [(0.1, 0.4), (0.3, -0.3), (0.9, -0.1), (0.02, 0.9)]


def lag_correlation(hits: Sequence[bool]) -> float:
    return float(np.corrcoef(hits[1:], hits[:-1])[0, 1])


@pytest.mark.parametrize(("probability", "correlation"), CORRELATED)
def test_losses_have_the_probability_and_the_correlation_asked_for(
    probability: float, correlation: float
) -> None:
    # In tc-netem a correlation of 0.4 makes hardly any loss of 10 %.
    model = CorrelatedLoss(probability=probability, correlation=correlation)
    lost = losses(loss=model)
    spread = math.sqrt(max(1.0, (1 + correlation) / (1 - correlation)))
    assert near(np.mean(lost), probability, spread=spread)
    assert lag_correlation(lost) == pytest.approx(correlation, abs=0.05)
    asked = loss_statistics(model)
    assert asked.rate == pytest.approx(probability)
    assert asked.burst_length == pytest.approx(1 / (1 - probability) / (1 - correlation))


@pytest.mark.parametrize(("share", "correlation"), CORRELATED)
def test_frames_are_held_back_with_the_share_and_the_correlation_asked_for(
    share: float, correlation: float
) -> None:
    reorder = Reorder(share=share, hold_s=1.0, correlation=correlation)
    held = [one.hold_ns > 0 for one in draw(reorder=reorder)]
    spread = math.sqrt(max(1.0, (1 + correlation) / (1 - correlation)))
    assert near(np.mean(held), share, spread=spread)
    assert lag_correlation(held) == pytest.approx(correlation, abs=0.05)


@pytest.mark.parametrize("correlation", [0.4, -0.3])
@settings(max_examples=20)
@given(st.lists(st.integers(0, 20), max_size=10))
def test_correlation_goes_on_from_block_to_block(correlation: float, sizes: Sequence[int]) -> None:
    impairments: dict[str, Any] = {
        "reorder": Reorder(share=0.3, hold_s=1.0, correlation=correlation),
        "loss": CorrelatedLoss(probability=0.3, correlation=correlation),
        "jitter": Jitter(spread_s=0.01, shape=JitterShape.PARETO, correlation=correlation),
    }
    total, blocks, node = sum(sizes), [], chance(**impairments)
    for begin, size in zip(accumulate(sizes, initial=0), sizes, strict=False):
        blocks += drawn(node, frames(total)[begin : begin + size])
    assert blocks == draw(total, **impairments)


@pytest.mark.parametrize(
    ("probability", "least"), [(0.1, "-0.111111"), (0.9, "-0.111111"), (0.0, "0")]
)
def test_more_anticorrelation_than_there_can_be_is_refused(probability: float, least: str) -> None:
    words = f"expected a correlation of {least} or more with a probability of {probability:g}"
    with pytest.raises(ValueError, match=words):
        CorrelatedLoss(probability=probability, correlation=-0.2)
    with pytest.raises(ValueError, match=words):
        Reorder(share=probability, hold_s=1.0, correlation=-0.2)


@pytest.mark.parametrize("correlation", [0.0, 0.7, -0.5])
@pytest.mark.parametrize("shape", [JitterShape.UNIFORM, JitterShape.EXPONENTIAL])
def test_jitter_has_its_distribution_for_any_correlation(
    shape: JitterShape, correlation: float
) -> None:
    jitter = Jitter(spread_s=0.01, shape=shape, correlation=correlation)
    # Far enough apart to be independent.
    delays = np.array([one.jitter_ns for one in draw(jitter=jitter)])[::20] / 1e7
    law = stats.uniform() if shape is JitterShape.UNIFORM else stats.expon()
    assert stats.kstest(delays, law.cdf).pvalue > 1e-4
    assert delays.min() >= 0


@pytest.mark.parametrize("correlation", [0.0, 0.7, -0.5])
def test_jitter_is_correlated_as_asked_for(correlation: float) -> None:
    jitter = Jitter(spread_s=0.01, correlation=correlation)
    delays = np.array([one.jitter_ns for one in draw(jitter=jitter)]) / 1e7
    scores = stats.norm.ppf(np.clip(delays, 1e-9, 1 - 1e-9))
    assert np.corrcoef(scores[1:], scores[:-1])[0, 1] == pytest.approx(correlation, abs=0.03)


@pytest.mark.parametrize("rate", [1e-4, 0.01, 0.5])
def test_wrong_bits_are_binomial_in_number_and_uniform_in_position(rate: float) -> None:
    drawn = draw(4000, bit_error_rate=rate, bit_errors=BitErrorEffect.FLIP)
    bits = 20 * 8
    counts = np.array([len(one.flips) for one in drawn])
    assert abs(counts.mean() - bits * rate) < 5 * math.sqrt(bits * rate * (1 - rate) / 4000)
    assert near(np.mean(counts == 0), (1 - rate) ** bits, count=4000)
    places = [bit for one in drawn for bit in one.flips]
    assert abs(np.mean(places) - (bits - 1) / 2) < 5 * bits / math.sqrt(12 * len(places))
    assert all(len(set(one.flips)) == len(one.flips) for one in drawn)
    assert all(one.loss is None for one in drawn)


def test_a_wrong_bit_in_the_overhead_loses_the_frame() -> None:
    drawn = draw(
        4000, bit_error_rate=0.001, bit_errors=BitErrorEffect.FLIP, overhead_byte=20, size_byte=20
    )
    lost = np.mean([one.loss is Fate.BIT_ERROR for one in drawn])
    assert near(lost, 1 - 0.999**160, count=4000)
    assert all(not one.flips for one in drawn if one.loss)


def test_bit_errors_lose_long_frames_more_often() -> None:
    for size_byte in (10, 200):
        lost = np.mean(
            [one.loss is Fate.BIT_ERROR for one in draw(4000, size_byte, bit_error_rate=5e-4)]
        )
        assert near(lost, 1 - (1 - 5e-4) ** (8 * size_byte), count=4000)


def test_when_every_bit_is_wrong_all_are_flipped() -> None:
    (one,) = draw(1, 3, bit_error_rate=1.0, bit_errors=BitErrorEffect.FLIP)
    assert one.flips == tuple(range(24))


@pytest.mark.parametrize("rate", [1e-4, 0.3])
def test_the_wrong_bits_of_a_long_message_are_as_many_and_take_no_more_room_than_it(
    rate: float,
) -> None:
    size_byte = 500_000
    node = RandomImpairments(
        np.random.default_rng(0), OneWay(bit_error_rate=rate, bit_errors=BitErrorEffect.FLIP)
    )
    [one] = node.draw([Frame(Direction.UP, 0, 0, bytes(size_byte))]).impairments.values()
    bits = 8 * size_byte
    assert abs(one.flips.bit_count() - bits * rate) < 5 * math.sqrt(bits * rate * (1 - rate))
    half = one.flips & (1 << bits // 2) - 1
    assert abs(half.bit_count() - bits * rate / 2) < 5 * math.sqrt(bits * rate * (1 - rate) / 2)
    assert sys.getsizeof(one.flips) < 1.1 * size_byte


def test_corruption_flips_one_bit_anywhere() -> None:
    drawn = draw(corrupt=0.1)
    flips = [one.flips for one in drawn if one.flips]
    assert near(len(flips) / COUNT, 0.1)
    assert {len(bits) for bits in flips} == {1}
    assert {bits[0] for bits in flips} == set(range(160))


def test_an_empty_frame_has_nothing_to_corrupt() -> None:
    assert all(not one.flips for one in draw(100, 0, corrupt=1.0))


def test_as_many_frames_are_held_back_and_duplicated_as_asked_for() -> None:
    drawn = draw(reorder=Reorder(share=0.2, hold_s=1.0), duplicate=0.3)
    assert near(np.mean([one.hold_ns > 0 for one in drawn]), 0.2)
    assert near(np.mean([one.copy_ns is not None for one in drawn]), 0.3)


@given(st.lists(st.integers(0, 40), max_size=10))
def test_how_frames_are_split_into_blocks_makes_no_difference(sizes: Sequence[int]) -> None:
    total = sum(sizes)
    blocks, node = [], chance(**EVERYTHING)
    for begin, size in zip(accumulate(sizes, initial=0), sizes, strict=False):
        blocks += drawn(node, frames(total)[begin : begin + size])
    assert blocks == draw(total, **EVERYTHING)


FIELDS = {
    "loss": ("loss",),
    "bit_error_rate": ("flips",),
    "corrupt": ("flips",),
    "jitter": ("jitter_ns", "copy_ns"),
    "reorder": ("hold_ns",),
    "duplicate": ("copy_ns",),
}


@pytest.mark.parametrize("absent", FIELDS)
def test_removing_one_impairment_leaves_the_others_unchanged(absent: str) -> None:
    fewer = {name: value for name, value in EVERYTHING.items() if name != absent}
    for one, other in zip(draw(2000, **EVERYTHING), draw(2000, **fewer), strict=True):
        for field in {"loss", "flips", "jitter_ns", "hold_ns", "copy_ns"} - {*FIELDS[absent]}:
            assert getattr(one, field) == getattr(other, field)


@given(st.integers(0, 300))
def test_an_impairment_that_begins_later_draws_as_if_it_had_always_been_on(later: int) -> None:
    always = {name: EVERYTHING[name] for name in ("corrupt", "reorder", "duplicate")} | {
        "loss": 0.3
    }
    node = chance()
    before = drawn(node, frames(300)[:later])
    node.configure(OneWay(**always))
    assert drawn(node, frames(300)[later:]) == draw(300, **always)[later:]
    assert all(one.loss is None and not one.flips for one in before)
