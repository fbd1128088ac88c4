"""What the rover wants: one Goal List for operator, mission and rover."""

import math
from collections.abc import Callable

import pytest

from farside.control import CommandStage, Mode
from farside.messages import (
    CommandReached,
    Drive,
    GoalAside,
    GoalReached,
    SetGoal,
    SetMode,
    WithdrawGoal,
)
from farside.topics import ROVER_ACTION_STARTED, ROVER_GOAL, ROVER_MODE, GoalChange, GoalSource
from tests.rover.conftest import Bench

ROUND = "NNEEEEESSNNWWWWWSS"  # from the dock to C and back: everything there is to know


def changes(rover: Bench) -> list[tuple[GoalChange, float, GoalSource]]:
    return [(entry.change, entry.priority, entry.source) for entry in rover.of(ROVER_GOAL)]


def test_a_goal_of_operator_and_mission_is_reached_for_both(bench: Callable[..., Bench]) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.do(ROUND)
    rover.order(SetGoal(("at:C",), 2.0))
    rover.run_s(1)
    rover.link_up = False
    rover.until(lambda: rover.of(ROVER_GOAL)[-1].change is GoalChange.REACHED)
    assert changes(rover) == [
        (GoalChange.SET, 2.0, GoalSource.OPERATOR),
        (GoalChange.SET, 1.0, GoalSource.MISSION),
        (GoalChange.REACHED, 2.0, GoalSource.OPERATOR),
        (GoalChange.REACHED, 1.0, GoalSource.MISSION),
    ]


@pytest.mark.parametrize("mode", [Mode.GUIDED, Mode.AUTONOMOUS])
def test_a_goal_where_the_rover_stands_is_reached_at_once_and_told_once(
    bench: Callable[..., Bench], mode: Mode
) -> None:
    rover = bench()
    rover.order(SetMode(mode))
    rover.order(SetGoal(("at:D",), 2.0))
    rover.run_s(3)
    assert changes(rover) == [
        (GoalChange.SET, 2.0, GoalSource.OPERATOR),
        (GoalChange.REACHED, 2.0, GoalSource.OPERATOR),
    ]
    assert rover.told(GoalReached) == [GoalReached(("at:D",))]
    assert rover.telemetry.goals == ()
    assert not rover.of(ROVER_ACTION_STARTED)


def test_a_goal_of_the_mission_where_the_rover_stands_is_reached_once_when_it_is_alone(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(goals=[{"place": "D", "priority": 1.0}, {"place": "C", "priority": 0.5}])
    rover.link_up = False
    rover.until(lambda: rover.of(ROVER_MODE)[-1].mode is Mode.AUTONOMOUS)
    rover.run_s(3)
    assert changes(rover) == [
        (GoalChange.SET, 1.0, GoalSource.MISSION),
        (GoalChange.SET, 0.5, GoalSource.MISSION),
        (GoalChange.REACHED, 1.0, GoalSource.MISSION),
        (GoalChange.SUSPENDED, 0.5, GoalSource.MISSION),
    ]


def test_a_mission_goal_that_is_satisfied_as_it_is_set_is_not_set_again_until_that_is_told(
    bench: Callable[..., Bench],
) -> None:
    """What the rover wants is looked at in every tick, and what to do only once in a while."""
    rover = bench(goals=[{"place": "D", "priority": 1.0}])
    for _ in range(3):
        rover.rover.parts.goals.follow_mission(wanted=True)
    rover.run_s(2)
    assert changes(rover) == [
        (GoalChange.SET, 1.0, GoalSource.MISSION),
        (GoalChange.REACHED, 1.0, GoalSource.MISSION),
    ]


def test_a_goal_that_the_rover_is_just_leaving_is_not_reached(
    bench: Callable[..., Bench],
) -> None:
    """It was sensed last where the move began; the rover has to come back."""
    rover = bench()
    rover.do("NS")
    rover.order(Drive("N"))
    rover.until(lambda: rover.telemetry.action == "N")
    rover.order(SetGoal(("at:D",), 2.0))
    rover.run_s(4)
    assert rover.telemetry.goals == (("at:D",),)
    assert not rover.told(GoalReached)
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.until(lambda: rover.told(GoalReached))
    assert [entry.action for entry in rover.of(ROVER_ACTION_STARTED)] == ["N", "S", "N", "S"]


def test_a_goal_that_the_operator_withdraws_stays_while_the_mission_wants_it(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.order(SetGoal(("at:C",), 2.0))
    rover.run_s(1)
    rover.link_up = False
    rover.until(lambda: rover.of(ROVER_MODE)[-1].mode is Mode.AUTONOMOUS)
    rover.link_up = True
    rover.order(WithdrawGoal(("at:C",)))
    rover.until(lambda: (GoalChange.WITHDRAWN, 2.0, GoalSource.OPERATOR) in changes(rover))
    rover.run_s(2)
    assert not rover.telemetry.goals, "it has the operator's word for none"
    assert rover.telemetry.alone_goals == (("at:C",),)
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.run_s(2)
    assert rover.telemetry.goals == (("at:C",),), "the operator confirmed"


def test_the_operator_may_withdraw_a_mission_goal_that_is_not_on_the_list_yet(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.do(ROUND)
    assert rover.telemetry.alone_goals == (("at:C",),), "the operator knows beforehand"
    rover.order(WithdrawGoal(("at:C",)))
    rover.run_s(2)
    assert changes(rover) == [(GoalChange.WITHDRAWN, 1.0, GoalSource.MISSION)]
    assert not rover.telemetry.alone_goals
    rover.link_up = False
    rover.run_s(60)
    assert [entry.mode for entry in rover.of(ROVER_MODE)] == [Mode.GUIDED]


def test_the_operator_may_do_without_charging(bench: Callable[..., Bench]) -> None:
    rover = bench(start="A", battery={"initial": 0.2})
    rover.run_s(2)
    assert rover.telemetry.goals == (("on_charge",),)
    rover.order(WithdrawGoal(("on_charge",)))
    rover.run_s(5)
    assert not rover.telemetry.goals


@pytest.mark.parametrize(
    ("goal", "why"),
    [
        (SetGoal((), 1.0), "a goal has one Token at least"),
        (SetGoal(("at:B",), math.nan), "a priority is a finite number, not nan"),
        (SetGoal(("at:B",), -math.inf), "a priority is a finite number, not -inf"),
    ],
)
def test_a_goal_that_is_none_is_refused_and_told(
    bench: Callable[..., Bench], goal: SetGoal, why: str
) -> None:
    rover = bench()
    number = rover.order(goal)
    rover.run_s(2)
    assert rover.not_done == [CommandReached(number, CommandStage.REFUSED, why)]
    assert rover.telemetry.goals == ()


def test_a_goal_that_cannot_be_is_put_aside_and_starves_no_other(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.do(ROUND)
    rover.order(SetGoal(("at:Z",), 5.0))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.until(lambda: "at:C" in rover.telemetry.tokens)
    rover.run_s(30)
    assert rover.telemetry.tokens == ("at:C",)
    assert rover.told(GoalAside) == [GoalAside(("at:Z",), "unknown")]


def test_a_goal_may_be_set_with_its_tokens_in_any_order(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(SetGoal(("on_charge", "at:D"), 1.0))
    rover.run_s(2)
    assert [change for change, *_ in changes(rover)] == [GoalChange.SET, GoalChange.REACHED]


def test_the_model_on_board_has_the_costs_and_parameters_of_the_mission(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(drive={"move_cost_s": 4.0}, dem={"initial_cm": 0.25})
    rover.do("EW")
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:2,1",), 1.0))
    rover.until(lambda: rover.proposals)
    assert [(step.action, step.cost_to_go) for step in rover.proposals[0].path] == [("E", 16.0)]
