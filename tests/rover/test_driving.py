"""The rover's body: it gets where it is sent, and walls and rocks stop it."""

import math
from collections.abc import Callable, Sequence
from statistics import fmean
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.places import Chart
from farside.rover.config import BodyConfig, DriveConfig, RoverConfig
from farside.rover.world.body import TruePose, World
from farside.topics import ROVER_ACTION_ENDED, TRUTH_BUMP, TRUTH_POSE
from tests.rover.conftest import Bench

STEP_S = 0.04


def world(x_m: float = 1.5, y_m: float = 1.5, heading_rad: float = 0.0, **body: Any) -> World:
    chart = Chart(("#####", "#..o#", "#...#", "#####"), 1.0)
    return World(
        chart,
        BodyConfig(slip_mean=0.0, slip_sd=0.0, **body),
        TruePose(x_m, y_m, heading_rad),
        STEP_S,
        np.random.default_rng(0),
    )


def test_a_move_ends_in_the_middle_of_the_next_place(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do("E")
    pose = rover.of(TRUTH_POSE)[-1]
    assert pose.place == "at:2,1"
    assert math.dist((pose.x_m, pose.y_m), (2.5, 1.5)) < 0.2
    assert rover.telemetry.tokens == ("at:2,1",)


def test_a_push_against_a_wall_leaves_the_rover_where_it_was(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do("S")
    (ended,) = rover.of(ROVER_ACTION_ENDED)
    assert ended.blocked
    assert ended.duration_s > 1
    assert rover.of(TRUTH_BUMP)
    assert rover.of(TRUTH_POSE)[-1].place == "at:D"
    assert rover.telemetry.tokens == ("at:D", "on_charge")


def test_a_rock_stops_the_rover_too(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do("EE")
    assert [ended.blocked for ended in rover.of(ROVER_ACTION_ENDED)] == [False, True]
    assert rover.of(TRUTH_POSE)[-1].place == "at:2,1"


def test_many_pushes_do_not_move_it_away(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do("SWSWSWSW")
    pose = rover.of(TRUTH_POSE)[-1]
    assert math.dist((pose.x_m, pose.y_m), (1.5, 1.5)) < 0.2


def test_a_move_takes_about_as_long_as_in_the_seed(bench: Callable[..., Bench]) -> None:
    """The seed's average move takes 2.66 s; turns make single ones longer."""
    rover = bench()
    rover.do("NNEEEEESSNNWWWWWSS")
    durations_s = [ended.duration_s for ended in rover.of(ROVER_ACTION_ENDED)]
    assert fmean(durations_s) == pytest.approx(2.66, rel=0.15)


def test_tokens_come_from_the_estimate_not_from_the_truth(bench: Callable[..., Bench]) -> None:
    """With fixes worse than a place is wide, the rover comes to believe what is not so."""
    rover = bench(sensors={"position_sd_m": 3.0}, body={"slip_mean": 0.5})
    rover.do("NNEEEEE")
    believed = next(token for token in rover.telemetry.tokens if token.startswith("at:"))
    assert believed != rover.of(TRUTH_POSE)[-1].place


def test_friction_bounds_acceleration() -> None:
    slippery = world(friction=0.1, gravity_m_s2=1.62)
    slippery.step(1.0, 0.0)
    assert slippery.speed_m_s == pytest.approx(0.1 * 1.62 * STEP_S)


def test_a_weak_motor_moves_a_heavy_rover_slowly() -> None:
    heavy = world(mass_kg=1000.0, motor_force_n=100.0)
    heavy.step(1.0, 0.0)
    assert heavy.speed_m_s == pytest.approx(100.0 / 1000.0 * STEP_S)


def test_brakes_bring_it_to_rest_and_it_stays() -> None:
    rover = world()
    for _ in range(20):
        rover.step(0.5, 0.3)
    assert not rover.at_rest
    for _ in range(100):
        rover.step(0.0, 0.0)
    assert rover.at_rest
    resting = rover.pose
    rover.step(0.0, 0.0)
    assert rover.pose == resting


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), max_size=60))
def test_no_command_drives_it_through_a_wall(commands: Sequence[tuple[float, float]]) -> None:
    rover = world()
    for wheel_m_s, yaw_rad_s in commands:
        for _ in range(5):
            rover.step(wheel_m_s, yaw_rad_s)
    assert 1.0 < rover.pose.x_m < 4.0
    assert 1.0 < rover.pose.y_m < 3.0


def test_no_move_that_is_done_is_over_sooner_than_the_ground_may_count_on(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Should a fix have the rover believe that it is there already, it stands until then."""
    assert RoverConfig(start="D").drive.least_move_s(1.0) == pytest.approx(1.0)
    monkeypatch.setattr(DriveConfig, "least_move_s", lambda *_: 9.0)
    rover = bench()
    rover.do("NSS")
    ended = rover.of(ROVER_ACTION_ENDED)
    assert [one.duration_s for one in ended if not one.blocked] == [9.0, 9.0]
    assert ended[-1].blocked
    assert ended[-1].duration_s < 9, "a bump is a bump"
