"""Orders of events in which control once went wrong, with what is right.

Found by trying operational scenarios on `blackout` as operations people would.
"""

from collections.abc import Callable, Sequence

import pytest
from numpy.random import Generator
from timed import Timed

from farside.control import Chooser, CommandStage, Failsafe, Mode, ModeCause
from farside.messages import (
    Approve,
    CommandReached,
    CommandsMissing,
    Drive,
    GoalAside,
    Happening,
    LinkBack,
    Order,
    Override,
    SetGoal,
    SetMode,
    WithdrawGoal,
)
from farside.missions import FinishedRun, Rehearsal
from farside.missions.surprises import surprises
from farside.places import Chart
from farside.topics import (
    GROUND_EVENT,
    GROUND_REVIEW,
    ROVER_ACTION_STARTED,
    ROVER_FAILSAFE,
    TRUTH_POSE,
    ActionStarted,
)

Ordered = Callable[[Rehearsal, Sequence[tuple[float, Order]]], FinishedRun]


@pytest.fixture
def ordered() -> Ordered:
    """Runs a rehearsal with orders given by the clock."""

    def run(rehearsal: Rehearsal, orders: Sequence[tuple[float, Order]]) -> FinishedRun:
        class ByTheClock(Timed):
            def __init__(self, _chart: Chart, *, rng: Generator) -> None:  # noqa: ARG002 - as all
                super().__init__(orders)

        return rehearsal.set("expect", [{"what": "obedience"}]).operator(ByTheClock).run()

    return run


def actions(run: FinishedRun, start_s: float = 0, end_s: float = 1e9) -> list[ActionStarted]:
    return [a for t_s, a in run.entries(ROVER_ACTION_STARTED) if start_s <= t_s < end_s]


def own(run: FinishedRun, start_s: float = 0, end_s: float = 1e9) -> list[ActionStarted]:
    return [a for a in actions(run, start_s, end_s) if a.chooser is not Chooser.GUIDED]


def told(run: FinishedRun) -> list[Happening]:
    return [entry.event.what for _, entry in run.entries(GROUND_EVENT)]


def not_done(run: FinishedRun) -> list[CommandReached]:
    """What the ground has heard of commands that ended without being done."""
    ends = [what for what in told(run) if isinstance(what, CommandReached) and what.stage.is_last]
    return [what for what in ends if what.stage is not CommandStage.DONE]


def ends(run: FinishedRun, stage: CommandStage) -> list[int]:
    return [entry.number for _, entry in run.command_stages if entry.stage is stage]


def no_surprise(run: FinishedRun) -> bool:
    found = list(surprises(run))
    assert found == []
    return True


# --- the fight between rover and operator ---------------------------------------------------------


@pytest.mark.parametrize("seed", range(1, 5))
def test_after_a_silence_in_the_tour_the_rover_leaves_it_to_the_operator(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    """It takes over; when the link is back it stands, and the next drive takes over from it."""
    run = mission("blackout").with_seed(seed).blackout(100, 100).run()
    assert [(m.mode, m.why) for m in run.modes[1:3]] == [
        (Mode.AUTONOMOUS, ModeCause.LINK_LOST),
        (Mode.GUIDED, ModeCause.TAKEN_OVER),
    ]
    back_s = next(
        t_s for t_s, e in run.entries(ROVER_FAILSAFE) if t_s > 200 and e.state is Failsafe.HOLD
    )
    assert back_s == pytest.approx(202, abs=2.5)
    assert own(run, back_s, run.reached("at:A") - 300) == []
    assert [what.reached for what in told(run) if isinstance(what, LinkBack)] == [()]
    assert no_surprise(run)


def test_a_drive_that_was_on_its_way_is_not_carried_out_elsewhere(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    """Given a moment before the loss, delivered after it, when the rover has gone elsewhere."""
    rehearsal = mission("blackout").set("ground.command_lifetime_s", 1000.0).blackout(60, 100)
    tour: list[tuple[float, Order]] = [(5 + 6 * n, Drive(a)) for n, a in enumerate("NSNSNSNS")]
    late = rehearsal.set("rover.goals", [{"place": "5,4"}]).set("duration_s", 260)
    run = ordered(late, [*tour, (59.5, Drive("N")), (200, SetMode(Mode.GUIDED))])
    assert own(run, 60, 160), "it went to its mission goal alone"
    refused = [e for _, e in run.command_stages if e.stage is CommandStage.REFUSED]
    assert [e.why for e in refused] == [
        "it was meant for mode guided, and the rover is in mode autonomous"
    ]
    assert actions(run, 160) == []
    assert no_surprise(run)


def test_nothing_resumes_by_itself_however_long_nobody_says_anything(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    rehearsal = mission("blackout").set("duration_s", 900).blackout(100, 40)
    tour: list[tuple[float, Order]] = [(5 + 6 * n, Drive(a)) for n, a in enumerate("SNSNSN")]
    run = ordered(rehearsal.set("rover.goals", [{"place": "5,4"}, {"place": "C"}]), tour)
    assert own(run, 142) == []
    assert run.mode_at(890) is Mode.AUTONOMOUS
    assert run.failsafe_at(890) is Failsafe.HOLD


def test_what_the_operator_left_in_autonomy_goes_on_by_itself(
    mission: Callable[[str], Rehearsal],
) -> None:
    """The exception: the operator's own word, from before the loss."""
    script = [
        {"do": "tour", "places": ["8,2", "A", "D"]},
        {"do": "mode", "mode": "autonomous"},
        {"do": "goal", "place": "A"},
        {"do": "goal", "place": "8,2"},
    ]
    rehearsal = mission("blackout").set("ground.script", script).set("expect", [])
    start_s = rehearsal.without_blackouts().run().goals[0].set_s
    run = rehearsal.set("rover.goals", []).blackout(start_s + 10, 15).run()
    assert own(run, start_s + 28)
    assert [m.why for m in run.modes].count(ModeCause.LINK_LOST) == 0
    assert run.reached("8,2")
    assert no_surprise(run)


# --- a command's life -----------------------------------------------------------------------------


def test_telemetry_never_calls_a_waiting_command_done(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    """The eye of the ground: commands done only ever grow, and never include one that waits."""
    run = ordered(
        mission("blackout").set("duration_s", 60).without_blackouts(),
        [(5.0, Drive("N")), (5.1, Drive("W")), (5.2, Drive("W"))],
    )
    done = [telemetry.commands_done for _, telemetry in run.telemetry]
    assert done == sorted(done)
    for _, telemetry in run.telemetry:
        assert all(number > telemetry.commands_done for number in telemetry.waiting)
        assert telemetry.begun is None or telemetry.begun > telemetry.commands_done
    assert (2, 3) in [t.waiting for _, t in run.telemetry if t.begun == 1]


def test_drives_that_expire_in_an_outage_are_not_begun_after_it(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    rehearsal = mission("blackout").set("duration_s", 90).blackout(12.5, 24.5)
    rehearsal = rehearsal.set("ground.command_lifetime_s", 5.0)
    run = ordered(rehearsal, [(9.9, Drive(action)) for action in "NSNSNSNS"])
    assert actions(run, 12.5 + 10) == []
    assert len(ends(run, CommandStage.EXPIRED)) >= 4
    assert sorted(what.number for what in not_done(run)) == sorted(ends(run, CommandStage.EXPIRED))
    assert no_surprise(run)


def test_with_a_flat_battery_orders_are_refused_and_told(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    rehearsal = mission("blackout").without_blackouts().set("duration_s", 120)
    rehearsal = rehearsal.set("rover.start", "5,4").set("rover.battery.capacity_j", 900.0)
    run = ordered(rehearsal, [(40, Drive("W")), (40, Drive("E")), (100, Drive("W"))])
    why = [what.why for what in not_done(run)]
    assert set(why) <= {"the battery is flat", "its move was blocked, or given up"}
    assert why[-1] == "the battery is flat"
    assert run.telemetry[-1][1].waiting == ()


def test_no_order_ends_the_rover_and_each_is_answered(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    rehearsal = mission("blackout").without_blackouts().set("duration_s", 900)
    wild: list[Order] = [
        SetGoal((), 1.0),
        SetGoal(("at:A",), float("nan")),
        SetGoal(("at:A",), float("inf")),
        Drive("UP"),
        Drive(""),
        WithdrawGoal(()),
        SetGoal(("at:Z",), 1.0),
        SetMode(Mode.AUTONOMOUS),
    ]
    run = ordered(rehearsal, [(5 + n, order) for n, order in enumerate(wild)])
    assert ends(run, CommandStage.REFUSED) == [1, 2, 3, 4, 5, 6]
    assert ends(run, CommandStage.DONE) == [7, 8]
    assert actions(run) == [], "an unknown place is no reason to roam"
    assert GoalAside(("at:Z",), "unknown") in told(run)
    assert no_surprise(run)


def test_a_mission_goal_can_be_withdrawn_while_parked(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    rehearsal = mission("blackout").set("duration_s", 300).blackout(100, 150)
    run = ordered(rehearsal, [(5, Drive("N")), (20, WithdrawGoal(("at:C",)))])
    assert run.telemetry[5][1].alone_goals == (("at:C",),)
    assert run.telemetry[60][1].alone_goals == ()
    assert own(run) == []
    assert [m.mode for m in run.modes] == [Mode.GUIDED]


# --- words that come too late ---------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(1, 4))
def test_over_a_lossy_uplink_nobody_waits_for_ever(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    rehearsal = mission("blackout").without_blackouts().with_seed(seed).set("link.up.loss", 0.3)
    rehearsal = rehearsal.set("ground.command_lifetime_s", 3.0).set("duration_s", 2000)
    run = rehearsal.set("expect", [{"what": "reached", "place": "B"}, {"what": "obedience"}]).run()
    assert all(judgement.met for judgement in run.result.expectations)


@pytest.mark.parametrize("start_s", [440, 450, 452, 453, 595, 600, 602])
def test_a_goal_or_a_mode_that_comes_too_late_is_ordered_again(
    mission: Callable[[str], Rehearsal], start_s: float
) -> None:
    rehearsal = mission("blackout").blackout(start_s, 28).set("duration_s", 1100)
    run = rehearsal.set("expect", [{"what": "reached", "place": "B"}, {"what": "obedience"}]).run()
    assert all(judgement.met for judgement in run.result.expectations)


def test_a_review_is_of_the_proposal_that_was_answered(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    answers = [
        entry.order.proposal
        for _, entry in run.commands_taken
        if isinstance(entry.order, Approve | Override)
    ]
    assert [review.proposal for _, review in run.entries(GROUND_REVIEW)] == answers


# --- battery and shadow ---------------------------------------------------------------------------


def test_a_lost_rover_does_not_die_beside_its_dock(mission: Callable[[str], Rehearsal]) -> None:
    """No goal when the link goes; the battery runs low later, and autonomy is judged then."""
    rehearsal = mission("blackout").set("rover.goals", []).set("rover.battery.capacity_j", 40_000.0)
    run = rehearsal.blackout(300, 3000).set("duration_s", 3000).set("expect", []).run()
    alone = [t_s for t_s, e in run.entries(ROVER_FAILSAFE) if e.state is Failsafe.ALONE]
    assert alone
    assert alone[0] > 335, "not at the loss: there was nothing to do"
    assert run.flat_since_s is None
    assert run.reached("on_charge")
    assert no_surprise(run)


def test_on_a_map_without_a_dock_nothing_looks_for_one(mission: Callable[[str], Rehearsal]) -> None:
    world = mission("blackout")
    text = "#########\n#A.....B#\n#########\n"
    rehearsal = world.set("world.map", text).set("rover.start", "A").set("rover.goals", [])
    rehearsal = rehearsal.set("ground.script", [{"do": "tour", "places": ["B"]}]).set("expect", [])
    rehearsal = rehearsal.set("rover.battery.capacity_j", 20_000.0)
    run = rehearsal.blackout(60, 1000).set("duration_s", 1000).run()
    assert own(run) == []
    assert run.goals == ()


def test_out_of_the_shadow_it_backs_the_way_it_came(mission: Callable[[str], Rehearsal]) -> None:
    text = mission("blackout")
    rows = [
        "#################",
        "#A..##....##..B##",
        "#...##..o.##...##",
        "#...##....##...##",
        "##.###.##.###.###",
        "#.......~.......#",
        "###.#D##.####.###",
        "#....##...#....##",
        "#C...##...#....##",
        "#################",
    ]
    rehearsal = text.set("world.map", "\n".join(rows)).set("rover.goals", []).set("expect", [])
    script = [{"do": "tour", "places": ["8,4"]}]
    run = rehearsal.without_blackouts().set("ground.script", script).set("duration_s", 200).run()
    returning = own(run)
    assert [a.chooser for a in returning] == [Chooser.RETURNING]
    assert run.entries(TRUTH_POSE)[-1][1].place == "at:7,4"
    assert LinkBack in [type(what) for what in told(run)]
    assert no_surprise(run)


def test_in_a_blackout_it_does_not_explore_unless_the_mission_says_so(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").blackout(30, 600).run()
    assert [a for a in own(run) if a.chooser is Chooser.EXPLORATORY] == []


# --- what is expected, and what arrives -----------------------------------------------------------


def test_silence_between_passes_known_to_both_ends_is_no_loss(
    mission: Callable[[str], Rehearsal],
) -> None:
    passes = {"first_s": 0.0, "period_s": 600.0, "length_s": 200.0}
    rehearsal = mission("blackout").without_blackouts().set("link.passes", passes)
    run = rehearsal.set("duration_s", 3600).set("expect", []).run()
    assert {entry.state for _, entry in run.entries(ROVER_FAILSAFE)} == {Failsafe.NOMINAL}
    assert "nothing is heard, as planned" in {e.why for _, e in run.entries(ROVER_FAILSAFE)}
    assert [m.why for m in run.modes].count(ModeCause.LINK_LOST) == 0


def test_what_an_outage_of_the_downlink_alone_hides_is_told_after_it(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").blackout(300, 100, "down").run()
    told_s = {round(t.time_ns / 1e9) for _, t in run.telemetry}
    missing = set(range(300, 400)) - told_s
    assert len(missing) <= 3


def test_a_ground_whose_rover_lost_its_place_waits_and_says_for_what(
    mission: Callable[[str], Rehearsal],
) -> None:
    fault = [{"what": "position-sensor", "start_s": 60.0}]
    run = mission("blackout").set("rover.faults", fault).set("expect", []).run()
    assert run.result.operator.waiting_for == "the rover to know where it is"
    assert run.failsafe_at(1000) is Failsafe.SAFE


def test_a_goal_reached_before_the_script_waits_for_it_does_not_count(
    mission: Callable[[str], Rehearsal],
) -> None:
    script = [
        {"do": "tour", "places": ["5,4", "D"]},
        {"do": "mode", "mode": "shared"},
        {"do": "goal", "place": "5,4"},
        {"do": "await", "place": "5,4"},
    ]
    rehearsal = mission("blackout").set("ground.script", script).set("expect", [])
    run = rehearsal.without_blackouts().set("duration_s", 300).run()
    assert run.reached("5,4")
    assert run.result.operator.waiting_for == "goal 5,4 to be reached, which others set"


@pytest.mark.parametrize("period_s", [33, 64])
@pytest.mark.parametrize("open_s", [1.0, 2.0])
def test_on_a_flapping_link_what_can_get_through_gets_through(
    mission: Callable[[str], Rehearsal], ordered: Ordered, period_s: int, open_s: float
) -> None:
    rehearsal = mission("blackout").set("duration_s", 2400).set("rover.goals", [])
    rehearsal = rehearsal.set("ground.command_lifetime_s", 4000.0)
    dark = [
        {"start_s": float(t_s), "end_s": t_s + period_s - open_s}
        for t_s in range(60, 2400 - period_s, period_s)
    ]
    run = ordered(rehearsal.set("link.blackouts", dark), [(61, SetGoal(("at:A",), 1.0))])
    assert len(run.frames("up", "delivered")) > 30
    assert [taken.number for _, taken in run.commands_taken] == [1]


def test_a_rover_that_hears_the_ground_but_gets_no_orders_says_so(
    mission: Callable[[str], Rehearsal], ordered: Ordered
) -> None:
    """Segments are longer than heartbeats, and this link lets only short frames through."""
    rehearsal = mission("blackout").set("duration_s", 400).without_blackouts()
    rehearsal = rehearsal.set("link.up.bit_error_rate", 3e-3)
    goal = SetGoal(tuple(f"at:{n}" for n in range(40)), 1.0)
    run = ordered(rehearsal, [(30, goal)])
    assert CommandsMissing(missing=True, last=1) in told(run)
