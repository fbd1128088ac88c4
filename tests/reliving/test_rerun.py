"""A run once more, otherwise: from the start, or from a moment on; its log is a seed again."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from short_life import QUEUED, SHORT, Failing, forged

from farside.control import Mode, ModeCause
from farside.logs import LogFile
from farside.missions import (
    FinishedRun,
    MissionError,
    Rehearsal,
    load_mission,
    run_mission,
)
from farside.missions.reliving.past import RelivingError, read_past
from farside.missions.reliving.rerunning import rerun
from farside.missions.reliving.verifying import verify
from farside.node import Direction, Record, to_ns
from farside.topics import (
    GROUND_ORDER,
    GROUND_SHADOW,
    LINK_OUTAGE,
    ROVER_COMMAND,
    GoalSource,
)

NO_BLACKOUT: dict[str, object] = {"link.blackouts": []}
CHANGES: list[dict[str, object]] = [
    NO_BLACKOUT,
    {"link.blackouts": [{"start_s": 15.0, "end_s": 30.0, "direction": "up"}]},
    {"link.up.loss": 0.5, "link.down.jitter": {"spread_s": 0.2}},
    {"link.down.delay_s": 0.3, "link.up.delay_s": 3.0},
    {"link.changes": [{"at_s": 25.0, "loss": 0.3}]},
    {"rover.failsafe": {"hold_after_s": 2.0, "lost_after_s": 4.0, "on_loss": "hold"}},
    {"rover.goals": [{"place": "A"}, {"place": "C", "priority": 3.0}]},
    {"rover.dem.alpha": 0.1, "rover.dem.exploration": "curious"},
    {"rover.consent.by": "veto", "rover.battery.capacity_j": 20_000.0},
    {"rover.faults": [{"what": "tilt", "start_s": 20.0, "end_s": 35.0}]},
    {"ground.operator": "absent"},
    {"ground.rules": [{"rule": "probability", "above": 0.9}], "ground.silent_after_s": 3.0},
    {"duration_s": 80.0, "expect": []},
]


def before(run: FinishedRun, t_s: float) -> list[Record]:
    return [r for r in LogFile(run.log).records() if r.log_time_ns < to_ns(t_s)]


@settings(max_examples=3)
@given(st.floats(0, 74), st.sampled_from(CHANGES))
def test_from_a_moment_on_all_before_is_as_it_was(
    flown: FinishedRun, runs: Path, t_s: float, changes: dict[str, object]
) -> None:
    """Byte for byte; and what comes of it can be lived again itself."""
    run = rerun(flown.log, changes, from_s=t_s, out=runs)

    assert before(run, t_s) == before(flown, t_s)
    assert verify(run.log).equal
    assert not run.lost_processes


@settings(max_examples=2)
@given(st.floats(0, 74))
def test_without_a_change_it_is_the_same_run(flown: FinishedRun, runs: Path, t_s: float) -> None:
    assert rerun(flown.log, from_s=t_s, out=runs).digest == flown.digest


def test_from_the_start_it_is_the_mission_with_these_values(
    flown: FinishedRun, tmp_path: Path
) -> None:
    again = rerun(flown.log, ["link.blackouts=[]", "link.up.loss=0.2"], seed=9, out=tmp_path)

    loaded = load_mission("blackout", {**SHORT, **NO_BLACKOUT, "link.up.loss": 0.2}, seed=9)
    assert again.digest == run_mission(loaded, in_process=True, out=tmp_path).digest
    assert read_past(again.log).mission == loaded.mission


def test_what_changes_acts_from_then_on(flown: FinishedRun, tmp_path: Path) -> None:
    """The blackout ends at 50 s: the rover, alone since then, is heard again."""
    run = rerun(flown.log, NO_BLACKOUT, from_s=50.0, out=tmp_path)

    outages = [(t_s, entry.down) for t_s, entry in run.entries(LINK_OUTAGE)]
    assert outages == [(42.0, True), (42.0, True), (50.0, False), (50.0, False)]
    lost = [frame.sent_ns for frame in run.frames(Direction.DOWN, "outage")]
    assert max(lost) <= to_ns(50) < max(f.sent_ns for f in flown.frames("down", "outage"))


def test_a_failsafe_that_is_faster_from_then_on(flown: FinishedRun, tmp_path: Path) -> None:
    alone = [mode.t_s for mode in flown.modes if mode.why is ModeCause.LINK_LOST]
    faster = {"rover.failsafe.hold_after_s": 5.0, "rover.failsafe.lost_after_s": 7.0}

    run = rerun(flown.log, faster, from_s=30.0, out=tmp_path)

    sooner = [mode.t_s for mode in run.modes if mode.why is ModeCause.LINK_LOST]
    assert alone[0] - sooner[0] == pytest.approx(8.0, abs=1.5)


def test_other_mission_goals_from_then_on(flown: FinishedRun, tmp_path: Path) -> None:
    run = rerun(flown.log, {"rover.goals": [{"place": "A"}]}, from_s=59.0, out=tmp_path)

    own = [goal for goal in run.goals if goal.source is GoalSource.MISSION]
    assert [(goal.tokens, goal.set_s < 59.0) for goal in own] == [
        (("at:C",), True),
        (("at:A",), False),
    ]
    assert own[0].withdrawn_s == 59.0
    assert before(run, 59.0) == before(flown, 59.0)


def test_the_shadow_at_the_ground_follows_a_model_that_learns_otherwise(
    flown: FinishedRun, tmp_path: Path
) -> None:
    run = rerun(flown.log, {"rover.dem.alpha": 0.2, **NO_BLACKOUT}, from_s=15.0, out=tmp_path)

    entries = run.entries(GROUND_SHADOW)
    assert entries[-1][0] > 15.0
    assert all(entry.in_step for _, entry in entries)
    assert run.dem != flown.dem


def test_a_script_goes_on_with_other_steps(flown: FinishedRun, tmp_path: Path) -> None:
    """Its tour is under way, so what comes behind it can change."""
    script = [SHORT["ground.script"][0], {"do": "mode", "mode": "autonomous"}]

    run = rerun(flown.log, {"ground.script": script, **NO_BLACKOUT}, from_s=5.0, out=tmp_path)

    assert run.modes[-1].mode is Mode.AUTONOMOUS
    assert run.operator is not None
    assert (run.operator.step, run.operator.of) == (2, 2)
    taken = [entry.number for _, entry in run.entries(ROVER_COMMAND)]
    assert taken == sorted(taken)


def test_orders_of_a_person_are_given_again(ordered: FinishedRun, tmp_path: Path) -> None:
    lossy = rerun(ordered.log, {"link.up.loss": 0.3}, out=tmp_path)
    later = rerun(ordered.log, {"link.up.loss": 0.3}, from_s=18.0, out=tmp_path)

    assert lossy.entries(GROUND_ORDER) == ordered.entries(GROUND_ORDER)
    assert later.entries(GROUND_ORDER) == ordered.entries(GROUND_ORDER)
    assert verify(lossy.log).equal
    assert verify(later.log).equal


def test_a_person_is_relieved(ordered: FinishedRun, tmp_path: Path) -> None:
    run = rerun(ordered.log, {"ground.operator": "absent"}, from_s=20.0, out=tmp_path)

    orders = ordered.entries(GROUND_ORDER)
    assert run.entries(GROUND_ORDER) == tuple(order for order in orders if order[0] < 20.0)
    assert verify(run.log).equal


def test_recorded_orders_go_on_being_given(ordered: FinishedRun, tmp_path: Path) -> None:
    recorded = {**QUEUED, "ground.operator": "recorded", "ground.recorded.log": str(ordered.log)}
    first = run_mission(load_mission("blackout", recorded), in_process=True, out=tmp_path)

    run = rerun(first.log, {"rover.consent.by": "veto"}, from_s=20.0, out=tmp_path)

    assert run.entries(GROUND_ORDER) == ordered.entries(GROUND_ORDER)
    assert verify(run.log).equal


def test_recorded_orders_that_a_change_took_are_in_the_log(
    ordered: FinishedRun, tmp_path: Path
) -> None:
    """The log that they were from is gone."""
    named = tmp_path / "orders.mcap"
    named.write_bytes(ordered.log.read_bytes())
    taken = {"ground.operator": "recorded", "ground.recorded.log": str(named)}
    first = rerun(ordered.log, taken, from_s=20.0, out=tmp_path)
    named.unlink()

    run = rerun(first.log, {"rover.consent.by": "veto"}, from_s=10.0, out=tmp_path)

    assert run.entries(GROUND_ORDER) == ordered.entries(GROUND_ORDER)
    assert verify(run.log).equal
    assert read_past(run.log).changes[-1].overrides == read_past(first.log).changes[0].overrides


def test_recorded_orders_that_are_named_now_are_given_and_not_those_of_then(
    ordered: FinishedRun, tmp_path: Path
) -> None:
    """Although the operator that gives them took over in the run of then."""
    named = {**QUEUED, "ground.recorded.log": str(ordered.log)}
    first = run_mission(load_mission("blackout", named), in_process=True, out=tmp_path)
    second = rerun(first.log, {"ground.operator": "recorded"}, from_s=20.0, out=tmp_path)

    run = rerun(second.log, {"ground.recorded.log": str(first.log)}, out=tmp_path)

    orders = [order for order in ordered.entries(GROUND_ORDER) if order[0] >= 20.0]
    assert list(second.entries(GROUND_ORDER)) == orders != []
    assert run.entries(GROUND_ORDER) == ()


def test_a_rerun_of_a_rerun(flown: FinishedRun, tmp_path: Path) -> None:
    """Before 30 s as at first, before 50 s as the second time, whatever is changed when."""
    second = rerun(flown.log, {"link.down.loss": 0.4}, from_s=30.0, out=tmp_path)
    third = rerun(second.log, NO_BLACKOUT, from_s=50.0, out=tmp_path)
    earlier = rerun(second.log, {"rover.goals": []}, from_s=20.0, out=tmp_path)

    assert before(third, 30.0) == before(flown, 30.0)
    assert before(third, 50.0) == before(second, 50.0)
    assert before(earlier, 20.0) == before(flown, 20.0)
    assert [change.at_ns for change in read_past(earlier.log).changes] == [to_ns(20), to_ns(30)]
    last = read_past(earlier.log).changes[-1].mission
    assert (last.rover.goals, last.link.down.loss) == ((), 0.4)
    for run in (second, third, earlier):
        assert verify(run.log).equal


def test_a_new_log_says_where_it_is_from(flown: FinishedRun, tmp_path: Path) -> None:
    run = rerun(flown.log, NO_BLACKOUT, from_s=49.99, out=tmp_path)

    assert LogFile(run.log).metadata["farside.rerun"] == {
        "log": flown.log.name,
        "digest": flown.digest,
        "from_s": "50",
    }


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"world.cell_m": 1.1}, "world.cell_m: expected no change during the run: the rover has"),
        ({"link.mtu_byte": 512}, "link.mtu_byte: .*: both ends agreed on it"),
        ({"seed": 3}, "seed: .*: numbers have been drawn from it since the start"),
        ({"rover.dem.reach": 2}, "rover.dem.reach: .*: what was learned until then"),
        ({"rover.battery.initial": 0.5}, "rover.battery.initial: .*: it acts at the start only"),
        ({"ground.heartbeat_s": 1.0}, "ground.heartbeat_s: .*without --from it can change"),
        ({"duration_s": 20.0}, "duration_s: expected more than the 40 s from which"),
    ],
)
def test_what_cannot_change_during_a_run_is_refused_with_the_reason(
    flown: FinishedRun, tmp_path: Path, changes: dict[str, object], why: str
) -> None:
    with pytest.raises(RelivingError, match=why):
        rerun(flown.log, changes, from_s=40.0, out=tmp_path)
    assert not list(tmp_path.iterdir())


def test_what_does_not_come_out_again_gets_no_other_course(
    flown: FinishedRun, tmp_path: Path
) -> None:
    """The forged record is after 25 s, so up to then another course is open."""
    records = list(LogFile(flown.log).records())
    number = next(n for n, record in enumerate(records) if record.log_time_ns > to_ns(25))
    records[number] = msgspec.structs.replace(records[number], payload=b"{}")
    log = forged(flown.log, tmp_path / "forged.mcap", records)

    with pytest.raises(RelivingError, match=r"up to 30 s, found another record at 25\.\d+ s in /"):
        rerun(log, NO_BLACKOUT, from_s=30.0, out=tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert rerun(log, NO_BLACKOUT, from_s=25.0, out=tmp_path / "new").goals


def test_what_no_mission_can_be_is_refused_as_ever(flown: FinishedRun, tmp_path: Path) -> None:
    with pytest.raises(MissionError, match=r"link\.up\.loss: expected .*, found 7"):
        rerun(flown.log, {"link.up.loss": 7}, from_s=40.0, out=tmp_path)
    with pytest.raises(MissionError, match="expected KEY=VALUE"):
        rerun(flown.log, ["nothing"], out=tmp_path)


def test_before_the_loss_of_a_process_another_course_is_open(tmp_path: Path) -> None:
    values = {"duration_s": 30.0, "expect": [], "ground.script": []}
    run = Rehearsal("blackout", tmp_path, values).operator(Failing).run()
    absent = {"ground.operator": "absent"}

    saved = rerun(run.log, absent, from_s=15.0, out=tmp_path, operator=Failing)

    assert not saved.lost_processes
    with pytest.raises(RelivingError, match="its ground failed at"):
        rerun(run.log, absent, from_s=25.0, out=tmp_path, operator=Failing)


MISSION = """
name = "planned"
duration_s = 30.0
world = { map = "#######\\n#A...B#\\n#######" }
rover = { start = "A" }
ground = { operator = "guide" }

[link]
up = { loss = 0.1 }
contacts = { file = "plan.ionrc", ground = 1, rover = 2 }
"""
PLAN = """
a contact +0 +60 1 2 10000
a contact +5 +20 2 1 10000
a range +0 +60 1 2 1
"""


def test_a_log_carries_the_files_that_its_mission_names(tmp_path: Path) -> None:
    """Elsewhere, without them, it is verified, and run again with other values."""
    source, plan = tmp_path / "planned.toml", tmp_path / "plan.ionrc"
    source.write_text(MISSION)
    plan.write_text(PLAN)
    run = run_mission(load_mission(source), in_process=True, out=tmp_path)
    plan.unlink()
    source.unlink()

    assert verify(run.log).equal
    again = rerun(run.log, {"link.up.loss": 0.2}, out=tmp_path)
    assert again.digest != run.digest
    assert rerun(again.log, {"link.up.loss": 0.1}, out=tmp_path).digest == run.digest
    later = rerun(run.log, {"link.up.loss": 0.2}, from_s=10.0, out=tmp_path)
    assert verify(later.log).equal


def test_a_log_carries_the_files_that_its_changes_name(
    ordered: FinishedRun, tmp_path: Path
) -> None:
    trace = tmp_path / "up.trace"
    trace.write_text("".join(f"{t_ms}\n" for t_ms in range(50, 5000, 50)))
    traced = {"link.up": {"delay_s": 0.3, "rate_trace": {"file": str(trace)}}}
    first = rerun(ordered.log, traced, from_s=20.0, out=tmp_path)
    trace.unlink()

    run = rerun(first.log, {"link.down.loss": 0.3}, from_s=30.0, out=tmp_path)

    assert before(run, 30.0) == before(first, 30.0) != before(ordered, 30.0)
