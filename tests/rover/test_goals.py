"""What the rover wants: one Goal List for operator, mission and rover."""

from collections.abc import Callable

from farside.control import Mode
from farside.messages import SetGoal, SetMode, WithdrawGoal
from farside.topics import ROVER_GOAL, ROVER_MODE, GoalChange, GoalSource
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
    rover.until(lambda: changes(rover)[-1] == (GoalChange.WITHDRAWN, 2.0, GoalSource.OPERATOR))
    rover.run_s(2)
    assert rover.telemetry.goals == (("at:C",),)


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
