"""The screen: a `Picture` as the terminal shows it, the map and the instruments beside it."""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import TypeVar

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from farside.logs.picture import Picture
from farside.logs.story import StoryLine, clock, name
from farside.messages import Failsafe, Mode
from farside.node import Direction, Role, to_s
from farside.places import ROCK, SHADOW, WALL, Cell, Chart, place_name
from farside.topics import ActionStarted
from farside.validation import printable

_ARROWS = "→↗↑↖←↙↓↘"
_WAYS = {Direction.UP: "↑ up", Direction.DOWN: "↓ down"}

_LEGEND = "[magenta]◇[/] for the ground  [cyan]•[/] proposed"

_MAP_WIDTH_MIN = 30
_INSTRUMENTS_WIDTH_MIN = 42
_BODY_HEIGHT_MIN = 14
_EVENTS_MIN = 3
_BATTERY_WIDTH = 16

_DIM, _GOOD, _FAIR, _BAD = "bright_black", "green", "yellow", "bold red"
_MODE_STYLES = {Mode.GUIDED: "blue", Mode.SHARED: "cyan", Mode.AUTONOMOUS: "yellow"}
_FAILSAFE_STYLES = {Failsafe.NOMINAL: _GOOD, Failsafe.HOLD: _FAIR, Failsafe.LOST: _BAD}
_ROLE_STYLES = {Role.ROVER: "green", Role.LINK: "yellow", Role.GROUND: "magenta"}

_State = TypeVar("_State", bound=StrEnum)
_Mark = tuple[str, str]
"""A character of the map and its style."""


def screen(
    picture: Picture,
    now_ns: int,
    *,
    width: int,
    height: int,
    title: str = "farside",
    end_ns: int | None = None,
) -> RenderableType:
    """The picture at a time, made for 100 columns by 30 rows and usable from 80 by 24.

    It reads without colours too: every state has a word or a character of its own.

    Args:
        picture: everything logged up to `now_ns`.
        now_ns: simulated time.
        width: columns to fill.
        height: rows to fill; more are taken where the map is high.
        title: what is shown, at the top on the right.
        end_ns: when the run ends, where that is known.
    """
    drawing = _map(picture, width - _INSTRUMENTS_WIDTH_MIN - 4)
    body_height = max(2 + len(drawing), _BODY_HEIGHT_MIN)
    body = Table.grid(expand=True)
    body.add_column(width=4 + max(_MAP_WIDTH_MIN, *(row.cell_len for row in drawing)))
    body.add_column(ratio=1)
    body.add_row(
        _panel("yard", Group(*drawing), height=body_height, legend=_LEGEND),
        Group(
            _panel("rover", _rover(picture), height=body_height - 5),
            _panel("link", _link(picture, now_ns), height=5),
        ),
    )
    events = max(_EVENTS_MIN, height - 1 - body_height - 2)
    return Group(
        _header(picture, now_ns, title, end_ns),
        body,
        _panel("events", _events(list(picture.lines)[-events:]), height=events + 2),
    )


def _panel(title: str, inside: RenderableType, *, height: int, legend: str | None = None) -> Panel:
    return Panel(
        inside,
        title=title,
        title_align="left",
        subtitle=legend,
        subtitle_align="right",
        border_style=_DIM,
        height=height,
    )


def _header(picture: Picture, now_ns: int, title: str, end_ns: int | None) -> Table:
    state = Text(f"  {clock(now_ns)}", style="bold")
    if end_ns is not None:
        state.append(f" / {clock(end_ns)}", style=_DIM)
    for badge in (_badge(picture.mode, _MODE_STYLES), _badge(picture.failsafe, _FAILSAFE_STYLES)):
        state.append("  ").append(badge)
    header = _grid([(state, Text(f"{printable(title)}  ", style=_DIM))])
    header.expand = True
    header.columns[1].justify = "right"
    return header


def _badge(state: _State | None, styles: dict[_State, str]) -> Text:
    if state is None:
        return Text(" UNKNOWN ", style="reverse")
    return Text(f" {state.upper()} ", style=f"{styles[state]} reverse")


def _grid(rows: Sequence[Sequence[str | Text]]) -> Table:
    """Cells in columns, one line a row; only the last column gives way where room is short.

    Words are never taken for markup.
    """
    grid = Table.grid(padding=(0, 1, 0, 0))
    for row in rows:
        grid.add_row(*(Text(printable(cell)) if isinstance(cell, str) else cell for cell in row))
    for number, column in enumerate(grid.columns, start=1):
        column.no_wrap = True
        if number < len(grid.columns):
            column.min_width = max(len(row[number - 1]) for row in rows)
    return grid


# --- the map -----------------------------------------------------------------------------------


def _map(picture: Picture, width: int) -> list[Text]:
    """The rows of the map; a cell takes two columns if `width` lets it, to look square."""
    chart = picture.chart
    if chart is None:
        return [Text("no map yet", style=_DIM)]
    marks = _marks(picture, chart)
    columns = 2 if 2 * len(chart.rows[0]) <= width else 1
    drawing = []
    for north, characters in zip(reversed(range(len(chart.rows))), chart.rows, strict=True):
        row = Text(no_wrap=True)
        for east, character in enumerate(characters):
            mark, style = marks.get(Cell(east, north), (" ", ""))
            if character == WALL:
                mark, style = "█" * columns, _DIM
            elif character == ROCK:
                mark, style = "▒" * columns, _FAIR
            elif character == SHADOW and mark == " ":
                mark, style = "~", _DIM
            row.append(mark.ljust(columns), style=style)
        drawing.append(row)
    return drawing


def _marks(picture: Picture, chart: Chart) -> dict[Cell, _Mark]:
    """What stands on the places of the map; what matters more hides what matters less."""
    proposed = {
        token for step in (picture.proposal.path if picture.proposal else ()) for token in step.sign
    }
    goals = {token for sign in picture.goals for token in sign}
    marks = {
        cell: _place_mark(
            place_name(token),
            visited=token in picture.visited,
            proposed=token in proposed,
            goal=token in goals,
        )
        for token, cell in chart.cells.items()
    }
    if picture.telemetry is not None:
        marks[chart.cell_at(picture.telemetry.x_m, picture.telemetry.y_m)] = ("◇", "bold magenta")
    if picture.pose is not None:
        arrow = _ARROWS[round(picture.pose.heading_rad / (math.pi / 4)) % 8]
        marks[chart.cell_at(picture.pose.x_m, picture.pose.y_m)] = (arrow, "bold green")
    return marks


def _place_mark(place: str, *, visited: bool, proposed: bool, goal: bool) -> _Mark:
    if place.isalpha():
        return place, "bold yellow" if goal else "bold cyan" if proposed else "bold"
    if proposed:
        return "•", "cyan"
    return ("·", _DIM) if visited else (" ", "")


# --- the instruments ---------------------------------------------------------------------------


def _rover(picture: Picture) -> Table:
    pose, cycle, proposal = picture.pose, picture.cycle, picture.proposal
    rows: dict[str, str | Text] = dict.fromkeys(
        ("at", "battery", "action", "goals", "proposal", "DEM", "mean C_m"), "none"
    )
    if pose is not None:
        rows["at"] = f"{pose.place}, {pose.speed_m_s:.2f} m/s"
        rows["battery"] = _battery(pose.battery)
    rows["action"] = _action(picture.action)
    if picture.goals:
        goals = picture.goals.items()
        rows["goals"] = ", ".join(f"{name(sign)} ({priority:.3g})" for sign, priority in goals)
    if proposal is not None:
        steps = f"{len(proposal.path)} steps" if proposal.path else proposal.chooser
        rows["proposal"] = (
            f"{proposal.number}: {proposal.action}, to {name(proposal.goal)}, {steps}"
        )
    if cycle is not None:
        rows["DEM"] = f"{cycle.signs} Signs, {cycle.hypotheses} hypotheses"
        rows["mean C_m"] = f"{cycle.mean_cm:.2f}"
    return _grid([(Text(label, style=_DIM), value) for label, value in rows.items()])


def _battery(charge: float) -> Text:
    full = round(charge * _BATTERY_WIDTH)
    style = _GOOD if charge > 0.5 else _FAIR if charge > 0.2 else _BAD
    bar = "█" * full + "░" * (_BATTERY_WIDTH - full)
    return Text.assemble((bar, style), f" {charge:.0%}")


def _action(action: ActionStarted | None) -> str:
    if action is None:
        return "standing"
    goal = f", to {name(action.goal)}" if action.goal else ""
    return f"{action.action}, {action.chooser}{goal}"


def _link(picture: Picture, now_ns: int) -> Table:
    rows: list[tuple[Text, Text, str, str]] = []
    for direction, side in picture.link.items():
        state = _lamp("outage" if side.down else "ok", good=not side.down)
        label = Text(_WAYS[direction], style=_DIM)
        rows.append((label, state, f"{side.delivered} delivered", f"{side.lost} lost"))
    hears = _lamp("silence" if picture.silent else "hears", good=not picture.silent)
    rows.append((Text("ground", style=_DIM), hears, "telemetry", _age(picture, now_ns)))
    return _grid(rows)


def _lamp(word: str, *, good: bool) -> Text:
    return Text(f"{word:<7}", style=_GOOD if good else _BAD)


def _age(picture: Picture, now_ns: int) -> str:
    if picture.telemetry is None:
        return "none yet"
    return f"{to_s(now_ns - picture.telemetry.time_ns):.1f} s old"


def _events(lines: Sequence[StoryLine]) -> Table:
    return _grid(
        [
            (
                Text(clock(line.t_ns), style=_DIM),
                Text(line.who, style=_ROLE_STYLES[line.who]),
                Text(line.text, style=_DIM if line.routine else ""),
            )
            for line in lines
        ]
    )
