"""The whole screen, at usual terminal sizes."""

import io
import math
from typing import Any

import pytest
from any_message import YARDS, messages
from hypothesis import example, given, settings
from hypothesis import strategies as st
from noting import failsafe_entry, logged
from rich.cells import cell_len
from rich.console import Console

from farside.control import Chooser, Failsafe, Mode, ModeCause
from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import LogEntry, Picture, screen
from farside.messages import Proposal, ProposedStep
from farside.node import Direction, to_ns
from farside.places import Chart
from farside.topics import ActionStarted, Cycle, ModeEntry, Pose, Silence, Yard


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
    return run.stand(33, "at:3,1").stand(34, "at:4,1").stand(37, "at:D")


AT_80_BY_24 = """\
  37.5 s   AUTONOMOUS    ALONE                                     blackout.mcap
╭─ yard ─────────────────────────╮╭─ rover ────────────────────────────────────╮
│ ██████████████                 ││ at       at:D, 0.00 m/s                    │
│ ██A   ██  B ██                 ││ battery  ████████████░░░░ 75%              │
│ ██    ▒▒  • ██                 ││ action   N, goal-directed, to at:B         │
│ ██◇   · · ↑ ██                 ││ goals    at:B (1)                          │
│ ██████████████                 ││ proposal 9: N, to at:B, 3 steps            │
│                                ││ DEM      74 Signs, 212 hypotheses          │
│                                ││ mean C_m 0.62                              │
│                                │╰────────────────────────────────────────────╯
│                                │╭─ link ─────────────────────────────────────╮
│                                ││ ↑ up   outage  0 delivered 1 lost          │
│                                ││ ↓ down outage  1 delivered 1 lost          │
│                                ││ ground silence telemetry   36.8 s old      │
╰─ ◇ for the ground  • proposed ─╯╰────────────────────────────────────────────╯
╭─ events ─────────────────────────────────────────────────────────────────────╮
│  3.0 s rover  goal at:B set (operator, priority 1)                           │
│  4.0 s link   uplink: blackout begins                                        │
│  4.0 s link   downlink: blackout begins                                      │
│ 15.0 s rover  failsafe hold: nothing is heard, after 10.0 s of silence       │
│ 15.0 s ground hears nothing from the rover                                   │
│ 35.0 s rover  failsafe alone: the link is lost, after 30.0 s of silence      │
│ 35.0 s rover  mode autonomous: link lost                                     │
╰──────────────────────────────────────────────────────────────────────────────╯"""


def test_the_screen_at_80_by_24(lost: Any) -> None:
    assert shown(lost, 37.5, title="blackout.mcap") == AT_80_BY_24


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
    """However large the map: the clock, the modes, the rover, the newest event, nothing beyond."""
    walled = "#" + "." * (wide - 2) + "#"
    chart = Chart(("#" * wide, *[walled] * (high - 2), "#" * wide), 1.0)
    east, north = data.draw(st.sampled_from(sorted(chart.tokens)))
    picture = Picture(chart=chart)
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
╰┄┄┄┄┄┄┄ ◇ for the ground  • proposed ┄╯
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
    assert titles == ["yard", "rover", "link", "events"]
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
