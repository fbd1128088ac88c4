"""The missions that ship beside `blackout`: each succeeds on every seed, and tells its story."""

from collections.abc import Callable, Collection

import pytest

from farside.control import Cause, Chooser, Failsafe, Mode, ModeCause
from farside.messages import GoalReached, LinkBack
from farside.missions import FinishedRun, Outcome, Rehearsal, load_mission
from farside.missions.advice import warnings
from farside.missions.loading import shipped_missions
from farside.places import LINK_UP
from farside.topics import (
    GROUND_EVENT,
    GROUND_REVIEW,
    ROVER_ACTION_STARTED,
    ROVER_FAILSAFE,
    ROVER_PROPOSAL_ENDED,
    TRUTH_POSE,
)

MISSIONS = ("mars-relay", "shadow", "teach", "tether")
SEEDS = range(1, 6)


def states(run: FinishedRun, start_s: float = 0, end_s: float = 1e9) -> set[Failsafe]:
    return {e.state for t_s, e in run.entries(ROVER_FAILSAFE) if start_s <= t_s < end_s}


def actions(
    run: FinishedRun, choosers: Collection[Chooser], start_s: float = 0, end_s: float = 1e9
) -> list[tuple[float, str]]:
    return [
        (t_s, started.action)
        for t_s, started in run.entries(ROVER_ACTION_STARTED)
        if start_s <= t_s < end_s and started.chooser in choosers
    ]


def told(run: FinishedRun, what: object) -> float:
    """When the ground first learned of something."""
    return next(t_s for t_s, entry in run.entries(GROUND_EVENT) if entry.event.what == what)


@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_ships_and_nothing_in_it_needs_advice(name: str) -> None:
    assert name in shipped_missions()
    mission = load_mission(name).mission
    assert mission.name == name
    assert mission.about
    assert "obedience" in {expected.__struct_config__.tag for expected in mission.expect}
    assert list(warnings(mission)) == []


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        *((name, seed) for name in ("shadow", "teach", "tether") for seed in SEEDS),
        ("mars-relay", 1),  # flown for the story below; another seed is flown there in part
    ],
)
def test_a_shipped_mission_succeeds_on_every_seed(
    mission: Callable[[str], Rehearsal], name: str, seed: int
) -> None:
    run = mission(name).with_seed(seed).run()
    assert run.result.outcome is Outcome.SUCCESS, run.result.expectations
    assert run.result.operator.step == run.result.operator.of, "the script came to its end"
    assert run.result.operator.waiting_for is None


# --- mars-relay -----------------------------------------------------------------------------------

PASSES_S = ((120, 600), (7320, 7800), (14520, 15000))


def test_between_passes_nothing_alarms_and_the_rover_goes_on_with_what_it_was_left(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("mars-relay").run()
    assert states(run) == {Failsafe.NOMINAL}
    assert {mode.why for mode in run.modes} == {ModeCause.START, ModeCause.OPERATOR}
    for goal, left, comes in (("at:B", *PASSES_S[:2]), ("at:S", *PASSES_S[1:])):
        assert left[1] < run.reached(goal) < comes[0], "reached in silence"
        assert comes[0] < told(run, GoalReached((goal,))) < comes[0] + 5, "and reported at once"
    charged = [goal.reached_s for goal in run.goals if goal.tokens == ("on_charge",)]
    for charged_s, (left_s, comes_s) in zip(charged, ((600, 7320), (7800, 14520)), strict=True):
        assert left_s < charged_s < comes_s
    assert [t for t, _ in actions(run, {Chooser.GUIDED}) if not in_pass(t)] == []


def in_pass(t_s: float) -> bool:
    return any(begin <= t_s < end for begin, end in PASSES_S)


def test_what_it_measured_in_two_hours_comes_down_in_the_next_pass(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("mars-relay").run()
    measured_s = {t.time_ns // 10**9 for _, t in run.telemetry}
    assert len(measured_s & set(range(600, 7320))) > 6000


def test_a_pass_in_which_nothing_is_heard_is_not_planned_and_alarms(
    mission: Callable[[str], Rehearsal],
) -> None:
    """On another seed, which goes the same way up to then."""
    again = mission("mars-relay").with_seed(2).blackout(7320, 480).set("duration_s", 7500.0)
    run = again.set("expect", []).run()
    assert states(run, 0, 7320) == {Failsafe.NOMINAL}
    assert 600 < run.reached("at:B") < 7320
    held_s = next(t for t, e in run.entries(ROVER_FAILSAFE) if e.state is Failsafe.HOLD)
    assert 7320 < held_s < 7350
    lost_s = next(t for t, e in run.entries(ROVER_FAILSAFE) if Cause.LOST in e.causes)
    assert 7350 < lost_s < 7400


# --- teach ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_once_it_is_left_alone_not_a_word_is_said_and_it_knows_every_way(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    run = mission("teach").with_seed(seed).run()
    chart = load_mission("teach").mission.world.chart()
    every = sum(1 for cell in chart.tokens for _ in chart.neighbours(cell))
    driven = actions(run, {Chooser.GUIDED})
    assert len(driven) == every == 82, "each move once"
    assert [sent for t_s, sent in run.commands_sent if t_s > 300][4:] == []
    alone = actions(run, {Chooser.GOAL_DIRECTED})
    assert min(t_s for t_s, _ in alone) > 300
    assert len(alone) == len(actions(run, set(Chooser), 300)), "no step that it had to look for"
    places = (goal.reached_s for goal in run.goals)
    assert all(reached_s is not None and 310 < reached_s < 500 for reached_s in places)


# --- tether ---------------------------------------------------------------------------------------


def test_on_the_cable_every_move_is_by_order_or_by_consent_and_none_in_a_long_drop(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("tether").run()
    assert {mode.mode for mode in run.modes} == {Mode.GUIDED, Mode.SHARED}
    assert states(run) == {Failsafe.NOMINAL, Failsafe.HOLD, Failsafe.SAFE}
    consented = actions(run, {Chooser.GOAL_DIRECTED})
    ended = [entry.why for _, entry in run.entries(ROVER_PROPOSAL_ENDED)]
    assert len(consented) == ended.count("carried out, as no veto came") > 20
    assert "the situation is another one" in ended, "a drop ends what was proposed before it"
    assert [t_s for t_s, _ in consented if 318 < t_s < 331] == []
    why = {e.why for t_s, e in run.entries(ROVER_FAILSAFE) if 316 < t_s < 331}
    assert "the link is lost, and autonomy is forbidden then" in why


def test_on_the_cable_the_operator_speaks_up_once_and_is_obeyed(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("tether").run()
    (review,) = [review for _, review in run.entries(GROUND_REVIEW)]
    assert (review.proposal, review.action, review.override) == (2, "E", "W")


@pytest.mark.parametrize(("start_s", "end_s"), [(207, 232), (395, 405)])
def test_while_something_is_wrong_with_the_robot_it_stands(
    mission: Callable[[str], Rehearsal], start_s: int, end_s: int
) -> None:
    run = mission("tether").run()
    everyone = set(Chooser)
    assert states(run, start_s, start_s + 1) == {Failsafe.SAFE}
    assert run.failsafe_at(end_s - 0.5) is Failsafe.SAFE
    assert actions(run, everyone, start_s, end_s) == []
    assert actions(run, everyone, end_s, end_s + 15), "and goes on afterwards"


# --- shadow ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_it_loses_the_link_in_the_crater_and_comes_back_to_where_it_works(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    run = mission("shadow").with_seed(seed).run()
    first_s = run.reached("at:10,5")
    alone_s = [t for t, e in run.entries(ROVER_FAILSAFE) if Cause.NO_SIGNAL in e.causes]
    alone_s = [t for t in alone_s if run.failsafe_at(t) is Failsafe.ALONE]
    assert any(first_s < t_s < run.reached("at:8,3") for t_s in alone_s), "a goal for then"
    back = [e.event.what for _, e in run.entries(GROUND_EVENT) if type(e.event.what) is LinkBack]
    assert len(back) >= 2, "it was away twice at least"
    assert ("at:8,3",) in back[-2].reached
    assert told(run, GoalReached(("at:8,3",))) > run.reached("at:8,3") + 3, "told outside"
    poses = [pose.place for t_s, pose in run.entries(TRUTH_POSE) if t_s > 790]
    assert set(poses) == {"at:D"}, "the operator took over and drove it home"
    assert run.mode_at(790) is Mode.GUIDED


@pytest.mark.parametrize("seed", SEEDS)
def test_the_second_time_it_leaves_the_crater_by_ways_that_it_learned_the_first_time(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    run = mission("shadow").with_seed(seed).run()
    ways = [
        (t_s, started.chooser, started.action)
        for t_s, started in run.entries(ROVER_ACTION_STARTED)
        if started.goal == (LINK_UP,)
    ]
    again_s = [goal.reached_s for goal in run.goals if goal.tokens == ("at:8,3",)][-1]
    second = [(chooser, action) for t_s, chooser, action in ways if t_s > again_s]
    assert second == [(Chooser.GOAL_DIRECTED, "W")] * 2
    assert len(ways) > len(second)


@pytest.mark.parametrize("seed", SEEDS)
def test_however_curious_it_does_not_explore_on_its_way_to_where_the_link_works(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    """Trying something new would cost less than the known way out."""
    curious = mission("shadow").with_seed(seed).set("rover.dem.curiosity.optimistic_cost", 5.0)
    run = curious.set("expect", []).run()
    choosers = [
        started.chooser
        for _, started in run.entries(ROVER_ACTION_STARTED)
        if started.goal == (LINK_UP,)
    ]
    assert Chooser.GOAL_DIRECTED in choosers
    assert Chooser.EXPLORATORY not in choosers


def test_told_not_to_return_it_stays_where_its_goals_ended(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("shadow").set("rover.failsafe.return_to", "none").set("expect", []).run()
    place = [pose.place for _, pose in run.entries(TRUTH_POSE)][-1]
    assert place == "at:8,3"
    assert run.result.operator.waiting_for is not None, "nobody ever hears of it again"
