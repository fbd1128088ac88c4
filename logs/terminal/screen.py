"""The terminal screen: a `Picture` drawn as a map with instruments and events."""

from collections.abc import Sequence
from enum import StrEnum
from typing import TypeVar

from rich.box import Box
from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from farside.control import Failsafe, Mode
from farside.escaping import printable
from farside.logs.events import EventLine, sign_text, time_text
from farside.logs.known import KnownCommands
from farside.logs.picture import Picture
from farside.logs.terminal.commands import command_rows, commands_title
from farside.logs.terminal.yard import DrawnMap, draw_yard, foreseen_place
from farside.messages import Tokens
from farside.node import Direction, Role, to_s
from farside.places import is_place_token, place_name
from farside.topics import ActionStarted, BeliefItem, Prediction

_DIRECTION_LABELS = {Direction.UP: "↑ up", Direction.DOWN: "↓ down"}

_LEGEND = "[magenta]◇[/] heard  [magenta]◌[/] by now  [cyan]•[/] proposed"

LEAST_WIDTH, LEAST_HEIGHT = 40, 10
"""Columns and rows that `screen` needs."""

_MAP_WIDTH_MIN, _MAP_HEIGHT_MIN = 30, 8
_INSTRUMENTS_WIDTH_MIN = 40
_BESIDE = 6  # columns of frames about a map and the instruments beside it
_BODY_HEIGHT_MIN = 14
_LINK_HEIGHT = 6
_COMMANDS_MIN, _COMMANDS_MAX = 2, 6
_EVENTS_MIN = 3
_TALL, _WIDE = 20, 76  # rows and columns from which nothing has to give way
_BATTERY_WIDTH = 16
_ORDER_SHARE = 0.3  # of the width; the rest is for what is known of it

_DIM, _GOOD, _FAIR, _BAD = "bright_black", "green", "yellow", "bold red"
_MODE_STYLES = {Mode.GUIDED: "blue", Mode.SHARED: "cyan", Mode.AUTONOMOUS: "yellow"}
_FAILSAFE_STYLES = {
    Failsafe.NOMINAL: _GOOD,
    Failsafe.HOLD: _FAIR,
    Failsafe.ALONE: _BAD,
    Failsafe.SAFE: _BAD,
}
_ROLE_STYLES = {Role.ROVER: "green", Role.LINK: "yellow", Role.GROUND: "magenta"}

_State = TypeVar("_State", bound=StrEnum)


def screen(
    picture: Picture,
    now_ns: int,
    *,
    width: int,
    height: int,
    title: str = "farside",
    end_ns: int | None = None,
) -> RenderableType:
    """Draw a picture, at its best in 100 columns by 30 rows and usable from 40 by 10, not below.

    Clock, modes and events always have their place. A map that is larger than its own shows the
    part about the rover; dashes for an edge, and an arrow in the title, say where it goes on. The
    instruments stand beside the map, in a narrow terminal below it, and give way where there is
    room for neither. The commands on their way stand over the events, in a terminal that is not
    low.

    It reads without colours too: every state has its own word or character.

    Args:
        picture: the state of the run at `now_ns`.
        now_ns: simulated time.
        width: columns to fill.
        height: rows to fill.
        title: text at the top right.
        end_ns: simulated time at which the run ends, if known.
    """
    beside = width >= _MAP_WIDTH_MIN + _INSTRUMENTS_WIDTH_MIN + _BESIDE
    tall = height >= _TALL
    least = _EVENTS_MIN + 2 + _COMMANDS_MIN + 2 if tall else 1 + 2
    room = height - 1 - least
    map_width = (width - _INSTRUMENTS_WIDTH_MIN - 2 if beside else width) - 4
    stacked = not beside and room >= _BODY_HEIGHT_MIN + _MAP_HEIGHT_MIN
    below = _BODY_HEIGHT_MIN if stacked else 0
    yard = draw_yard(picture, map_width, room - below - 2)
    body_height = min(max(2 + len(yard.rows), _BODY_HEIGHT_MIN if beside else 0), room - below)
    free = room - body_height - below
    commands = min(_COMMANDS_MIN + free // 3, _COMMANDS_MAX) if tall else 0
    yard_panel = map_panel(yard, body_height, title="yard", legend=_LEGEND)
    if beside:
        body = Table.grid(expand=True)
        body.add_column(width=4 + max(_MAP_WIDTH_MIN, yard.width))
        body.add_column(ratio=1)
        body.add_row(yard_panel, _instruments(picture, now_ns, body_height))
        panels: list[RenderableType] = [body]
    elif stacked:
        panels = [yard_panel, _instruments(picture, now_ns, below)]
    else:
        panels = [yard_panel]
    if tall:
        panels.append(_commands(picture.commands, now_ns, commands, int(_ORDER_SHARE * width)))
    events = height - 1 - body_height - below - (commands + 2 if tall else 0) - 2
    return Group(
        _header(picture, now_ns, title, end_ns, wide=width >= _WIDE),
        *panels,
        panel("events", _events(list(picture.lines)[-events:]), height=events + 2),
    )


def _commands(commands: KnownCommands, now_ns: int, rows: int, order_width: int) -> Panel:
    shown = command_rows(commands, now_ns, rows)
    for _, order, _ in shown:
        order.truncate(order_width, overflow="ellipsis")
    return panel(commands_title(commands), grid(shown), height=rows + 2)


def map_panel(yard: DrawnMap, height: int, *, title: str | Text, legend: str | Text) -> Panel:
    """A map in its frame, `height` rows high; an edge behind which it goes on is dashed."""
    framed = panel(
        Text.assemble(title, f", more {' '.join(yard.more)}" if yard.more else ""),
        Group(*yard.rows),
        height=height,
        legend=legend,
    )
    west, east = ("┊" if arrow in yard.more else "│" for arrow in "←→")
    north, south = ("┄" if arrow in yard.more else "─" for arrow in "↑↓")
    sides = f"{west}  {east}\n"
    framed.box = Box(f"╭{north}{north}╮\n{sides}├──┤\n{sides}├──┤\n├──┤\n{sides}╰{south}{south}╯\n")
    return framed


def _instruments(picture: Picture, now_ns: int, height: int) -> RenderableType:
    """The rover's panel, and that of link and ground where there is room for both."""
    if height < _BODY_HEIGHT_MIN // 2 + _LINK_HEIGHT:
        return panel("rover", _rover(picture), height=height)
    return Group(
        panel("rover", _rover(picture), height=height - _LINK_HEIGHT),
        panel(
            "link and ground",
            Group(_link(picture), _ground(picture, now_ns)),
            height=_LINK_HEIGHT,
        ),
    )


def panel(
    title: str | Text, inside: RenderableType, *, height: int, legend: str | Text | None = None
) -> Panel:
    """A frame about something, with a title, `height` rows high."""
    return Panel(
        inside,
        title=title,
        title_align="left",
        subtitle=legend,
        subtitle_align="right",
        border_style=_DIM,
        height=height,
    )


def _header(
    picture: Picture, now_ns: int, title: str, end_ns: int | None, *, wide: bool
) -> RenderableType:
    state = Text(f"  {time_text(now_ns)}", style="bold", no_wrap=True)
    if end_ns is not None and wide:
        state.append(f" / {time_text(end_ns)}", style=_DIM)
    stale = picture.belief.stale if picture.as_ground and picture.belief is not None else ()
    for badge in (
        _badge(picture.mode, _MODE_STYLES, stale=BeliefItem.MODE in stale),
        _badge(picture.failsafe, _FAILSAFE_STYLES, stale=BeliefItem.FAILSAFE in stale),
    ):
        state.append("  ").append(badge)
    if not wide:
        return state
    header = grid([(state, Text(f"{printable(title)}  ", style=_DIM))])
    header.columns[1].justify = "right"
    return header


def _badge(state: _State | None, styles: dict[_State, str], *, stale: bool) -> Text:
    if state is None:
        return Text(" UNKNOWN ", style="reverse")
    return Text(f" {state.upper()}{'?' if stale else ''} ", style=f"{styles[state]} reverse")


def grid(rows: Sequence[Sequence[str | Text]]) -> Table:
    """A grid with one line per row; only the last column shrinks when room is short.

    Strings are shown literally: rich markup in them is not interpreted.
    """
    table = Table.grid(padding=(0, 1, 0, 0))
    for row in rows:
        table.add_row(*(Text(printable(cell)) if isinstance(cell, str) else cell for cell in row))
    for column in table.columns:
        column.no_wrap = True
    if table.columns:
        table.columns[-1].ratio, table.expand = 1, True
    return table


# --- the instruments ---------------------------------------------------------------------------


def _rover(picture: Picture) -> Table:
    if picture.as_ground:
        return _believed_rover(picture)
    pose, cycle = picture.pose, picture.cycle
    rows: dict[str, str | Text] = dict.fromkeys(
        ("at", "battery", "action", "goals", "proposal", "DEM"), "none"
    )
    if pose is not None:
        rows["at"] = f"{pose.place}, {pose.speed_m_s:.2f} m/s"
        rows["battery"] = _battery(pose.battery)
    rows["action"] = _action(picture.action)
    rows |= _wanted(picture)
    if cycle is not None:
        sizes = f"{cycle.signs} Signs, {cycle.hypotheses} hyp."
        rows["DEM"] = f"{sizes}, C_m {cycle.mean_cm:.2f}"
    return grid([(Text(label, style=_DIM), value) for label, value in rows.items()])


def _believed_rover(picture: Picture) -> Table:
    """The rover as the ground had it."""
    heard, belief, shadow = picture.telemetry, picture.belief, picture.shadow
    rows: dict[str, str | Text] = dict.fromkeys(
        ("heard at", "battery", "action", "goals", "proposal", "shadow"), "unknown"
    )
    if heard is not None:
        rows["heard at"] = next(filter(is_place_token, heard.tokens), "no place")
        rows["battery"] = _battery(heard.battery)
    if belief is not None and belief.action is not None:
        rows["action"] = belief.action.value or "standing"
        rows["goals"] = rows["proposal"] = "none"
    rows |= _wanted(picture)
    if shadow is not None:
        rows["shadow"] = f"{shadow.signs} Signs, {shadow.hypotheses} hyp."
    return grid([(Text(label, style=_DIM), value) for label, value in rows.items()])


def _wanted(picture: Picture) -> dict[str, str]:
    rows = {}
    if picture.goals:
        rows["goals"] = ", ".join(
            sign_text(sign) if priority is None else f"{sign_text(sign)} ({priority:.3g})"
            for sign, priority in picture.goals.items()
        )
    if (proposal := picture.proposal) is not None:
        rows["proposal"] = (
            f"{proposal.number}: {proposal.action}, to {sign_text(proposal.goal)}, "
            f"{len(proposal.path)} steps"
        )
    return rows


def _battery(charge: float) -> Text:
    charge = min(max(charge, 0.0), 1.0)  # a log may claim anything
    full = round(charge * _BATTERY_WIDTH)
    style = _GOOD if charge > 0.5 else _FAIR if charge > 0.2 else _BAD
    bar = "█" * full + "░" * (_BATTERY_WIDTH - full)
    return Text.assemble((bar, style), f" {charge:.0%}")


def _action(action: ActionStarted | None) -> str:
    if action is None:
        return "standing"
    goal = f", to {sign_text(action.goal)}" if action.goal else ""
    return f"{action.action}, {action.chooser}{goal}"


def _link(picture: Picture) -> Table:
    rows: list[tuple[Text, Text, str, str]] = []
    if picture.as_ground:
        label = Text(" ".join(_DIRECTION_LABELS.values()), style=_DIM)
        return grid([(label, "not known at the ground")])
    for direction, side in picture.link.items():
        state = _lamp("outage" if side.down else "ok", _BAD if side.down else _GOOD)
        label = Text(_DIRECTION_LABELS[direction], style=_DIM)
        rows.append((label, state, f"{side.delivered} delivered", f"{side.lost} lost"))
    return grid(rows)


def _ground(picture: Picture, now_ns: int) -> Table:
    """What the ground believes: where the rover was, how old that is, and where it is by now."""
    belief, shadow = picture.belief, picture.shadow
    hears = _lamp("hears", _GOOD)
    if picture.silent:
        hears = _lamp("silence", _BAD)
    elif belief is not None and BeliefItem.PLACE in belief.stale:
        hears = _lamp("stale", _FAIR)
    step = _lamp("none", "")
    if shadow is not None:
        step = _lamp("in step", _GOOD) if shadow.in_step else _lamp("out of step", _FAIR)
    return grid(
        [
            (Text("ground", style=_DIM), hears, _heard(picture, now_ns)),
            (Text("shadow", style=_DIM), step, _by_now(picture.prediction)),
        ]
    )


def _lamp(word: str, style: str) -> Text:
    return Text(f"{word:<7}", style=style)


def _heard(picture: Picture, now_ns: int) -> str:
    if picture.telemetry is None:
        return "nothing yet"
    age = f"{to_s(now_ns - picture.telemetry.time_ns):.1f} s old"
    place = next(filter(is_place_token, picture.telemetry.tokens), "no place")
    return f"{place}, {age}"


def _by_now(prediction: Prediction | None) -> str:
    if prediction is None:
        return "now unknown"
    likely = [f"{_place(one.sign)} ({one.probability:.0%})" for one in prediction.likely]
    shown = likely[:1] if foreseen_place(prediction) is not None else likely[:2]
    return f"now at {' or '.join(shown)}" if shown else "now anywhere"


def _place(sign: Tokens) -> str:
    return sign_text(tuple(place_name(token) if is_place_token(token) else token for token in sign))


def _events(lines: Sequence[EventLine]) -> Table:
    times = [time_text(line.t_ns) for line in lines]
    wide = max(map(len, times), default=0)
    return grid(
        [
            (
                Text(time.rjust(wide), style=_DIM),
                Text(line.role, style=_ROLE_STYLES[line.role]),
                Text(line.text, style=_DIM if line.routine else ""),
            )
            for time, line in zip(times, lines, strict=True)
        ]
    )
