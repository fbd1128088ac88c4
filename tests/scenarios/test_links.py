"""The shipped mission over links that are worse than its own: nothing false is believed."""

from collections import Counter
from collections.abc import Callable
from itertools import pairwise

import pytest

from farside.control import Chooser
from farside.frames import Fate, FrameEvent, FrameStage
from farside.missions import FinishedRun, Outcome, Rehearsal
from farside.node import Direction, Topic
from farside.topics import (
    GROUND_FRAME,
    ROVER_ACTION_STARTED,
    ROVER_FRAME,
    TRUTH_POSE,
)

NOISY = {
    "loss": {"model": "gilbert-elliott", "p": 0.01, "r": 0.3},
    "jitter": {"spread_s": 0.2, "correlation": 0.5},
    "reorder": {"share": 0.02, "hold_s": 1.0},
    "duplicate": 0.05,
    "corrupt": 0.03,
    "bit_error_rate": 1e-5,
    "bit_errors": "flip",
    "overhead_byte": 6,
}

# The way to C's room leads through terrain shadow.
SHADOWED_MAP = """
#################
#A..##....##..B##
#...##..o.##...##
#...##....##...##
##.###.##.###.###
#...............#
###.#D##.####.###
#~~~~##...#....##
#C~~~##...#....##
#################
"""


def noisy(mission: Callable[[str], Rehearsal]) -> Rehearsal:
    # The tour takes longer over it.
    rehearsal = mission("blackout").set("ground.script.3.until_s", 680.0).blackout(700, 360)
    for way in ("up", "down"):
        for key, value in NOISY.items():
            rehearsal = rehearsal.set(f"link.{way}.{key}", value)
    return rehearsal


def events(run: FinishedRun, kind: Topic[FrameEvent], stage: FrameStage) -> list[FrameEvent]:
    return [entry for _, entry in run.entries(kind) if entry.stage is stage]


@pytest.mark.parametrize("seed", [1, 2])
def test_over_a_noisy_link_the_mission_succeeds_and_no_command_is_obeyed_twice(
    mission: Callable[[str], Rehearsal], seed: int
) -> None:
    run = noisy(mission).with_seed(seed).run()
    assert run.result.outcome is Outcome.SUCCESS
    assert [met.met for met in run.result.expectations] == [True] * len(run.result.expectations)
    refused = Counter(
        entry.what
        for kind in (ROVER_FRAME, GROUND_FRAME)
        for entry in events(run, kind, FrameStage.REFUSED)
    )
    assert refused["corrupted"] > 20
    assert refused["replayed"] > 20
    assert set(refused) == {"corrupted", "replayed"}
    ways = (run.link_counters(direction) for direction in Direction)
    assert sum(way.refused for way in ways) == refused.total()


def test_every_frame_has_one_life_from_end_to_end(mission: Callable[[str], Rehearsal]) -> None:
    run = noisy(mission).run()
    for direction, sender, receiver in (
        (Direction.UP, GROUND_FRAME, ROVER_FRAME),
        (Direction.DOWN, ROVER_FRAME, GROUND_FRAME),
    ):
        made = [e.sequence for e in events(run, sender, FrameStage.MADE)]
        assert made == [*range(len(made))]
        fates = [f for f in run.frames(direction) if not f.copy]
        ended = Counter(fate.sequence for fate in fates)
        assert set(ended.values()) == {1}
        on_the_way = set(made) - set(ended)
        assert len(on_the_way) < 20, "only the last ones of the run"
        arrived = Counter(f.sequence for f in run.frames(direction, Fate.DELIVERED))
        used = Counter(e.sequence for e in events(run, receiver, FrameStage.USED))
        refused = Counter(e.sequence for e in events(run, receiver, FrameStage.REFUSED))
        assert max(used.values()) == 1
        unread = arrived - (used + refused)
        assert not (used + refused) - arrived, "nobody reads what did not arrive"
        assert sum(unread.values()) < 5, "only what arrives with the last tick"


def test_what_happened_in_a_blackout_is_told_after_it_second_by_second(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    told = [(t_s, entry.time_ns / 1e9) for t_s, entry in run.telemetry]
    late = [time_s for t_s, time_s in told if t_s - time_s > 10]
    assert late[0] < 622
    assert late[-1] > 978
    gaps = [after - before for before, after in pairwise(late)]
    assert late == sorted(late), "the oldest first"
    assert max(gaps) < 8.1, "an action is told of when it ends"
    used = events(run, GROUND_FRAME, FrameStage.USED)
    assert sum(e.what.count("Telemetry") for e in used if e.stored) == len(late)


def test_stored_telemetry_goes_below_live_and_never_holds_it_up(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    live = [t for t, e in run.telemetry if t - e.time_ns / 1e9 < 10 and 985 < t < 1190]
    assert max(after - before for before, after in pairwise(live)) < 8.1
    assert run.link_counters(Direction.DOWN).queue_full == 0


@pytest.mark.parametrize(
    ("preset", "blackout_s", "end_s"),
    [
        ("moon", (100, 500), 900),
        ("earth-geo", (100, 500), 900),
        ("tether", (100, 500), 900),
        ("mars-direct", (1000, 1700), 6600),  # live telemetry alone would take 84 % of its rate
        ("mars-direct", (1000, 2700), 8400),  # and this is more than the store holds
    ],
)
def test_on_every_link_all_that_was_stored_arrives_or_is_told_to_be_given_up(
    mission: Callable[[str], Rehearsal],
    preset: str,
    blackout_s: tuple[float, float],
    end_s: float,
) -> None:
    start_s, stop_s = blackout_s
    rehearsal = mission("blackout").set("link", {"preset": preset}).set("expect", [])
    run = rehearsal.set("duration_s", end_s).blackout(start_s, stop_s - start_s).run()

    store = run.result.store
    assert store.kept >= stop_s - start_s
    assert store.waiting <= 3, "live telemetry that was lost within the last round trip"
    assert store.arrived + store.given_up + store.waiting == store.kept
    assert (store.given_up > 0) is (stop_s - start_s > 1200)
    assert events(run, GROUND_FRAME, FrameStage.REFUSED) == []
    told = {round(entry.time_ns / 1e9) for _, entry in run.telemetry}
    untold = set(range(int(start_s), int(stop_s))) - told
    # On the slow link telemetry is made every 1.05 s.
    assert len(untold) <= store.given_up + 0.06 * (stop_s - start_s)


def test_in_terrain_shadow_nothing_is_heard_and_the_rover_backs_out(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").without_blackouts().set("world.map", SHADOWED_MAP).run()
    lost = events(run, ROVER_FRAME, FrameStage.SHADOWED)
    assert {entry.direction for entry in lost} == {Direction.UP, Direction.DOWN}
    shadowed = [
        t_s
        for t_s, pose in run.entries(TRUTH_POSE)
        if pose.place in {"at:1,2", "at:2,2", "at:3,2", "at:4,2"}
    ]
    assert shadowed
    returned = [
        t_s for t_s, e in run.entries(ROVER_ACTION_STARTED) if e.chooser is Chooser.RETURNING
    ]
    assert shadowed[0] + 27 < returned[0] < shadowed[0] + 40, "when the link counts as lost"
    sent = {f.sequence for f in run.frames(Direction.DOWN)}
    assert not sent & {e.sequence for e in lost if e.direction is Direction.DOWN}
    assert sum(run.link_counters(direction).shadowed for direction in Direction) == len(lost)


def test_a_link_over_a_preset_keeps_what_the_mission_says(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").set("link.preset", "moon").run()
    assert run.result.outcome is Outcome.SUCCESS
    first = next(f for f in run.frames(Direction.DOWN, Fate.DELIVERED))
    assert first.arrival_ns - first.sent_end_ns == 1_280_000_000


def test_a_long_way_is_as_sure_as_a_short_one(mission: Callable[[str], Rehearsal]) -> None:
    """Mars at its nearest: three minutes one way; the operator's tour takes its time."""
    run = (
        mission("blackout")
        .without_blackouts()
        .set("link.up.delay_s", 180.0)
        .set("link.down.delay_s", 180.0)
        .set("ground.command_lifetime_s", 4000.0)
        .set("rover.failsafe.hold_after_s", 600.0)
        .set("rover.failsafe.lost_after_s", 900.0)
        .set("duration_s", 4000.0)
        .set("expect", [{"what": "obedience"}, {"what": "no-crossing"}])
        .run()
    )
    assert run.result.outcome is Outcome.SUCCESS
    taken = [taken.number for _, taken in run.commands_taken]
    assert taken == [*range(1, len(taken) + 1)]
    assert len(taken) >= 5
