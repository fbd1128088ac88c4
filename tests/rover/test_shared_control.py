"""Who drives: the seed's figure 2 as stories, told to a rover on a bench."""

from collections.abc import Callable

import pytest

from farside.control import Chooser, CommandStage, Failsafe, Mode
from farside.messages import (
    Approve,
    CommandReached,
    Drive,
    GoalAside,
    GoalReached,
    LinkBack,
    Override,
    SetGoal,
    SetMode,
    WithdrawGoal,
)
from farside.topics import (
    ROVER_ACTION_STARTED,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    GoalChange,
    GoalEntry,
    GoalSource,
)
from tests.rover.conftest import TICK_NS, Bench

ROUND = "NNEEEEESSNNWWWWWSS"  # from the dock to C and back: everything there is to know


def actions(rover: Bench) -> list[tuple[str, Chooser]]:
    return [(started.action, started.chooser) for started in rover.of(ROVER_ACTION_STARTED)]


def test_a_rover_without_orders_stands_and_learns_nothing(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.run_s(60)
    assert actions(rover) == []
    assert rover.of(ROVER_CYCLE)[-1].hypotheses == 0


def test_a_guided_rover_obeys_and_its_dem_learns(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do("EW")
    assert actions(rover) == [("E", Chooser.GUIDED), ("W", Chooser.GUIDED)]
    assert rover.of(ROVER_CYCLE)[-1].hypotheses >= 2


def test_a_goal_alone_moves_nothing_while_guided(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do(ROUND)
    before = len(actions(rover))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.run_s(30)
    assert len(actions(rover)) == before
    assert rover.proposals == []


def test_in_shared_mode_nothing_moves_without_the_operators_word(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.do(ROUND)
    before = len(actions(rover))
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.run_s(30)
    assert [proposal.action for proposal in rover.proposals] == ["N"]
    assert len(actions(rover)) == before


def test_consent_by_consent_the_rover_reaches_the_goal_along_its_policy_path(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.do(ROUND)
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: rover.proposals)
    path = [step.action for step in rover.proposals[0].path]
    assert path == list("NNEEEEESS")
    costs = [step.cost_to_go for step in rover.proposals[0].path]
    assert costs == sorted(costs, reverse=True)
    for number in range(1, 10):
        while rover.proposals[-1].number != number:
            rover.run(TICK_NS)
        rover.order(Approve(number))
    rover.until(lambda: rover.of(ROVER_GOAL)[-1].change is GoalChange.REACHED)
    assert actions(rover)[-9:] == [(action, Chooser.GOAL_DIRECTED) for action in path]


def test_the_operator_may_override(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do(ROUND)
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: rover.proposals)
    rover.order(Override(1, "E"))
    rover.run_s(20)
    assert actions(rover)[-1] == ("E", Chooser.GUIDED)
    assert len(rover.proposals) == 1, "it was never there, and knows no way to propose"
    assert rover.told(GoalAside)[-1] == GoalAside(("at:C",), "unreachable")
    rover.do("W")
    rover.until(lambda: rover.proposals[-1].number == 2)
    assert rover.told(GoalAside)[-1] == GoalAside(("at:C",), None)


def test_an_answer_to_a_proposal_that_is_no_more_is_refused(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do(ROUND)
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: rover.proposals)
    rover.do("N")  # the operator drove on meanwhile
    rover.until(lambda: rover.proposals[-1].number == 2)
    before = len(actions(rover))
    number = rover.order(Approve(1))
    rover.run_s(10)
    assert rover.end_of(number).stage is CommandStage.REFUSED
    assert rover.end_of(number).why.startswith("proposal 1 gave way to")
    assert len(actions(rover)) == before


def test_in_autonomous_mode_it_goes_by_itself_and_stops_when_there(
    bench: Callable[..., Bench],
) -> None:
    rover = bench()
    rover.do(ROUND)
    rover.order(SetGoal(("at:C",), 1.0))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.until(lambda: "at:C" in rover.telemetry.tokens)
    rover.run_s(30)
    assert rover.telemetry.tokens == ("at:C",)
    assert rover.telemetry.action is None


def test_autonomous_without_a_goal_it_stands(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do(ROUND)
    before = len(actions(rover))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.run_s(30)
    assert len(actions(rover)) == before


def test_towards_an_unknown_place_it_stands_and_says_so(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(SetGoal(("at:C",), 1.0))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.run_s(20)
    assert actions(rover) == []
    assert rover.told(GoalAside) == [GoalAside(("at:C",), "unknown")]


@pytest.mark.parametrize("exploration", ["random", "curious"])
def test_it_explores_if_the_mission_says_so(bench: Callable[..., Bench], exploration: str) -> None:
    rover = bench(dem={"exploration": exploration})
    rover.order(SetGoal(("at:C",), 1.0))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.run_s(20)
    assert {chooser for _, chooser in actions(rover)} == {Chooser.EXPLORATORY}


def test_in_shared_mode_nothing_is_proposed_off_the_map(bench: Callable[..., Bench]) -> None:
    rover = bench(dem={"exploration": "random"})
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.run_s(20)
    assert rover.proposals == []
    assert actions(rover) == []


def test_a_goal_where_it_stands_is_reached_at_once(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(SetGoal(("at:D",), 1.0))
    rover.run_s(2)
    assert [entry.change for entry in rover.of(ROVER_GOAL)] == [GoalChange.SET, GoalChange.REACHED]


def test_a_withdrawn_goal_is_given_up(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.order(SetGoal(("at:C",), 1.0))
    rover.order(WithdrawGoal(("at:C",)))
    rover.order(WithdrawGoal(("at:C",)))
    rover.run_s(2)
    assert rover.telemetry.goals == ()
    assert rover.of(ROVER_COMMAND)[-1].why == "it is no goal"


def test_a_command_that_comes_too_late_is_refused_and_told(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.run_s(5)
    rover.order(Drive("E"), expires_s=3.0)
    rover.run_s(5)
    assert actions(rover) == []
    assert rover.of(ROVER_COMMAND)[-1].stage is CommandStage.EXPIRED
    assert rover.of(ROVER_COMMAND)[-1].why == "it came too late"


def test_when_silence_grows_it_holds_and_then_goes_on_alone(bench: Callable[..., Bench]) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.do(ROUND)
    rover.run_s(3)
    rover.link_up = False
    lost_s = rover.until(lambda: rover.of(ROVER_MODE)[-1].mode is Mode.AUTONOMOUS)
    states = [(entry.state, round(entry.silence_s)) for entry in rover.of(ROVER_FAILSAFE)]
    assert states == [(Failsafe.NOMINAL, 0), (Failsafe.HOLD, 10), (Failsafe.ALONE, 30)]
    assert rover.of(ROVER_GOAL)[-1] == GoalEntry(("at:C",), GoalChange.SET, 1.0, GoalSource.MISSION)
    reached_s = rover.until(lambda: rover.of(ROVER_GOAL)[-1].change is GoalChange.REACHED)
    assert reached_s > lost_s
    assert rover.of(ROVER_MODE)[-1].why == "link lost"


def test_with_no_goal_at_all_silence_only_makes_it_hold(bench: Callable[..., Bench]) -> None:
    rover = bench()
    rover.do(ROUND)
    before = len(actions(rover))
    rover.link_up = False
    rover.run_s(120)
    assert rover.of(ROVER_FAILSAFE)[-1].why == "the link is lost, and no goal is left"
    assert [entry.mode for entry in rover.of(ROVER_MODE)] == [Mode.GUIDED]
    assert len(actions(rover)) == before


def test_orders_that_waited_when_the_link_was_lost_are_dropped_and_told(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(drive={"give_up_s": 1000.0, "speed_m_s": 0.02})
    rover.order(Drive("N"))
    waiting = rover.order(Drive("N"))
    rover.run_s(1)
    rover.link_up = False
    rover.run_s(200)
    assert len(actions(rover)) == 1
    told = [event.what for event in rover.events]
    why = "the link was lost before it began"
    assert CommandReached(waiting, CommandStage.SUPERSEDED, why) in told


def test_it_reports_what_it_did_alone_when_the_link_returns(bench: Callable[..., Bench]) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.do(ROUND)
    rover.link_up = False
    reached = GoalEntry(("at:C",), GoalChange.REACHED, 1.0, GoalSource.MISSION)
    rover.until(lambda: reached in rover.of(ROVER_GOAL))
    rover.until(lambda: GoalReached(("at:C",)) in [event.what for event in rover.events])
    rover.link_up = True
    rover.until(lambda: rover.told(LinkBack))
    assert rover.told(LinkBack)[0].reached == (("at:C",),)
    rover.run_s(5)
    assert rover.telemetry.mode is Mode.AUTONOMOUS, "it stays so until the operator says otherwise"
    assert rover.telemetry.failsafe is Failsafe.HOLD, "and begins nothing"


def test_mission_goals_leave_the_list_when_the_operator_takes_over(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(goals=[{"place": "C", "priority": 1.0}])
    rover.link_up = False
    rover.until(lambda: rover.telemetry.mode is Mode.AUTONOMOUS)
    assert rover.telemetry.goals == (("at:C",),)
    rover.link_up = True
    rover.run_s(3)
    rover.order(SetMode(Mode.GUIDED))
    rover.until(lambda: rover.telemetry.mode is Mode.GUIDED)
    assert not rover.telemetry.goals


def test_a_low_battery_sends_an_autonomous_rover_to_the_dock(bench: Callable[..., Bench]) -> None:
    """`battery:low` puts `on_charge` on the Goal List; once urgent enough, it comes first."""
    rover = bench(battery={"capacity_j": 20_000.0, "low": 0.5, "charge_w": 500.0})
    rover.do(ROUND)
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.order(SetGoal(("at:C",), 0.5))
    rover.until(lambda: "at:C" in rover.telemetry.tokens)
    rover.until(lambda: "battery:low" in rover.telemetry.tokens, within_s=1200)
    rover.until(lambda: "on_charge" in rover.telemetry.tokens, within_s=200)
    rover.until(lambda: "battery:low" not in rover.telemetry.tokens)
    charging = [goal for goal in rover.of(ROVER_GOAL) if goal.source is GoalSource.INHERENT]
    assert [goal.change for goal in charging] == [GoalChange.SET, GoalChange.REACHED]
    assert {goal.tokens for goal in charging} == {("on_charge",)}


def test_the_wish_to_charge_overtakes_other_goals_as_the_battery_empties(
    bench: Callable[..., Bench],
) -> None:
    rover = bench(
        goals=[], battery={"capacity_j": 30_000.0, "initial": 0.5, "low": 0.45}, start="A"
    )
    rover.do("SSNNEEEEEWWWWW")
    rover.until(lambda: "battery:low" in rover.telemetry.tokens, within_s=900)
    rover.order(SetGoal(("at:B",), 3.0))
    rover.run_s(1)
    assert rover.telemetry.goals[0] == ("at:B",)
    rover.until(lambda: rover.telemetry.goals[0] == ("on_charge",), within_s=3000)
