"""The operators that Farside brings beside the script: what each gives, and when."""

import math

import pytest
from operator_stand import Ground

from farside.acts import Planned
from farside.control import CommandStage, Failsafe, Mode
from farside.ground.config import (
    GroundConfig,
    GuideConfig,
    Leave,
    RecordedConfig,
    RecordedLine,
    WantedPlace,
)
from farside.ground.operators.queued import QueuedOperator, as_logged
from farside.ground.operators.recorded import RecordedOperator
from farside.messages import (
    Drive,
    SetGoal,
    SetMode,
    Veto,
)
from farside.node import to_ns
from farside.places import Chart
from farside.topics import OperatorEntry
from tests.ground.conftest import proposal

ROOM = Chart(("#####", "#A.B#", "#####"), 1.0)
SHARED, ALONE = SetMode(Mode.SHARED), SetMode(Mode.AUTONOMOUS)


# --- absent, queued, recorded ---------------------------------------------------------------------


def test_where_nobody_is_nothing_is_ordered() -> None:
    ground = Ground(GroundConfig(operator="absent"))
    ground.learn()
    ground.belief.consider(proposal(1))
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(0, 0, None)


def test_what_was_put_is_given_once_and_in_order() -> None:
    ground = Ground(GroundConfig(operator="queued"))
    assert isinstance(ground.operator, QueuedOperator)
    ground.operator.put([Drive("N"), Drive("E")])
    ground.operator.put([SHARED])
    assert ground.act() == [Drive("N"), Drive("E"), SHARED]
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(3, 3, None)


def line(t_s: float, json: str) -> RecordedLine:
    return RecordedLine(time_ns=to_ns(t_s), json=json)


def test_what_is_recorded_is_given_at_its_time_with_the_progress_of_then() -> None:
    drive, goal = (
        f'{{"act":{order}}}'
        for order in (
            '{"type":"drive","action":"N"}',
            '{"type":"planned","order":{"type":"veto","proposal":3},"follows":true}',
        )
    )
    recorded = RecordedConfig(
        orders=(line(1, drive), line(2, goal), line(2, drive)),
        progress=(line(1, '{"step":1,"of":2,"waiting_for":"x"}'),),
    )
    ground = Ground(GroundConfig(operator="recorded", recorded=recorded))
    assert ground.act(0.9) == []
    assert ground.operator.progress == OperatorEntry(0, 2, None)
    assert ground.act(1.0) == [Drive("N")]
    assert ground.operator.progress == OperatorEntry(1, 2, "x")
    assert ground.act(5.0) == [Planned(Veto(3), follows=True), Drive("N")]
    assert ground.act(6.0) == []


def test_the_first_recorded_progress_is_a_change_whatever_it_was() -> None:
    """The ground notes changes, and it noted this one."""
    first = RecordedConfig(orders=(), progress=(line(0, '{"step":0,"of":3,"waiting_for":null}'),))
    assert RecordedOperator(first).progress != OperatorEntry(0, 3, None)


def test_an_order_is_given_as_the_log_will_give_it_back() -> None:
    assert as_logged(SetGoal(("at:A",), math.nan)) == SetGoal(("at:A",), None)
    assert as_logged(Planned(Drive("N"), at_ns=5)) == Planned(Drive("N"), at_ns=5)


@pytest.mark.parametrize(
    ("orders", "why"),
    [
        ((line(2, '{"act":{"type":"veto","proposal":1}}'), line(1, "{}")), "not before"),
        ((line(0, '{"act":{"type":"fly"}}'),), "Invalid value 'fly'"),
        ((line(0, "[]"),), "got `array`"),
    ],
)
def test_lines_that_no_log_has_are_refused(orders: tuple[RecordedLine, ...], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        RecordedConfig(orders=orders)


# --- guide ----------------------------------------------------------------------------------------


def guide(ahead: int = 1, chart: Chart = ROOM) -> Ground:
    return Ground(GroundConfig(operator="guide", guide=GuideConfig(ahead=ahead)), chart)


def test_the_guide_moves_and_waits_until_every_move_was_made() -> None:
    ground = guide()
    assert ground.act() == []
    assert ground.waits_for == "the rover to be heard"
    for place, action in (("A", "E"), ("2,1", "E"), ("B", "W"), ("2,1", "W")):
        ground.learn(place)
        assert ground.act() == [Drive(action)]
        assert ground.act() == [], "it waits for word"
        ground.end(CommandStage.DONE)
    ground.learn("A")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)


def test_the_guide_sends_several_moves_each_to_follow_on_the_one_before() -> None:
    ground = guide(ahead=3)
    ground.learn("A")
    ahead = [Planned(Drive(action), follows=True) for action in "EW"]
    assert ground.act() == [Drive("E"), *ahead]
    assert ground.waits_for == "every move to be made, as 0 of 4 are"
    for number in (1, 2, 3):
        assert ground.act() == []
        ground.end(CommandStage.DONE, number)
    ground.learn("2,1")
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "every move to be made, as 3 of 4 are"


def test_word_of_how_a_move_ended_is_waited_for() -> None:
    """Telemetry that says that it is over may be there before."""
    ground = guide()
    ground.learn("A")
    ground.act()
    ground.learn("A")
    assert ground.act() == []
    ground.end(CommandStage.FAILED)
    assert ground.act() == [Drive("E", force=True)], "it was blocked here just now"


def test_what_was_blocked_three_times_is_given_up_and_said() -> None:
    ground = guide()
    ground.learn("A")
    for number in (1, 2, 3):
        assert ground.act() == [Drive("E", force=number > 1)]
        ground.end(CommandStage.FAILED)
        ground.learn("A")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(
        1, 1, None, left=("4 moves, as they were blocked: first E from A",)
    )


def test_after_a_refusal_it_starts_from_where_the_rover_is() -> None:
    ground = guide(ahead=2)
    ground.learn("A")
    ground.act()
    ground.end(CommandStage.EXPIRED, 1)
    ground.end(CommandStage.REFUSED, 2)
    ground.learn("B")
    assert ground.act() == [Drive("W"), Planned(Drive("E"), follows=True)]


def test_a_low_battery_comes_first_and_the_rover_is_charged_before_it_goes_on() -> None:
    ground = guide(chart=Chart(("######", "#D..A#", "######"), 1.0))
    ground.learn("A", tokens=("at:3,1", "battery:low"))
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "the rover to be at the dock"
    ground.end(CommandStage.DONE)
    ground.learn("D", tokens=("at:D", "battery:low", "on_charge"), battery=0.3)
    assert ground.act() == []
    assert ground.waits_for == "the rover to be charged"
    ground.learn("D", tokens=("at:D", "on_charge"), battery=0.95)
    assert ground.act() == [Drive("E")]


def test_behind_a_long_delay_it_turns_back_before_the_battery_is_low() -> None:
    """A move took a quarter of the charge: there and back takes more than is left."""
    ground = guide(chart=Chart(("######", "#D..A#", "######"), 1.0))
    ground.learn("D", battery=1.0)
    assert ground.act() == [Drive("E")]
    ground.end(CommandStage.DONE)
    ground.learn("2,1", battery=0.75)
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "the rover to be at the dock"


def test_into_silence_and_to_a_rover_that_is_not_safe_the_guide_sends_nothing() -> None:
    ground = guide()
    ground.learn("A")
    assert ground.act(silent=True) == []
    ground.learn("A", failsafe=Failsafe.SAFE)
    assert ground.act() == []
    assert ground.waits_for == "the rover to be safe to drive"
    ground.learn("A")
    assert ground.act() == [Drive("E")]


# --- leave ----------------------------------------------------------------------------------------


def test_the_rover_is_left_with_mode_and_goals_at_once_and_nothing_is_said_after() -> None:
    goals = (WantedPlace(place="B"), WantedPlace(place="A", priority=1.0))
    ground = Ground(GroundConfig(script=(Leave(goals=goals),)))
    sent = [ALONE, SetGoal(("at:B",), 2.0), SetGoal(("at:A",), 1.0)]
    assert ground.act() == sent
    ground.end(CommandStage.EXPIRED, 2)
    ground.learn(mode=Mode.AUTONOMOUS)
    assert ground.act() == sent[1:2], "only what was not done is said again"
    ground.learn(mode=Mode.AUTONOMOUS)
    assert ground.act() == []
    ground.belief.consider(proposal(1))
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)
