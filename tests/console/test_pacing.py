"""How fast simulated time passes for a person."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.console.pacing import LONGEST_WINDOW_NS, SPEEDS, Pacing, Until
from farside.node import NS_PER_S, to_ns

TICK_NS = to_ns(0.04)

speeds = st.sampled_from(SPEEDS)
walls = st.lists(st.floats(0, 0.2), min_size=1, max_size=60)


def played(pacing: Pacing, walls_s: list[float], now_ns: int = 0) -> int:
    """How far a run gets that needs no time of its own for a window."""
    for wall_s in walls_s:
        pacing.pass_wall(wall_s, now_ns)
        while pacing.allows(now_ns) and pacing.until is None:
            now_ns += max(TICK_NS, pacing.window_ns(now_ns) // TICK_NS * TICK_NS)
    return now_ns


@given(speeds, walls)
def test_a_run_keeps_the_speed_to_a_window(speed: float, walls_s: list[float]) -> None:
    pacing = Pacing(speed)

    reached_ns = played(pacing, walls_s)

    asked_ns = speed * sum(walls_s) * NS_PER_S
    window_ns = max(TICK_NS, min(speed * 0.1 * NS_PER_S, LONGEST_WINDOW_NS))
    assert asked_ns - 1 <= reached_ns <= asked_ns + window_ns + TICK_NS


@given(speeds, walls)
def test_nothing_moves_while_time_stands(speed: float, walls_s: list[float]) -> None:
    pacing = Pacing(speed)
    pacing.pause()

    assert played(pacing, walls_s) == 0


@given(speeds, st.integers(0, 10**12), st.integers(1, 10**12))
def test_no_window_goes_past_a_moment_that_is_expected(
    speed: float, now_ns: int, ahead_ns: int
) -> None:
    pacing = Pacing(speed)
    pacing.expect(now_ns + ahead_ns)

    assert 0 < pacing.window_ns(now_ns) <= ahead_ns


def test_a_machine_that_slept_does_not_make_the_run_rush_after() -> None:
    pacing = Pacing(1.0)

    assert played(pacing, [3600.0]) <= NS_PER_S


def test_a_slow_run_is_not_hurried_for_what_it_lost() -> None:
    pacing = Pacing(60.0)
    for _ in range(100):
        pacing.pass_wall(0.1, 0)  # it gets nowhere
    now_ns = NS_PER_S

    assert played(pacing, [0.0], now_ns) <= now_ns + 60 * NS_PER_S


def test_a_decision_brings_time_back_to_1x_and_says_why() -> None:
    pacing = Pacing(60.0)

    pacing.slow("proposal 3 asks for your word")

    assert (pacing.speed, pacing.slowed) == (1.0, "proposal 3 asks for your word")


def test_who_goes_slower_than_1x_is_left_there() -> None:
    pacing = Pacing(0.2)

    pacing.slow("an alarm has come")

    assert (pacing.speed, pacing.slowed) == (0.2, "")


def test_a_warp_goes_as_fast_as_it_can_until_something_arrives() -> None:
    pacing = Pacing(1.0)
    pacing.warp(Until.ARRIVAL)
    pacing.pass_wall(0.0, 0)
    assert pacing.allows(10**15)

    pacing.arrive(Until.ARRIVAL, "event 7 has come")
    pacing.pass_wall(0.0, 10**15)

    assert pacing.until is None
    assert not pacing.allows(10**15)
    assert pacing.speed == 1.0


def test_nobody_reads_along_in_a_warp_and_above_60x_but_while_time_stands() -> None:
    pacing = Pacing(60.0)
    assert not pacing.is_hurried
    pacing.warp(Until.ARRIVAL)
    assert pacing.is_hurried
    pacing.arrive(Until.ARRIVAL, "event 7 has come")
    assert not pacing.is_hurried
    pacing.set_speed(120.0)
    assert pacing.is_hurried
    pacing.pause()
    assert not pacing.is_hurried


def test_a_warp_to_a_contact_does_not_end_with_a_word() -> None:
    pacing = Pacing(1.0)
    pacing.warp(Until.CONTACT)

    pacing.arrive(Until.ARRIVAL, "event 7 has come")

    assert pacing.until is Until.CONTACT


def test_the_keys_step_through_all_speeds_and_stop_at_both_ends() -> None:
    pacing = Pacing(1.0)
    for _ in SPEEDS:
        pacing.step(faster=False)
    found = [pacing.speed]
    for _ in SPEEDS:
        pacing.step(faster=True)
        found.append(pacing.speed)

    assert found == [*SPEEDS, SPEEDS[-1]]


@pytest.mark.parametrize("speed", [0.0, -1.0, 0.09, 1001.0, math.inf, math.nan])
def test_no_other_number_is_a_speed(speed: float) -> None:
    with pytest.raises(ValueError, match=r"expected a speed from 0\.1 to 1000"):
        Pacing().set_speed(speed)
