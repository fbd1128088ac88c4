"""Whoever is at the ground: the same orders give the same run, and a guide teaches everything."""

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from short_life import SHORT as LIFE

from farside.control import Chooser, Mode
from farside.messages import Drive, SetGoal, SetMode
from farside.missions import (
    FinishedRun,
    MissionError,
    Rehearsal,
    TimedOrders,
    load_mission,
    run_mission,
)
from farside.missions.advice import warnings
from farside.missions.orders import recorded as reading
from farside.missions.schema import MissionFile
from farside.node import to_ns
from farside.places import is_place_token
from farside.topics import (
    GROUND_FRAME,
    GROUND_OPERATOR,
    GROUND_ORDER,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_CYCLE,
    ActionEnded,
    ActionStarted,
    Cycle,
)

ORDERS = (
    (5.0, Drive("N")),
    (5.0, Drive("N")),
    (9.0, Drive("E")),
    (14.0, SetMode(Mode.AUTONOMOUS)),
    (14.0, SetGoal(("at:D",), float("nan"))),
    (14.0, SetGoal(("at:D",), 2.0)),
)


def again(run: FinishedRun, changes: Mapping[str, object] = {}) -> dict[str, object]:
    """The values that have the orders of a run given once more."""
    return {
        **changes,
        "ground.operator": "recorded",
        "ground.script": [],
        "ground.recorded.log": str(run.log),
    }


# --- recorded and queued --------------------------------------------------------------------------


def test_the_orders_of_a_log_give_the_same_run(blackout: FinishedRun, tmp_path: Path) -> None:
    loaded = load_mission("blackout", again(blackout))
    assert run_mission(loaded, in_process=True, out=tmp_path).digest == blackout.digest


@pytest.mark.parametrize(
    "how",
    [
        {"in_process": True, "window_ns": to_ns(0.2)},
        pytest.param({}, marks=pytest.mark.processes),
    ],
    ids=["short windows", "processes"],
)
def test_they_do_so_however_it_is_run(tmp_path: Path, how: dict[str, object]) -> None:
    first = run_mission(load_mission("blackout", LIFE), in_process=True, out=tmp_path)
    loaded = load_mission("blackout", again(first, LIFE))
    assert run_mission(loaded, out=tmp_path, **how).digest == first.digest  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "how",
    [
        {"in_process": True},
        {"in_process": True, "window_ns": to_ns(0.2)},
        pytest.param({}, marks=pytest.mark.processes),
    ],
    ids=["one process", "short windows", "processes"],
)
def test_orders_from_outside_are_in_the_log_and_give_the_same_run_again(
    tmp_path: Path, how: dict[str, object]
) -> None:
    """Also in processes, where the launcher has them; the second run needs nobody outside."""
    short = {"duration_s": 60.0, "link.blackouts": [], "expect": []}
    queued = load_mission("blackout", {**short, "ground.operator": "queued", "ground.script": []})
    first = run_mission(queued, out=tmp_path, watcher=TimedOrders(ORDERS), **how)  # type: ignore[arg-type]
    given = [entry.act for _, entry in first.entries(GROUND_ORDER)]
    assert given == [*(act for _, act in ORDERS[:4]), SetGoal(("at:D",), None), ORDERS[5][1]]
    times_s = [t_s for t_s, _ in first.entries(GROUND_ORDER)]
    assert all(t_s >= due_s for t_s, (due_s, _) in zip(times_s, ORDERS, strict=True))
    loaded = load_mission("blackout", again(first, short))
    assert run_mission(loaded, in_process=True, out=tmp_path).digest == first.digest


def test_orders_are_given_on_the_first_tick_of_a_window(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").set("duration_s", 20.0).set("expect", []).order(5.0, Drive("N")).run()
    window_ns = load_mission("blackout").mission.window_ns
    [(t_s, _)] = run.entries(GROUND_ORDER)
    assert to_ns(t_s) % window_ns == 0
    assert 5.0 <= t_s < 5.0 + window_ns / 1e9
    assert [action.action for _, action in run.entries(ROVER_ACTION_STARTED)] == ["N"]


@pytest.mark.parametrize("operator", ["scripted", "absent", "guide"])
def test_nobody_else_takes_orders_from_outside(
    mission: Callable[[str], Rehearsal], operator: str
) -> None:
    rehearsal = mission("blackout").order(5.0, Drive("N"))
    with pytest.raises(ValueError, match=f'ground.operator is "{operator}"'):
        rehearsal.operator(operator).run()


def test_the_log_of_a_killed_run_has_its_orders_up_to_then(
    blackout: FinishedRun, tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(blackout.log.read_bytes()[: blackout.log.stat().st_size // 2])
    loaded = load_mission("blackout", {**again(blackout), "ground.recorded.log": str(cut)})
    orders = loaded.mission.ground.recorded.orders or ()
    assert 0 < len(orders) < len(blackout.entries(GROUND_ORDER))


def test_what_is_no_log_of_orders_is_refused(
    blackout: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path) -> str:
        with pytest.raises(MissionError, match=r"ground\.recorded\.log: ") as error:
            load_mission("blackout", {**again(blackout), "ground.recorded.log": str(path)})
        return str(error.value)

    other = tmp_path / "other.mcap"
    other.write_text("no log")
    assert "is not a log" in refused(other)
    assert "cannot be read: Is a directory" in refused(tmp_path)
    whole = bytearray(blackout.log.read_bytes())
    whole[len(whole) // 3] ^= 0xFF
    other.write_bytes(whole)
    assert "damaged" in refused(other)
    monkeypatch.setattr(reading, "MAX_ORDERS", 5)
    assert "expected at most 5 messages of /ground/order, found more" in refused(blackout.log)
    monkeypatch.setattr(GROUND_ORDER, "name", "/ground/elsewhere")
    assert "found none" in refused(blackout.log)


def test_each_operator_of_the_documents_can_be_checked_as_it_stands_there(tmp_path: Path) -> None:
    short = {"duration_s": 1.0, "link.blackouts": [], "expect": []}
    log = run_mission(load_mission("blackout", short), in_process=True, out=tmp_path).log
    page = Path(__file__).parents[2] / "docs" / "control.md"
    blocks = re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
    tables = [tomllib.loads(block)["ground"] for block in blocks]
    assert {table.get("operator", "scripted") for table in tables} == {
        *("scripted", "guide", "supervisor", "recorded")
    }
    for table in tables:
        if "recorded" in table:
            table["recorded"]["log"] = str(log)
        ground = {f"ground.{key}": value for key, value in table.items()}
        mission = load_mission("blackout", {"ground.script": [], "expect": [], **ground}).mission
        assert list(warnings(mission)) == []


def test_the_rules_of_the_documents_can_be_used_as_they_stand_there() -> None:
    page = Path(__file__).parents[2] / "docs" / "ground.md"
    (block,) = re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
    rules = tomllib.loads(block)["ground"]["rules"]
    mission = load_mission("blackout", {"ground.rules": rules}).mission
    assert len(mission.ground.rules) == 4
    assert list(warnings(mission)) == []


def test_with_nobody_at_the_ground_its_heartbeats_go_on(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").operator("absent").without_blackouts().set("expect", []).run()
    assert run.entries(GROUND_ORDER) == ()
    assert run.entries(ROVER_ACTION_STARTED) == ()
    assert len(run.entries(GROUND_FRAME)) > 600
    assert {mode.mode for mode in run.modes} == {Mode.GUIDED}


# --- guide ----------------------------------------------------------------------------------------


def untaught(run: FinishedRun, mission: MissionFile, times: int = 1) -> list[tuple[str, str]]:
    """The moves from place to place that the rover did not make so often, by its own records."""
    chart, here, begun = mission.world.chart(), "", ("", "")
    made: dict[tuple[str, str], int] = {}
    for _, entry in run.together(ROVER_CYCLE, ROVER_ACTION_STARTED, ROVER_ACTION_ENDED):
        match entry:
            case Cycle(tokens=tokens):
                here = next(filter(is_place_token, tokens), "")
            case ActionStarted(action=action):
                begun = (here, action)
            case ActionEnded(blocked=False):
                made[begun] = made.get(begun, 0) + 1
    every = [
        (chart.tokens[cell], action)
        for cell in sorted(chart.reachable(chart.places[mission.rover.start]) - chart.shadow)
        for action, beside in chart.neighbours(cell)
        if beside not in chart.shadow
    ]
    return [move for move in every if made.get(move, 0) < times]


SMALL = {"world.map": "########\n#A.#..B#\n#......#\n#D.#..C#\n########"}


def delayed(delay_s: float, duration_s: float) -> dict[str, object]:
    return {
        "link.up.delay_s": delay_s,
        "link.down.delay_s": delay_s,
        "duration_s": duration_s,
        "link.blackouts": [],
    }


@pytest.mark.parametrize(
    ("changes", "most"),
    [
        (delayed(0.1, 700.0), 1.0),
        ({**delayed(20.0, 500.0), **SMALL}, 1.0),
        ({**delayed(1.28, 350.0), **SMALL, "ground.guide.ahead": 1}, 1.0),
        ({**delayed(1.28, 400.0), **SMALL, "ground.guide.times": 2}, 1.0),
        ({**delayed(1.28, 300.0), **SMALL, "link.up.loss": 0.3, "link.down.loss": 0.3}, 1.05),
        ({"link.blackouts": [{"start_s": 100.0, "end_s": 180.0}], "duration_s": 1000.0}, 1.1),
        (
            {
                "rover.faults": [
                    {"what": "position-sensor", "start_s": 100.0, "end_s": 200.0},
                    {"what": "tilt", "start_s": 300.0, "end_s": 400.0},
                ],
                "link.blackouts": [],
            },
            1.2,
        ),
        ({"rover.body.slip_mean": 0.3, "rover.body.slip_sd": 0.4, "duration_s": 1500.0}, 1.6),
    ],
    ids=["near", "far", "move and wait", "twice", "loss", "blackout", "faults", "slip"],
)
def test_the_guide_teaches_every_move_in_few(
    tmp_path: Path, changes: dict[str, object], most: float
) -> None:
    guided = {"ground.operator": "guide", "ground.script": [], "expect": [], **changes}
    loaded = load_mission("blackout", guided)
    times = loaded.mission.ground.guide.times
    run = run_mission(loaded, in_process=True, out=tmp_path)
    assert run.entries(GROUND_OPERATOR)[-1][1].waiting_for is None, "the tour came to its end"
    assert run.entries(GROUND_OPERATOR)[-1][1].left == ()
    assert untaught(run, loaded.mission, times) == []
    chart = loaded.mission.world.chart()
    every = sum(1 for cell in chart.tokens for _ in chart.neighbours(cell))
    assert every == (42 if SMALL.items() <= changes.items() else 186)
    moves = [e for _, e in run.entries(ROVER_ACTION_STARTED) if e.chooser is Chooser.GUIDED]
    assert len(moves) <= most * times * every


def test_the_guide_keeps_the_battery_and_goes_on_after_charging(tmp_path: Path) -> None:
    guided = {
        "ground.operator": "guide",
        "ground.script": [],
        "expect": [],
        "link.blackouts": [],
        "rover.battery.capacity_j": 20_000.0,
    }
    loaded = load_mission("blackout", guided)
    run = run_mission(loaded, in_process=True, out=tmp_path)
    done_s = run.entries(GROUND_OPERATOR)[-1][0]
    assert untaught(run, loaded.mission) == []
    assert {entry.state for t_s, entry in run.entries(ROVER_BATTERY) if t_s < done_s} >= {
        "charging"
    }
    assert "flat" not in {entry.state for t_s, entry in run.entries(ROVER_BATTERY) if t_s < done_s}


def test_into_terrain_shadow_the_guide_does_not_go(tmp_path: Path) -> None:
    guided = {"ground.operator": "guide", "ground.script": [], "expect": []}
    loaded = load_mission("shadow", guided)
    run = run_mission(loaded, in_process=True, out=tmp_path)
    assert untaught(run, loaded.mission) == []
    chart = loaded.mission.world.chart()
    seen = {token for _, cycle in run.entries(ROVER_CYCLE) for token in cycle.tokens}
    assert not seen & {chart.tokens[cell] for cell in chart.shadow}


# --- supervisor -----------------------------------------------------------------------------------

TAUGHT: list[dict[str, object]] = [{"do": "teach"}]


@pytest.mark.parametrize("mode", ["shared", "autonomous"])
def test_a_supervisor_has_goals_reached_in_a_yard_that_was_taught(
    mission: Callable[[str], Rehearsal], mode: str
) -> None:
    goals = [{"place": place} for place in "ABC"]
    script = [*TAUGHT, {"do": "supervise", "mode": mode, "goals": goals}]
    rules = [{"rule": "cost", "below": 200.0}, {"rule": "age", "below_s": 60.0}]
    rehearsal = mission("blackout").without_blackouts().set("ground.script", script)
    run = rehearsal.set("ground.rules", rules).set("expect", []).run()
    assert all(goal.reached_s for goal in run.goals if goal.tokens[0] in {"at:A", "at:B", "at:C"})
    assert {goal.tokens[0] for goal in run.goals} >= {"at:A", "at:B", "at:C"}
    assert run.entries(GROUND_OPERATOR)[-1][1].left == ()


@pytest.mark.parametrize("mode", ["shared", "autonomous"])
def test_what_breaks_the_rules_is_not_reached_and_said(
    mission: Callable[[str], Rehearsal], mode: str
) -> None:
    """The way to A leads by a place that is to be avoided; those to B and C do not."""
    goals = [{"place": place} for place in "ABC"]
    script = [*TAUGHT, {"do": "supervise", "mode": mode, "goals": goals}]
    rules = [{"rule": "avoids", "places": ["2,5"]}]
    rehearsal = mission("blackout").without_blackouts().set("ground.script", script)
    run = rehearsal.set("ground.rules", rules).set("expect", []).run()
    reached = {goal.tokens[0] for goal in run.goals if goal.reached_s}
    assert reached >= {"at:B", "at:C"}
    assert "at:A" not in reached
    [left] = run.entries(GROUND_OPERATOR)[-1][1].left
    assert left.startswith("goal A: ")
    assert "2,5" in left
