"""Scripted blackouts on the shipped mission: what the rover does when the link goes, and when.

The mission's own blackout lasts from 620 s to 980 s. The rover holds after 10 s of silence and
takes the link for lost after 30 s. Heartbeats come every 2 s, so silence begins up to 2 s before
the link goes.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from farside.control import Failsafe, Mode
from farside.frames import Fate
from farside.messages import FailsafeChanged, GoalAside, GoalReached
from farside.missions import FinishedRun, Outcome, Rehearsal
from farside.node import Direction
from farside.topics import (
    GROUND_EVENT,
    GROUND_REVIEW,
    GROUND_SILENCE,
    ROVER_ACTION_STARTED,
    ROVER_FAILSAFE,
    TRUTH_POSE,
    ActionStarted,
)


def switched_to_autonomy(run: FinishedRun) -> list[float]:
    return [mode.t_s for mode in run.modes if mode.mode is Mode.AUTONOMOUS]


def moves(run: FinishedRun, start_s: float, end_s: int) -> list[ActionStarted]:
    return [started for t_s, started in run.entries(ROVER_ACTION_STARTED) if start_s <= t_s < end_s]


def test_the_three_stages_of_the_shipped_mission(mission: Callable[[str], Rehearsal]) -> None:
    """Watched, consulted, alone: the rover reaches A under consent, then B and C by itself."""
    run = mission("blackout").run()
    assert run.result.outcome is Outcome.SUCCESS
    assert run.mode_at(100) is Mode.GUIDED
    assert run.mode_at(run.reached("at:A")) is Mode.SHARED
    assert run.mode_at(640) is Mode.SHARED
    assert run.failsafe_at(640) is Failsafe.HOLD
    assert 645 < switched_to_autonomy(run)[0] < 655
    assert 650 < run.reached("at:B") < run.reached("at:C") < 980
    assert run.mode_at(1190) is Mode.GUIDED


def test_the_operator_overrides_once_and_is_obeyed(mission: Callable[[str], Rehearsal]) -> None:
    run = mission("blackout").run()
    reviews = [review for t_s, review in run.entries(GROUND_REVIEW) if t_s < 600]
    overridden = [review for review in reviews if review.override]
    assert len(overridden) == 1
    assert overridden[0].override == "E" != overridden[0].action
    assert all(one.review.path for one in reviews), "a policy path comes with every proposal"


def test_it_reports_what_it_did_alone_when_the_link_is_back(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    learned = {entry.event.what: t_s for t_s, entry in run.entries(GROUND_EVENT) if t_s > 620}
    for token in ("at:B", "at:C"):
        assert 981 < learned[GoalReached((token,))] < 988
    assert [silence.silent for _, silence in run.entries(GROUND_SILENCE)] == [True, False]


def test_without_a_blackout_the_rover_never_acts_alone(mission: Callable[[str], Rehearsal]) -> None:
    run = mission("blackout").without_blackouts().run()
    assert switched_to_autonomy(run) == []
    assert run.reached("at:A")
    assert run.reached("at:B"), "under the operator's consent"
    assert run.reached("at:C") is None, "a mission goal is for when the link is lost"
    assert run.result.outcome is Outcome.FAILURE


@pytest.mark.parametrize("duration_s", [3, 8, 15, 25])
def test_a_short_blackout_makes_it_hold_at_most(
    mission: Callable[[str], Rehearsal], duration_s: int
) -> None:
    run = mission("blackout").blackout(620, duration_s).run()
    assert switched_to_autonomy(run) == []
    states = {entry.state for _, entry in run.entries(ROVER_FAILSAFE)}
    assert (Failsafe.HOLD in states) is (duration_s > 10)
    assert Failsafe.ALONE not in states
    assert run.reached("at:B"), "it goes on under consent afterwards"


def test_on_hold_nothing_new_begins(mission: Callable[[str], Rehearsal]) -> None:
    run = mission("blackout").blackout(620, 25).run()
    hold_s = next(t for t, e in run.entries(ROVER_FAILSAFE) if e.state is Failsafe.HOLD)
    assert moves(run, hold_s, 645) == []


def test_a_long_blackout_leaves_it_to_its_mission_goals_and_then_to_rest(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").blackout(620, 500).run()
    assert 645 < switched_to_autonomy(run)[0] < 655
    assert run.reached("at:C") < 1120
    assert moves(run, run.reached("at:C"), 1120) == [], "no goal, no action of its own"


def test_a_flapping_link_ends_in_action(mission: Callable[[str], Rehearsal]) -> None:
    """Twelve seconds dark, four seconds light, over and over: the countdown runs out in the end."""
    rehearsal = mission("blackout")
    for number in range(20):
        rehearsal = rehearsal.blackout(620 + 16 * number, 12)
    run = rehearsal.run()
    assert 655 < switched_to_autonomy(run)[0] < 670
    assert run.reached("at:B"), "though nobody could see it through"


def test_a_flapping_link_that_is_seldom_dark_never_switches_it(
    mission: Callable[[str], Rehearsal],
) -> None:
    rehearsal = mission("blackout")
    for number in range(40):
        rehearsal = rehearsal.blackout(620 + 12 * number, 6)
    run = rehearsal.run()
    assert switched_to_autonomy(run) == []
    assert {entry.state for _, entry in run.entries(ROVER_FAILSAFE)} == {Failsafe.NOMINAL}


def test_a_blackout_from_the_first_second_finds_it_without_a_map_and_so_it_stands(
    mission: Callable[[str], Rehearsal],
) -> None:
    """Nothing was ever taught: the rover knows no way to its mission goal, and says so later."""
    run = mission("blackout").blackout(0, 300).set("duration_s", 400).run()
    assert switched_to_autonomy(run)[0] == pytest.approx(31.3, abs=0.1)
    assert moves(run, 0, 300) == []
    told = [entry.event.what for _, entry in run.entries(GROUND_EVENT)]
    assert GoalAside(("at:C",), "unknown") in told


def test_it_looks_for_its_mission_goal_by_itself_if_the_mission_says_so(
    mission: Callable[[str], Rehearsal],
) -> None:
    rehearsal = mission("blackout").blackout(0, 300).set("duration_s", 400)
    run = rehearsal.set("rover.dem.exploration", "random").run()
    assert moves(run, 0, 31) == []
    alone = moves(run, 31, 300)
    assert alone
    assert {move.chooser for move in alone[:5]} == {"exploratory"}
    assert run.frames(delivered_between=(0, 300)) == ()


def test_deaf_but_not_mute_it_goes_on_alone_and_the_ground_watches(
    mission: Callable[[str], Rehearsal],
) -> None:
    """Only the uplink is out: the rover hears nothing, but the ground sees all that it does."""
    run = mission("blackout").blackout(620, 360, "up").run()
    assert 645 < switched_to_autonomy(run)[0] < 655
    assert run.frames(Direction.UP, delivered_between=(620, 980)) == ()
    assert len(run.frames(Direction.DOWN, delivered_between=(622, 980))) > 300
    learned = [t for t, e in run.entries(GROUND_EVENT) if e.event.what == GoalReached(("at:B",))]
    assert learned[0] < run.reached("at:B") + 4
    assert run.entries(GROUND_SILENCE) == ()


def test_mute_but_not_deaf_it_waits_for_a_word_that_cannot_come(
    mission: Callable[[str], Rehearsal],
) -> None:
    """Only the downlink is out: the rover stays under command, but the ground is blind.

    As it sees no proposal to consent to, nothing moves.
    """
    run = mission("blackout").blackout(620, 300, "down").run()
    assert switched_to_autonomy(run) == []
    assert {entry.state for _, entry in run.entries(ROVER_FAILSAFE)} == {Failsafe.NOMINAL}
    assert moves(run, 630, 915) == []
    assert run.frames(Direction.DOWN, delivered_between=(622, 921)) == ()
    assert len(run.frames(Direction.UP, delivered_between=(620, 920))) > 100
    assert [silence.silent for _, silence in run.entries(GROUND_SILENCE)] == [True, False]
    assert run.reached("at:B") > 920


def test_with_all_goals_reached_a_second_loss_only_makes_it_hold(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").blackout(620, 200).blackout(900, 200).run()
    assert run.mode_at(890) is Mode.GUIDED, "the operator took over in between"
    assert [
        entry.event.what.state
        for _, entry in run.entries(GROUND_EVENT)
        if isinstance(entry.event.what, FailsafeChanged)
    ].count(Failsafe.ALONE) == 1
    assert run.mode_at(1000) is Mode.GUIDED, "nothing is left to do alone"


def test_a_push_of_noise_on_the_link_delays_but_does_not_derail(
    mission: Callable[[str], Rehearsal],
) -> None:
    """With every fifth frame lost both ways, the first two stages take longer, not elsewhere."""
    lossy = {"link.up.loss": 0.2, "link.down.loss": 0.2}
    rehearsal = mission("blackout").set("duration_s", 1100).without_blackouts()
    for key, value in lossy.items():
        rehearsal = rehearsal.set(key, value)
    run = rehearsal.run()
    assert run.reached("at:A")
    assert len(run.frames(Direction.UP, Fate.LOST)) > 50
    numbers = [taken.number for _, taken in run.commands_taken]
    assert numbers == list(range(1, len(numbers) + 1)), "each command once, in order"


def test_a_scripted_blackout_replaces_the_missions_own(mission: Callable[[str], Rehearsal]) -> None:
    run = mission("blackout").blackout(700, 100).run()
    assert [(outage.direction, outage.start_s, outage.end_s) for outage in run.outages] == [
        ("up", 700, 800),
        ("down", 700, 800),
    ]


def test_a_rover_with_a_small_battery_charges_by_itself_when_alone(
    mission: Callable[[str], Rehearsal],
) -> None:
    """Alone and empty-handed, it sees to its battery, since nobody else can."""
    run = (
        mission("blackout")
        .set("rover.battery.capacity_j", 28_000.0)
        .set("rover.battery.low", 0.4)
        .blackout(520, 1500)
        .set("duration_s", 1400)
        .run()
    )
    charged = [goal for goal in run.goals if goal.tokens == ("on_charge",)]
    assert charged
    assert charged[0].reached_s
    low_s = charged[0].set_s
    battery = [(t, pose.battery) for t, pose in run.entries(TRUTH_POSE)]
    assert max(level for t, level in battery if t > charged[0].reached_s) > 0.85
    assert min(level for t, level in battery if t > low_s) > 0


def test_a_rehearsal_takes_its_folder_as_text_too(tmp_path: Path) -> None:
    run = Rehearsal("blackout", str(tmp_path)).set("duration_s", 1).set("expect", []).run()
    assert run.log.parent == tmp_path
