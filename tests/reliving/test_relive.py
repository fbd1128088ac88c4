"""A moment of a run, alive: what the live objects are asked is what the log says of that moment."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from short_life import Failing

import farside
from farside.dem import DynamicExpectancyModel
from farside.logs import LogFile, Recorder
from farside.missions import FinishedRun, Rehearsal
from farside.missions.reliving.past import RelivingError
from farside.node import Direction, to_ns
from farside.topics import GROUND_ORDER, ROVER_CYCLE


@settings(max_examples=2)
@given(st.lists(st.floats(0, 75), min_size=5, max_size=5))
def test_a_moment_is_as_the_log_tells_of_it(flown: FinishedRun, times_s: list[float]) -> None:
    relived = farside.relive(flown.log, 0.0)
    for t_s in sorted(times_s):
        relived.go_on(t_s)

        cycle = LogFile(flown.log).latest(ROVER_CYCLE, to_ns(t_s))
        assert cycle is not None
        assert relived.model.hypothesis_count == ROVER_CYCLE.decode(cycle.payload).hypotheses
        assert relived.rover.pilot.authority.mode is flown.mode_at(min(t_s, flown.duration_s))
        assert relived.rover.parts.watch.state is flown.failsafe_at(min(t_s, flown.duration_s))
        assert relived.now_s <= t_s < relived.now_s + 0.1 or t_s == 75


def test_model_channel_and_ground_can_be_asked(flown: FinishedRun) -> None:
    """Within the blackout: the rover is alone with its mission goal, and the ground is not told."""
    relived = farside.relive(flown.log, 62.0)

    model, shadow = relived.model, relived.shadow
    assert isinstance(model, DynamicExpectancyModel)
    assert model.policy_map()
    assert shadow is not None
    assert shadow.hypothesis_count <= model.hypothesis_count
    assert all(relived.channel.outage(direction) for direction in Direction)
    telemetry = relived.ground.situation.belief.telemetry
    assert telemetry is not None
    assert telemetry.time_ns < to_ns(42.0)
    assert relived.mission.duration_s == 75.0
    assert "62 s" in repr(relived)


def test_life_goes_on_to_the_same_moment_as_at_one_go(flown: FinishedRun) -> None:
    by_steps = farside.relive(flown.log, 20.0)
    by_steps.go_on(20.0)
    by_steps.go_on(38.75)

    at_one_go = farside.relive(str(flown.log), 38.75)
    assert _lists(by_steps) == _lists(at_one_go)
    with pytest.raises(RelivingError, match=r"at 38.7 s or later, found 20 s"):
        by_steps.go_on(20.0)


def _lists(relived: farside.Relived) -> tuple[object, ...]:
    assert isinstance(relived.model, DynamicExpectancyModel)
    return relived.model.signs, relived.model.hypotheses, relived.rover.world.pose


def test_the_orders_of_a_person_come_on_their_tick(ordered: FinishedRun) -> None:
    (first_s, _), (second_s, _), *_ = ordered.entries(GROUND_ORDER)
    assert first_s == second_s == 3.0

    relived = farside.relive(ordered.log, first_s - 0.1)
    assert relived.ground.situation.commands.last_given == 0
    relived.go_on(first_s)
    assert relived.ground.situation.commands.last_given == 2


@pytest.mark.parametrize("t_s", [-1.0, 75.5, float("nan")])
def test_no_moment_of_the_run(flown: FinishedRun, t_s: float) -> None:
    with pytest.raises(RelivingError, match=r"expected a moment of the run, 0 to 75 s, found "):
        farside.relive(flown.log, t_s)


def test_a_log_without_a_mission(tmp_path: Path) -> None:
    with Recorder(tmp_path / "bare.mcap"):
        pass
    with pytest.raises(RelivingError, match=r"found no attachment mission.json"):
        farside.relive(tmp_path / "bare.mcap", 0.0)


def test_a_mission_that_this_farside_cannot_read(tmp_path: Path) -> None:
    with Recorder(tmp_path / "old.mcap") as recorder:
        recorder.attach("mission.json", "application/json", b'{"name": "old"}')
        recorder.metadata("farside.run", {"farside": "0.0.1"})
    with pytest.raises(RelivingError, match=r"in mission.json, found: .*; .* by version 0\.0\.1"):
        farside.relive(tmp_path / "old.mcap", 0.0)


def test_up_to_the_loss_of_a_process_and_no_further(tmp_path: Path) -> None:
    values: dict[str, Any] = {"duration_s": 40.0, "expect": [], "ground.script": []}
    run = Rehearsal("blackout", tmp_path, values).operator(Failing).run()

    alive = farside.relive(run.log, 15.0, operator=Failing)
    assert alive.ground.situation.commands.last_given == 1
    with pytest.raises(RelivingError, match=r"0 to 19\.\d+ s, found 30 s: its ground failed at"):
        farside.relive(run.log, 30.0, operator=Failing)


def test_code_of_ones_own_that_cannot_be_imported(tmp_path: Path) -> None:
    class Local(Failing):
        pass

    values: dict[str, Any] = {"duration_s": 10.0, "expect": [], "ground.script": []}
    run = Rehearsal("blackout", tmp_path, values).operator(Local).run()

    assert farside.relive(run.log, 5.0, operator=Local).now_s == 5.0
    with pytest.raises(RelivingError, match=r"the run cannot be lived again: .*module"):
        farside.relive(run.log, 5.0)
