"""The command desk: what is given, what each order is meant for, and what is known of it."""

from farside.control import CommandStage, Mode
from farside.messages import (
    Command,
    CommandReached,
    Drive,
    Meant,
    SetGoal,
    SetMode,
)
from tests.ground.conftest import make_desk, telemetry


def test_commands_are_numbered_without_a_gap_and_expire() -> None:
    desk = make_desk(valid_ns=1000)
    first, second = Meant(Mode.GUIDED), Meant(Mode.GUIDED, after=1)
    assert desk.give(Drive("N"), 7) == [Command(1, 1007, Drive("N"), first)]
    assert desk.give(Drive("E"), 9) == [Command(2, 1009, Drive("E"), second)]
    assert desk.last_given == 2


def test_a_drive_is_meant_for_where_the_rover_is_known_to_be() -> None:
    desk = make_desk(valid_ns=1000)
    desk.learn(telemetry(1.0, "A"))
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.GUIDED, place="at:A")


def test_behind_another_drive_it_is_meant_to_follow_on_that() -> None:
    desk = make_desk(valid_ns=1000)
    desk.learn(telemetry(1.0, "A"))
    desk.give(Drive("E"), 0)
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.GUIDED, after=1)
    desk.learn_stage(CommandReached(2, CommandStage.REFUSED, "no"))
    desk.learn(telemetry(2.0, "2,1", commands_done=1))
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.GUIDED, place="at:2,1")


def test_orders_are_meant_for_the_mode_that_those_before_them_lead_to() -> None:
    desk = make_desk(valid_ns=1000)
    desk.learn(telemetry(1.0, "A", mode=Mode.AUTONOMOUS))
    assert desk.give(SetGoal(("at:B",), 1.0), 0)[0].meant == Meant(Mode.AUTONOMOUS)
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.AUTONOMOUS, place="at:A")
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.GUIDED, after=2), "taken over by 2"
    desk.give(SetMode(Mode.SHARED), 0)
    assert desk.give(Drive("E"), 0)[0].meant == Meant(Mode.SHARED, after=3)


def test_it_is_settled_when_all_is_known_to_be_over() -> None:
    desk = make_desk(valid_ns=1000)
    assert not desk.is_settled, "nothing has been heard yet"
    desk.learn(telemetry(1.0))
    assert desk.is_settled
    desk.give(Drive("E"), 0)
    assert not desk.is_settled
    desk.learn(telemetry(2.0, commands_done=1))
    assert desk.is_settled


def test_what_expired_is_given_longer_until_something_is_done() -> None:
    """Else an order given as one opening ends would expire before the next, every time."""
    desk = make_desk(valid_ns=100)

    def given() -> int:
        return desk.give(Drive("E"), 0)[0].expires_ns

    def expire() -> None:
        desk.learn_stage(CommandReached(desk.last_given, CommandStage.EXPIRED, "it came too late"))

    lives = []
    for _ in range(6):
        lives.append(given())
        expire()
    assert lives == [100, 400, 1600, 1600, 1600, 1600]
    assert given() == 1600
    desk.learn(telemetry(1.0, commands_done=desk.last_given))
    assert given() == 100
    desk.learn_stage(CommandReached(desk.last_given, CommandStage.REFUSED, "no"))
    assert given() == 100, "it came in time, and was not wanted"
