"""Commands that wait on board: for a time, or for what they are to follow on."""

from collections.abc import Callable

import pytest

from farside.control import CommandStage, Mode, OnLoss
from farside.messages import (
    CommandReached,
    Drive,
    GoalReached,
    Meant,
    SetGoal,
    SetMode,
    SetOnLoss,
    TakeBack,
    When,
)
from farside.node import to_ns
from farside.topics import ROVER_ACTION_STARTED, ROVER_COMMAND
from tests.rover.conftest import TICK_NS, Bench


def life(rover: Bench, number: int) -> list[str]:
    return [e.stage.value for e in rover.of(ROVER_COMMAND) if e.number == number]


def so_ns(rover: Bench, number: int, stage: CommandStage) -> int:
    """When the rover says that a command came to a stage."""
    return next(e.time_ns for e in rover.events if e.what == CommandReached(number, stage))


@pytest.mark.parametrize("at_ns", [to_ns(5), to_ns(5) + 1, to_ns(5) - 1])
def test_a_rover_that_stands_begins_on_the_tick_and_not_before(
    bench: Callable[..., Bench], at_ns: int
) -> None:
    rover = bench()
    number = rover.order(Drive("N"), when=When(at_ns=at_ns))
    rover.run_s(3)
    assert rover.telemetry.waiting == (number,)
    assert rover.telemetry.commands_done == 0
    rover.run_s(10)
    tick_ns = -(-at_ns // TICK_NS) * TICK_NS
    assert so_ns(rover, number, CommandStage.BEGUN) == tick_ns
    assert life(rover, number) == ["taken", "waiting", "begun", "done"]


def test_a_setting_takes_effect_on_the_tick(bench: Callable[..., Bench]) -> None:
    rover = bench()
    number = rover.order(SetMode(Mode.SHARED), when=When(at_ns=to_ns(4.02)))
    rover.run_s(3)
    assert rover.telemetry.mode is Mode.GUIDED
    rover.run_s(3)
    assert so_ns(rover, number, CommandStage.DONE) == to_ns(4.04)
    assert life(rover, number) == ["taken", "waiting", "done"]
    assert rover.telemetry.commands_done == number


def test_an_action_waits_behind_those_before_it_and_a_setting_does_not(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    first = rover.order(Drive("N"), when=When(at_ns=to_ns(6)))
    second = rover.order(Drive("N"))
    setting = rover.order(SetOnLoss(OnLoss.HOLD))
    rover.run_s(4)
    assert rover.telemetry.waiting == (first, second)
    assert rover.telemetry.on_loss is OnLoss.HOLD
    rover.until(lambda: rover.telemetry.commands_done == setting)
    begun = [one.command for one in rover.of(ROVER_ACTION_STARTED)]
    assert begun == [first, second]


def test_a_sequence_is_carried_out_step_by_step(bench: Callable[..., Bench]) -> None:
    """Drives, a goal and a mode, each once the one before it is done."""
    rover = bench()
    rover.do("NS")
    rover.order(Drive("N"))
    goal = rover.order(SetGoal(("at:D",), 1.0), when=When(after=3))
    mode = rover.order(SetMode(Mode.AUTONOMOUS), meant=Meant(Mode.GUIDED), when=When(after=goal))
    rover.until(lambda: rover.told(GoalReached))
    assert rover.told(GoalReached) == [GoalReached(("at:D",))]
    done_ns = so_ns(rover, 3, CommandStage.DONE)
    assert so_ns(rover, goal, CommandStage.DONE) == done_ns
    assert so_ns(rover, mode, CommandStage.DONE) == done_ns


def test_a_mode_in_a_sequence_leaves_what_comes_after_it(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(Drive("N"))
    rover.order(SetMode(Mode.SHARED), when=When(after=1))
    third = rover.order(Drive("N"), meant=Meant(Mode.SHARED, after=1), when=When(after=2))
    rover.run_s(20)
    assert life(rover, third)[-1] == "done"


def test_where_the_one_before_fails_the_rest_of_the_sequence_is_refused(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.order(Drive("S"))
    rover.order(SetGoal(("at:A",), 1.0), when=When(after=1))
    rover.order(Drive("N"), when=When(after=2))
    free = rover.order(Drive("N"))
    rover.run_s(20)
    assert [end.why for end in rover.not_done[1:]] == [
        "it was to follow on command 1, which failed",
        "it was to follow on command 2, which was refused",
    ]
    assert rover.telemetry.goals == ()
    assert life(rover, free)[-1] == "done", "it did not follow on them"


@pytest.mark.parametrize("after", [0, 2, 7, -1])
def test_what_is_to_follow_on_nothing_before_it_is_refused(
    bench: Callable[..., Bench], after: int
) -> None:
    rover = bench()
    rover.order(SetOnLoss(OnLoss.HOLD))
    rover.order(Drive("N"), when=When(after=after))
    rover.run_s(2)
    why = f"it was to follow on command {after}, and there is none before it"
    assert rover.not_done == [CommandReached(2, CommandStage.REFUSED, why)]


def test_one_whose_end_is_forgotten_cannot_be_followed(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("farside.rover.commands._ENDS_KEPT", 2)
    rover = bench()
    for _ in range(3):
        rover.order(SetOnLoss(OnLoss.HOLD))
    rover.order(SetOnLoss(OnLoss.AUTONOMY), when=When(after=1))
    rover.order(SetOnLoss(OnLoss.AUTONOMY), when=When(after=3))
    rover.run_s(2)
    why = "it was to follow on command 1, of which nothing is known any more"
    assert rover.not_done == [CommandReached(4, CommandStage.REFUSED, why)]


def test_what_waits_for_its_time_can_be_taken_back(bench: Callable[..., Bench]) -> None:
    rover = bench()
    drive = rover.order(Drive("N"), when=When(at_ns=to_ns(6)))
    follows = rover.order(Drive("N"), when=When(after=drive))
    mode = rover.order(SetMode(Mode.SHARED), when=When(at_ns=to_ns(6)))
    itself = rover.order(TakeBack(4), when=When(at_ns=to_ns(1)))
    rover.order(TakeBack(drive))
    rover.order(TakeBack(mode))
    rover.run_s(10)
    assert life(rover, drive) == life(rover, mode) == ["taken", "waiting", "withdrawn"]
    assert life(rover, follows)[-1] == "refused"
    assert rover.end_of(itself).why == "it is this order itself"
    assert rover.telemetry.mode is Mode.GUIDED


def test_it_is_judged_when_it_would_begin_and_not_when_it_came(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    guided, shared = Meant(Mode.GUIDED), Meant(Mode.SHARED)
    at_5 = When(at_ns=to_ns(5))
    late = rover.order(Drive("N"), expires_s=4, when=at_5)
    wrong = rover.order(Drive("N"), meant=guided, when=at_5)
    right = rover.order(Drive("N"), meant=shared, when=at_5)
    rover.order(SetMode(Mode.SHARED), when=When(at_ns=to_ns(3)))
    rover.run_s(2)
    assert life(rover, wrong) == life(rover, right), "a mode supersedes what was given before it"
    rover.run_s(10)
    assert [life(rover, one)[-1] for one in (late, wrong, right)] == ["superseded"] * 3
    late = rover.order(Drive("N"), expires_s=15, when=When(at_ns=to_ns(16)))
    wrong = rover.order(Drive("N"), meant=guided, when=When(at_ns=to_ns(16)))
    right = rover.order(Drive("N"), meant=shared, when=When(at_ns=to_ns(16)))
    rover.run_s(10)
    assert [life(rover, one)[-1] for one in (late, wrong, right)] == ["expired", "refused", "done"]


def test_a_lost_link_supersedes_what_waits_for_its_time(bench: Callable[..., Bench]) -> None:
    rover = bench()
    drive = rover.order(Drive("N"), when=When(at_ns=to_ns(100)))
    mode = rover.order(SetMode(Mode.AUTONOMOUS), when=When(at_ns=to_ns(100)))
    rover.run_s(2)
    rover.link_up = False
    rover.run_s(120)
    assert life(rover, drive)[-1] == life(rover, mode)[-1] == "superseded"


def test_a_flat_battery_refuses_actions_and_leaves_settings(bench: Callable[..., Bench]) -> None:
    rover = bench(start="A", battery={"capacity_j": 60.0, "idle_w": 10.0})
    drive = rover.order(Drive("N"), when=When(at_ns=to_ns(20)))
    goal = rover.order(SetGoal(("at:B",), 1.0), when=When(at_ns=to_ns(20)))
    rover.run_s(30)
    assert rover.end_of(drive).why == "the battery is flat"
    assert life(rover, goal)[-1] == "done"
