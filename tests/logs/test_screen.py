"""The whole screen, at usual terminal sizes."""

import io
import math
from typing import Any

import pytest
from any_message import YARDS, messages
from hypothesis import example, given, settings
from hypothesis import strategies as st
from noting import command_sent, failsafe_entry, logged, said_of
from rich.cells import cell_len
from rich.console import Console

from farside.control import Chooser, CommandStage, Failsafe, Mode, ModeCause, Verdict
from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import LogEntry, Picture, screen
from farside.messages import Drive, Proposal, ProposedStep, SetGoal
from farside.node import Direction, to_ns
from farside.places import Chart
from farside.topics import (
    ActionStarted,
    BeliefEntry,
    BeliefItem,
    Cycle,
    HeldEntry,
    HeldFate,
    Likely,
    ModeEntry,
    Pose,
    Prediction,
    ShadowEntry,
    Silence,
    Yard,
)


def shown(run: Any, now_s: float, *, width: int = 80, height: int = 24, **options: Any) -> str:
    """The screen of a run at a time, as plain text without trailing spaces."""
    picture = Picture()
    for record in run.records:
        picture.apply(LogEntry.of(record))
    page = io.StringIO()
    console = Console(file=page, width=width, height=height, color_system=None)
    console.print(screen(picture, to_ns(now_s), width=width, height=height, **options))
    lines = page.getvalue().splitlines()
    return "\n".join(line.rstrip() for line in lines)


def map_of(text: str) -> list[str]:
    """The rows inside the map panel."""
    return [line.split("│")[1].strip() for line in text.splitlines()[2:7]]


@pytest.fixture
def lost(run: Any) -> Any:
    """A rover alone at D, on its way from C to B, while the ground last heard of it at C."""
    run.start("at:C").frame(1, Direction.DOWN).hear(2, "at:C", since_s=0.75).goal(3, "at:B")
    for direction in Direction:
        run.note(4, LinkOutage(direction, down=True, reason=OutageReason.BLACKOUT))
    run.frame(5, Direction.UP, Fate.OUTAGE).frame(5, Direction.DOWN, Fate.OUTAGE)
    run.note(15, failsafe_entry(Failsafe.HOLD, 10.0), Silence(silent=True))
    run.note(
        35, failsafe_entry(Failsafe.ALONE, 30.0), ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)
    )
    path = (
        ProposedStep(("at:D",), "N", 8.0),
        ProposedStep(("at:5,2",), "N", 4.0),
        ProposedStep(("at:B",), "N", 0.0),
    )
    run.note(36, Cycle(("at:D",), (), (), 2, 1, 0, 74, 212, 0.625))
    run.note(36, Proposal(9, 0, ("at:B",), "N", path))
    run.note(36, ActionStarted("N", Chooser.GOAL_DIRECTED, None, ("at:B",)))
    goal, moves = SetGoal(("at:B",), 1.0), {CommandStage.BEGUN: 5.0, CommandStage.DONE: 9.0}
    run.note(2.0, command_sent(1, goal, due_s={CommandStage.DONE: 3.25}))
    run.note(3.0, said_of(1, CommandStage.DONE, Verdict.ON_TIME, due_s=4.25, so_s=3.0))
    run.note(3.5, command_sent(2, Drive("E"), due_s=moves))
    run.note(14, said_of(2, CommandStage.BEGUN, Verdict.OVERDUE, due_s=6.0))
    run.note(36, ShadowEntry(4, 1, in_step=True, why=None, signs=74, hypotheses=212, cycles=1))
    run.note(37, Prediction(to_ns(37), 0, (Likely(("at:5,2",), 0.58),), 0.42))
    return run.stand(33, "at:3,1").stand(34, "at:4,1").stand(37, "at:D")


AT_80_BY_24 = """\
  37.5 s   AUTONOMOUS    ALONE                                     blackout.mcap
╭─ yard ─────────────────────────╮╭─ rover ────────────────────────────────────╮
│ ██████████████                 ││ at       at:D, 0.00 m/s                    │
│ ██A   ██  B ██                 ││ battery  ████████████░░░░ 75%              │
│ ██    ▒▒  ◌ ██                 ││ action   N, goal-directed, to at:B         │
│ ██◇   · · ↑ ██                 ││ goals    at:B (1)                          │
│ ██████████████                 ││ proposal 9: N, to at:B, 3 steps            │
│                                ││ DEM      74 Signs, 212 hyp., C_m 0.62      │
│                                │╰────────────────────────────────────────────╯
│                                │╭─ link and ground ──────────────────────────╮
│                                ││ ↑ up   outage  0 delivered 1 lost          │
│                                ││ ↓ down outage  1 delivered 1 lost          │
│                                ││ ground silence at:C, 36.8 s old            │
│                                ││ shadow in step now at 5,2 (58%)            │
╰─ ◇ heard  ◌ by now  • proposed─╯╰────────────────────────────────────────────╯
╭─ commands, 1 on the way, 1 overdue ──────────────────────────────────────────╮
│ 2 drive E               overdue: should have begun 32.5 s ago, no word       │
│ 1 goal at:B, priority 1 took effect 34.5 s ago, told 34.5 s ago, on time     │
╰──────────────────────────────────────────────────────────────────────────────╯
╭─ events ─────────────────────────────────────────────────────────────────────╮
│ 15.0 s ground hears nothing from the rover                                   │
│ 35.0 s rover  failsafe alone: the link is lost, after 30.0 s of silence      │
│ 35.0 s rover  mode autonomous: link lost                                     │
╰──────────────────────────────────────────────────────────────────────────────╯"""


def test_the_screen_at_80_by_24(lost: Any) -> None:
    assert shown(lost, 37.5, title="blackout.mcap") == AT_80_BY_24


@pytest.mark.parametrize(("width", "height"), [(100, 30), (80, 24), (60, 24), (60, 40)])
def test_the_commands_on_their_way_are_shown_at_usual_sizes(
    lost: Any, width: int, height: int
) -> None:
    lines = shown(lost, 37.5, width=width, height=height).splitlines()
    title = next(row for row, line in enumerate(lines) if "─ commands" in line)

    assert lines[title].startswith("╭─ commands, 1 on the way, 1 overdue ─")
    assert lines[title + 1].startswith("│ 2 drive E")
    assert "overdue: should have begun 32.5" in lines[title + 1]
    assert lines[title + 2].startswith("│ 1 goal at:B, prior")
    assert " took effect 34.5 s ago, told 34.5 " in lines[title + 2]


def test_in_a_low_terminal_the_commands_give_way_to_the_map(lost: Any) -> None:
    text = shown(lost, 37.5, width=40, height=10)

    assert "commands" not in text
    assert "mode autonomous" in text


def test_what_is_held_stands_over_what_is_on_its_way(lost: Any) -> None:
    orders = Drive("E"), Drive("N")

    lines = shown(lost.note(37, HeldEntry(1, orders, HeldFate.HELD)), 37.5).splitlines()

    title = next(row for row, line in enumerate(lines) if "─ commands" in line)
    assert lines[title].startswith("╭─ commands, 1 held, 1 on the way, 1 overdue ─")
    assert lines[title + 1].startswith("│ held drive E, then drive N held until the link is up")
    assert lines[title + 2].startswith("│ 2    drive E")


def test_an_overdue_command_stands_out_and_one_that_is_over_stands_back(lost: Any) -> None:
    picture = Picture()
    for record in lost.records:
        picture.apply(LogEntry.of(record))
    page = io.StringIO()
    console = Console(file=page, width=100, force_terminal=True, color_system="standard")

    console.print(screen(picture, to_ns(37.5), width=100, height=30))

    assert "\x1b[1;31moverdue: should have begun" in page.getvalue()
    assert "\x1b[90mtook effect" in page.getvalue()


def test_a_belief_is_stale_before_the_rover_counts_as_silent(run: Any) -> None:
    run.start().hear(2, "at:C", since_s=1)
    assert "ground hears   at:C, 4.0 s old" in shown(run, 5)

    run.note(6, BeliefEntry(stale=(BeliefItem.PLACE,)))
    assert "ground stale   at:C, 6.0 s old" in shown(run, 7)

    run.note(20, Silence(silent=True))
    assert "ground silence at:C, 20.0 s old" in shown(run, 21)


def test_a_prediction_of_one_place_is_drawn_and_a_vague_one_is_not(run: Any) -> None:
    sure = Prediction(to_ns(2), 0, (Likely(("at:A",), 0.5), Likely(("at:B",), 0.3)), 0.2)
    vague = Prediction(to_ns(3), 0, (Likely(("at:A",), 0.49), Likely(("at:B",), 0.3)), 0.21)
    nowhere = Prediction(to_ns(4), 0, (), 1.0)

    text = shown(run.start().note(2, sure), 2)
    assert map_of(text)[1].startswith("██◌ ")
    assert "now at A (50%) " in text

    text = shown(run.note(3, vague), 3)
    assert "◌" not in "".join(map_of(text))
    assert "now at A (49%) or B (30%)" in text

    assert "now anywhere" in shown(run.note(4, nowhere), 4)


def test_a_shadow_out_of_step_says_so_beside_what_it_predicts(run: Any) -> None:
    why = "update 3 is missing"
    run.start().note(1, ShadowEntry(2, 1, in_step=False, why=why, signs=1, hypotheses=1, cycles=0))
    run.note(1, Prediction(to_ns(1), 0, (Likely(("at:A",), 0.9),), 0.1))

    assert "shadow out of step now at A (90%)" in shown(run, 1)


def test_it_fills_a_larger_terminal(lost: Any) -> None:
    lines = shown(lost, 37.5, width=100, height=30).splitlines()

    assert len(lines) == 30
    assert {len(line) for line in lines[1:]} == {100}


def test_the_end_of_the_run_is_shown_if_known(lost: Any) -> None:
    header = shown(lost, 37.5, end_ns=to_ns(90)).splitlines()[0]

    assert header.startswith("  37.5 s / 90.0 s   AUTONOMOUS    ALONE ")


def test_the_screen_of_an_empty_picture_says_that_nothing_is_known(run: Any) -> None:
    text = shown(run, 0)

    assert "no map yet" in text
    assert "UNKNOWN" in text


def test_only_the_newest_events_are_shown(lost: Any) -> None:
    text = shown(lost, 37.5, height=20)

    assert "failsafe hold" not in text
    assert "mode autonomous: link lost" in text


@pytest.mark.parametrize(
    ("heading_rad", "arrow"),
    [(0.0, "→"), (math.pi / 4, "↗"), (math.pi / 2, "↑"), (math.pi, "←"), (-math.pi, "←"),
     (-math.pi / 2, "↓"), (7.0, "↗"), (0.3, "→")],
)  # fmt: skip
def test_the_arrow_points_where_the_rover_heads(run: Any, heading_rad: float, arrow: str) -> None:
    rows = map_of(shown(run.start("at:D").stand(1, "at:C", heading_rad), 1))

    assert rows[3] == f"██{arrow}       D ██"


def test_a_wide_map_is_drawn_with_one_column_per_cell() -> None:
    rows = ("#" * 30, "#" + "." * 28 + "#", "#" * 30)
    picture = Picture(chart=Chart(rows, 1.0))
    picture.apply(logged(0, Pose(1.5, 1.5, 0.0, 0.0, "at:1,1", 1.0)))
    page = io.StringIO()
    console = Console(file=page, width=80, color_system=None)

    console.print(screen(picture, 0, width=80, height=24))

    assert f"│ █→{' ' * 27}█ │" in page.getvalue()


def test_markup_in_tokens_and_titles_is_shown_literally(run: Any) -> None:
    text = shown(run.start().goal(1, "[bold]lamp[/bold]"), 1, title="[red].mcap")

    assert "[bold]lamp[/bold] (1)" in text
    assert "[red].mcap" in text


def test_the_rover_and_its_position_at_the_ground_have_different_colours(lost: Any) -> None:
    picture = Picture()
    for record in lost.records:
        picture.apply(LogEntry.of(record))
    page = io.StringIO()
    console = Console(file=page, width=80, force_terminal=True, color_system="standard")

    console.print(screen(picture, 0, width=80, height=24))

    text = page.getvalue()
    assert "\x1b[1;32m↑ \x1b[0m" in text
    assert "\x1b[1;35m◇ \x1b[0m" in text


@settings(deadline=None)
@given(
    width=st.integers(40, 160),
    height=st.integers(10, 60),
    wide=st.integers(3, 130),
    high=st.integers(3, 80),
    data=st.data(),
)
def test_at_any_size_all_that_matters_is_on_the_screen(
    width: int, height: int, wide: int, high: int, data: st.DataObject
) -> None:
    """However large the map: the clock, the modes, the rover, the newest event.

    And the newest command, in a terminal that is not low; nothing beyond.
    """
    walled = "#" + "." * (wide - 2) + "#"
    chart = Chart(("#" * wide, *[walled] * (high - 2), "#" * wide), 1.0)
    east, north = data.draw(st.sampled_from(sorted(chart.tokens)))
    picture = Picture(chart=chart)
    due_s = {CommandStage.BEGUN: 1300.0}
    picture.apply(logged(0, command_sent(1, Drive("E"), expires_s=2000.0, due_s=due_s)))
    picture.apply(logged(0, ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)))
    picture.apply(logged(0, failsafe_entry(Failsafe.ALONE, 30.0)))
    picture.apply(logged(0, Pose(east + 0.5, north + 0.5, math.pi / 4, 0.0, "at:1,1", 1.0)))
    page = io.StringIO()
    console = Console(file=page, width=width, height=height, color_system=None)

    console.print(screen(picture, to_ns(1234.5), width=width, height=height, end_ns=to_ns(9999)))

    lines = page.getvalue().splitlines()
    assert len(lines) == height
    assert all(cell_len(line) <= width for line in lines)
    assert "1234.5 s" in lines[0]
    assert " AUTONOMOUS " in lines[0]
    assert " ALONE " in lines[0]
    assert "failsafe alone" in "\n".join(lines)
    assert ("1 drive E begins in 65.5 s" in "\n".join(lines)) == (height >= 20)
    rows = [row for row, line in enumerate(lines) if "↗" in line]
    assert len(rows) == 1
    title, shown_east = lines[1], lines[rows[0]].partition("↗")[0]
    assert ("more" in title) == any(arrow in title for arrow in "←→↑↓")
    # What lies behind an edge that is not dashed is wall: the map ends there.
    assert shown_east[0] == ("┊" if "←" in title else "│")
    assert ("←" in title) == (shown_east[2] != "█")


def test_a_map_larger_than_its_place_shows_the_part_about_the_rover(run: Any) -> None:
    walled = "#" + "." * 58 + "#"
    picture = Picture(chart=Chart(("#" * 60, *[walled] * 38, "#" * 60), 1.0))
    picture.apply(logged(0, ModeEntry(Mode.GUIDED, ModeCause.START)))
    picture.apply(logged(0, Pose(30.5, 38.5, math.pi, 0.0, "at:30,38", 1.0)))
    page = io.StringIO()
    console = Console(file=page, width=40, height=10, color_system=None)

    console.print(screen(picture, to_ns(5), width=40, height=10))

    assert (
        page.getvalue().replace("UNKNOWN \n", "UNKNOWN\n")
        == """\
  5.0 s   GUIDED    UNKNOWN
╭─ yard, more ← → ↓ ───────────────────╮
┊ ████████████████████████████████████ ┊
┊                   ←                  ┊
┊                                      ┊
┊                                      ┊
╰┄┄┄┄┄┄ ◇ heard  ◌ by now  • proposed ┄╯
╭─ events ─────────────────────────────╮
│ 0.0 s rover mode guided: start       │
╰──────────────────────────────────────╯
"""
    )


def test_in_a_narrow_and_tall_terminal_the_instruments_stand_below_the_map(run: Any) -> None:
    walled = "#" + "." * 58 + "#"
    picture = Picture(chart=Chart(("#" * 60, *[walled] * 38, "#" * 60), 1.0))
    page = io.StringIO()
    console = Console(file=page, width=60, height=40, color_system=None)

    console.print(screen(picture, 0, width=60, height=40))

    lines = page.getvalue().splitlines()
    titles = [line.split()[1].rstrip(",") for line in lines if line.startswith("╭")]
    assert titles == ["yard", "rover", "link", "commands", "events"]
    assert len(lines) == 40


@settings(max_examples=30, deadline=None)
@given(yard=YARDS, entries=st.lists(messages, max_size=12))
@example(yard=Yard(("###", "#.#", "###"), 1.0), entries=[Pose(1, 1, 1.7e308, 0, "at:1,1", 1)])
def test_whatever_a_log_holds_the_screen_can_be_drawn(yard: Any, entries: Any) -> None:
    picture = Picture()
    for message in (yard, *entries):
        picture.apply(logged(0, message))
    page = io.StringIO()

    Console(file=page, width=80, height=24).print(screen(picture, 0, width=80, height=24))

    assert len(page.getvalue().splitlines()) == 24
