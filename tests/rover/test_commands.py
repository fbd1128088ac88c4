"""A command's life on board: every stage told, and none begun that was meant for something else."""

from collections.abc import Callable

import pytest

from farside.control import CommandStage, Failsafe, Mode, ModeCause, OnLoss
from farside.messages import (
    CommandForced,
    CommandReached,
    CommandsMissing,
    Drive,
    Meant,
    ModeChanged,
    Order,
    SetMode,
    SetOnLoss,
    TakeBack,
)
from farside.topics import ROVER_ACTION_STARTED, ROVER_COMMAND, ROVER_MODE
from tests.rover.conftest import Bench


def life(rover: Bench, number: int) -> list[str]:
    return [e.stage.value for e in rover.of(ROVER_COMMAND) if e.number == number]


def begun(rover: Bench) -> list[int | None]:
    return [one.command for one in rover.of(ROVER_ACTION_STARTED)]


def test_taken_waiting_begun_done(bench: Callable[..., Bench]) -> None:
    rover = bench()
    first, second = rover.order(Drive("N")), rover.order(Drive("N"))
    rover.run_s(1.5)
    assert rover.telemetry.begun == first
    assert rover.telemetry.waiting == (second,)
    assert rover.telemetry.commands_done == 0
    rover.until(lambda: rover.telemetry.commands_done == second)
    assert life(rover, first) == life(rover, second) == ["taken", "waiting", "begun", "done"]
    told = [(one.number, one.stage.value) for one in rover.told(CommandReached)]
    assert told == [(1, "begun"), (2, "taken"), (1, "done"), (2, "begun"), (2, "done")]


def test_a_later_order_that_is_done_at_once_does_not_make_the_earlier_one_done(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.order(Drive("N"))
    rover.order(SetOnLoss(OnLoss.HOLD))
    rover.run_s(1.5)
    assert life(rover, 2) == ["taken", "done"]
    assert rover.telemetry.commands_done == 0
    assert rover.telemetry.on_loss is OnLoss.HOLD


def test_a_blocked_move_is_a_failed_command_and_told(bench: Callable[..., Bench]) -> None:
    rover = bench()
    number = rover.order(Drive("S"))
    rover.until(lambda: rover.not_done)
    failed = CommandReached(number, CommandStage.FAILED, "its move was blocked, or given up")
    assert rover.not_done == [failed]
    assert rover.telemetry.commands_done == number


def test_what_has_not_begun_can_be_taken_back_and_what_has_cannot(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    first, second = rover.order(Drive("N")), rover.order(Drive("N"))
    rover.run_s(1)
    back, late = rover.order(TakeBack(second)), rover.order(TakeBack(first))
    nonsense = rover.order(TakeBack(99))
    rover.run_s(10)
    assert life(rover, second) == ["taken", "waiting", "withdrawn"]
    assert life(rover, back) == ["taken", "done"]
    assert rover.end_of(late).why == f"command {first} has begun"
    assert rover.end_of(nonsense).why == "there is no command 99"
    assert begun(rover) == [first]


def test_a_change_of_mode_supersedes_what_waits(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(Drive("N"))
    waiting = rover.order(Drive("N"))
    rover.run_s(1)
    mode = rover.order(SetMode(Mode.SHARED))
    rover.run_s(10)
    assert rover.end_of(waiting).stage is CommandStage.SUPERSEDED
    assert rover.end_of(waiting).why == f"command {mode} changed the mode"
    assert begun(rover) == [1]


def test_expiry_is_judged_when_an_order_would_begin(bench: Callable[..., Bench]) -> None:
    rover = bench()
    numbers = [rover.order(Drive(action), expires_s=5.0) for action in "NSNS"]
    rover.run_s(20)
    stages = [rover.end_of(number).stage for number in numbers]
    assert stages == [CommandStage.DONE] * 2 + [CommandStage.EXPIRED] * 2
    assert {end.why for end in rover.not_done} == {"it came too late to begin"}


@pytest.mark.parametrize(
    ("meant", "why"),
    [
        (Meant(Mode.GUIDED, place="at:A"), "it was meant for at:A, and the rover is at at:D"),
        (Meant(Mode.SHARED), "it was meant for mode shared, and the rover is in mode guided"),
        (Meant(Mode.GUIDED, after=7), "it was meant to follow on command 7, which was not done"),
    ],
)
def test_an_order_is_refused_where_it_was_not_meant(
    bench: Callable[..., Bench], meant: Meant, why: str
) -> None:
    rover = bench()
    number = rover.order(Drive("N"), meant=meant)
    rover.run_s(10)
    assert rover.not_done == [CommandReached(number, CommandStage.REFUSED, why)]
    assert begun(rover) == []


def test_after_a_blocked_move_those_meant_to_follow_on_it_are_refused(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.order(Drive("S"), meant=Meant(Mode.GUIDED, place="at:D"))
    rover.order(Drive("N"), meant=Meant(Mode.GUIDED, after=1))
    rover.order(Drive("N"), meant=Meant(Mode.GUIDED, after=2))
    rover.run_s(20)
    assert begun(rover) == [1]
    assert life(rover, 3) == ["taken", "waiting", "refused"]


def test_a_bump_just_met_is_refused_and_the_operator_may_insist(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.do("S")
    again, insisting = rover.order(Drive("S")), rover.order(Drive("S", force=True))
    rover.run_s(10)
    assert rover.end_of(again).why == "S was blocked here just now"
    assert rover.told(CommandForced) == [CommandForced(insisting, "S was blocked here just now")]
    assert begun(rover) == [1, insisting]
    rover.do("N")
    assert rover.end_of(4).stage is CommandStage.DONE


def test_what_would_leave_too_little_for_the_way_to_the_dock_is_refused(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(battery={"capacity_j": 2_500.0, "idle_w": 1.0, "low": 0.05})
    rover.do("NNEEEEE")
    refused = rover.not_done[0]
    assert "would not suffice for the way to the dock" in refused.why
    assert "at:B" not in rover.telemetry.tokens
    assert rover.telemetry.failsafe is Failsafe.NOMINAL, "it is only told"
    rover.do("W")
    assert rover.end_of(8).stage is CommandStage.DONE, "home it may go"
    rover.do("E", force=True)
    assert rover.told(CommandForced)[0].number == 9


def test_a_drive_in_autonomous_mode_takes_over(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.run_s(2)
    rover.order(Drive("N"), meant=Meant(Mode.AUTONOMOUS, place="at:D"))
    rover.run_s(10)
    assert rover.told(ModeChanged)[-1] == ModeChanged(Mode.GUIDED, ModeCause.TAKEN_OVER)
    assert begun(rover) == [2]


def test_the_operator_may_forbid_autonomy_on_loss(bench: Callable[..., Bench]) -> None:
    rover = bench(goals=[{"place": "A", "priority": 1.0}])
    rover.do("NNSS")
    rover.order(SetOnLoss(OnLoss.HOLD))
    rover.run_s(2)
    assert rover.telemetry.alone_goals == (), "it will pursue none"
    rover.link_up = False
    rover.run_s(100)
    assert [entry.mode for entry in rover.of(ROVER_MODE)] == [Mode.GUIDED]
    assert len(begun(rover)) == 4


def test_a_rover_that_hears_heartbeats_but_gets_no_orders_says_so(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.given_but_not_arrived = 2
    rover.run_s(60)
    assert rover.told(CommandsMissing) == [CommandsMissing(missing=True, last=2)]
    rover.given_but_not_arrived = 0
    orders: list[Order] = [SetOnLoss(OnLoss.HOLD), SetOnLoss(OnLoss.AUTONOMY)]
    for order in orders:
        rover.order(order)
    rover.run_s(10)
    assert rover.told(CommandsMissing)[1:] == [CommandsMissing(missing=False, last=2)]
