"""The whole screen, at usual terminal sizes."""

import io
import math
from typing import Any

import pytest
from noting import logged
from rich.console import Console

from farside.logs import LogEntry, Picture, screen
from farside.messages import Chooser, Failsafe, Mode, ModeCause, Proposal, ProposedStep
from farside.node import Direction, to_ns
from farside.places import Chart
from farside.topics import (
    ActionStarted,
    Cycle,
    FailsafeEntry,
    Fate,
    LinkOutage,
    ModeEntry,
    OutageReason,
    Pose,
    Silence,
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
    run.note(15, FailsafeEntry(Failsafe.HOLD, 10.0), Silence(silent=True))
    run.note(
        35, FailsafeEntry(Failsafe.LOST, 30.0), ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)
    )
    path = (
        ProposedStep(("at:D",), "N", 8.0),
        ProposedStep(("at:5,2",), "N", 4.0),
        ProposedStep(("at:B",), "N", 0.0),
    )
    run.note(36, Cycle(("at:D",), (), (), 2, 1, 0, 74, 212, 0.625))
    run.note(36, Proposal(9, 0, ("at:B",), "N", Chooser.GOAL_DIRECTED, path))
    run.note(36, ActionStarted("N", Chooser.GOAL_DIRECTED, None, ("at:B",)))
    return run.stand(33, "at:3,1").stand(34, "at:4,1").stand(37, "at:D")


AT_80_BY_24 = """\
  0:00:37.5   AUTONOMOUS    LOST                                   blackout.mcap
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
│ 0:00:03.0 rover  goal at:B set (operator, priority 1)                        │
│ 0:00:04.0 link   uplink: blackout begins                                     │
│ 0:00:04.0 link   downlink: blackout begins                                   │
│ 0:00:15.0 rover  failsafe hold after 10.0 s of silence                       │
│ 0:00:15.0 ground hears nothing from the rover                                │
│ 0:00:35.0 rover  failsafe lost after 30.0 s of silence                       │
│ 0:00:35.0 rover  mode autonomous: link lost                                  │
╰──────────────────────────────────────────────────────────────────────────────╯"""


def test_the_screen_at_80_by_24(lost: Any) -> None:
    assert shown(lost, 37.5, title="blackout.mcap") == AT_80_BY_24


def test_it_fills_a_larger_terminal(lost: Any) -> None:
    lines = shown(lost, 37.5, width=100, height=30).splitlines()

    assert len(lines) == 30
    assert {len(line) for line in lines[1:]} == {100}


def test_the_end_of_the_run_is_shown_if_known(lost: Any) -> None:
    header = shown(lost, 37.5, end_ns=to_ns(90)).splitlines()[0]

    assert header.startswith("  0:00:37.5 / 0:01:30.0   AUTONOMOUS    LOST ")


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
