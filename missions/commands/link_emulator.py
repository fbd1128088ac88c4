"""`farside link --rover-side … --ground-side …`: the link on a wall clock, between any programs."""

import gc
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer
import zenoh
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from farside.link.emulator import Ahead, Emulator, look_ahead
from farside.link.emulator.control import EmulatorState, WayCounters, WayState
from farside.link.emulator.domains import Domain, domain_at, domain_of
from farside.link.emulator.relay import Cargo, Relay
from farside.link.emulator.sides import open_sides
from farside.link.profile.config import OneWay
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.profile import Profile
from farside.link.profile.sky.dates import parsed_date
from farside.missions.assignments import as_layer, origin_of, read_assignments
from farside.node import Direction, Role
from farside.validation import Problem, one_line, shown

_REFRESH_HZ = 2
_SWITCH_S = 0.001
"""Drawing the table takes milliseconds of Python, for all of which no message should wait."""

_GREATEST_S = 1e9
"""The longest time, as in a profile: 31 years."""

_LOCATOR = re.compile(r"(listen/)?[a-z0-9_-]+/[^/].*")
_ARROWS = {Direction.UP: "↑ up", Direction.DOWN: "↓ down"}

_HELP = "tcp/HOST:PORT of its Zenoh router or peer; listen/tcp/… to be its router."


def _key(text: str) -> zenoh.KeyExpr:
    try:
        return zenoh.KeyExpr.autocanonize(text)
    except zenoh.ZError as error:
        reason = one_line(str(error).partition(" at /")[0])
        raise typer.BadParameter(f"expected a Zenoh key expression, found: {reason}") from error


def _locator(text: str) -> str:
    if not _LOCATOR.fullmatch(text):
        raise typer.BadParameter(
            f"expected a Zenoh locator such as tcp/localhost:7447, found {shown(text)}"
        )
    return text


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds <= _GREATEST_S:
        expected = f"a number of seconds > 0 and <= {_GREATEST_S:g}"
        raise typer.BadParameter(f"expected {expected}, found {shown(text)}")
    return seconds


def _start(text: str) -> str:
    if text.casefold() == _NOW:
        return _NOW
    try:
        return parsed_date(text).isoformat()
    except ValueError as error:
        raise typer.BadParameter(str(error).replace("expected", "expected now, or", 1)) from error


_NOW = "now"

Keys = list[zenoh.KeyExpr] | None


def emulate(
    context: typer.Context,
    rover_side: Annotated[
        str | None,
        typer.Option(parser=_locator, metavar="LOCATOR", help=f"The rover's domain: {_HELP}"),
    ] = None,
    ground_side: Annotated[
        str | None,
        typer.Option(parser=_locator, metavar="LOCATOR", help="The ground's, likewise."),
    ] = None,
    rover_config: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json5", help="Zenoh's settings for the rover's domain."),
    ] = None,
    ground_config: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json5", help="Zenoh's settings for the ground's domain."),
    ] = None,
    up: Annotated[
        Keys,
        typer.Option(parser=_key, metavar="KEYS", help="Passes from ground to rover. Repeatable."),
    ] = None,
    down: Annotated[
        Keys,
        typer.Option(parser=_key, metavar="KEYS", help="Passes from rover to ground. Repeatable."),
    ] = None,
    preset: Annotated[
        str | None, typer.Option(metavar="NAME", help="A link shipped with Farside.")
    ] = None,
    profile: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="A link of your own.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of it: up.loss=0.1"),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            parser=_start,
            metavar="now|DATE",
            help="The date at which a contact plan with dates, or an ephemeris, begins.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the random streams.")] = 0,
    duration: Annotated[
        float | None,
        typer.Option(parser=_seconds, metavar="S", help="End after so many seconds."),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print the counters as one JSON object at the end.")
    ] = False,
) -> None:
    """A link that stands between any Zenoh programs.

    It delays, loses and changes what they say. Without a command it stands between two
    Zenoh domains, on a wall clock, until Ctrl-C: the keys of --up pass from the ground's
    domain to the rover's, those of --down the other way, whoever publishes. On the
    ground's side, a Zenoh get of farside/link/counters replies with the counters, and one of
    farside/link/control with a payload such as {"down": {"loss": 0.2}} or
    {"both": {"out": true}} changes it.

    \b
    farside link --rover-side tcp/10.0.0.2:7447 --ground-side tcp/10.0.0.1:7447 \\
        --up 'cmd/**' --down 'tlm/**' --preset mars-direct
    farside link --rover-side listen/tcp/0.0.0.0:7448 \\
        --ground-side tcp/localhost:7447 --down 'camera/*' --profile relay.toml
    """
    if context.invoked_subcommand is not None:
        return
    domains = {
        Role.ROVER: _domain(Role.ROVER, rover_side, rover_config),
        Role.GROUND: _domain(Role.GROUND, ground_side, ground_config),
    }
    if not (up or down):
        raise typer.BadParameter("expected --up or --down, without which nothing passes")
    link = _described(preset, profile, set_ or ())
    ahead = _ahead(link, start, set_ or ())
    console = Console(stderr=True)

    def notify(text: str) -> None:
        console.print(text, style="yellow", soft_wrap=True, markup=False, highlight=False)

    for role, domain in domains.items():
        _warn(role, domain, notify)
    with open_sides([*domains.values()], notify) as (rover, ground):
        if start == _NOW:  # which may be long after both sides were looked for
            ahead = _ahead(link, start, set_ or ())
        emulator: Emulator[Cargo] = Emulator(ahead, seed)
        try:
            relay = Relay(
                rover,
                ground,
                up=up or (),
                down=down or (),
                emulator=emulator,
                notify=notify,
            )
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
        title = ", ".join(f"{domain.name} {domain.where}" for domain in domains.values())
        _run(relay, duration, title, console)
        state = relay.state()
    if json:
        print(msgspec.json.encode(state).decode())  # noqa: T201
    else:
        Console().print(_display(state, title))


def _domain(role: Role, locator: str | None, config: Path | None) -> Domain:
    name = f"{role} side"
    if config is not None:
        try:
            return domain_of(config, locator, name)
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint=f"--{role}-config") from error
    if locator is None:
        raise typer.BadParameter(
            f"expected --{role}-side or --{role}-config, found neither, and no command; see --help"
        )
    return domain_at(locator, name)


def _warn(role: Role, domain: Domain, notify: Callable[[str], None]) -> None:
    """Tell what anybody may do from outside, if anybody may."""
    if (locator := domain.unguarded()) is not None:
        # Counters and control are served on the ground side.
        may = "send over the link and change it" if role is Role.GROUND else "send over the link"
        notify(
            f"warning: {domain.name}: anybody who reaches {locator} may {may}; "
            f"--{role}-config can ask for a certificate or a password"
        )


def _described(preset: str | None, profile: Path | None, texts: Sequence[str]) -> Profile:
    """The link that is asked for, with what `--set` says laid over it."""
    if preset is not None and profile is not None:
        raise typer.BadParameter("expected --preset or --profile, found both")
    try:
        link = Profile.read(preset or profile or "perfect")
    except LinkConfigError as error:
        raise typer.BadParameter(str(error), param_hint="--preset or --profile") from error
    try:
        for assignment in read_assignments(texts):
            link = link.changed(as_layer(assignment, link.table))
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--set") from error
    return link


def _ahead(link: Profile, start: str | None, texts: Sequence[str]) -> Ahead:
    if start is not None:
        date = datetime.now(UTC).isoformat() if start == _NOW else start
        link = link.changed({"start": date})
    try:
        return look_ahead(link)
    except LinkConfigError as error:
        made = read_assignments(texts)
        told = [Problem(one.key, one.text + origin_of(one, made)) for one in error.problems]
        words = str(LinkConfigError(*told, source=error.source))
        keys = {one.key[:1] for one in error.problems}
        is_set = not keys.isdisjoint(one.key[:1] for one in made)
        is_start = start is not None and ("start",) in keys
        hint = "--start" if is_start else "--set" if is_set else "--preset or --profile"
        raise typer.BadParameter(words, param_hint=hint) from error


def _run(relay: Relay, duration_s: float | None, title: str, console: Console) -> None:
    """Pass messages on until the time is up or the user interrupts."""
    gc.freeze()
    try:
        sys.setswitchinterval(_SWITCH_S)
        if console.is_terminal:
            with Live(
                get_renderable=lambda: _display(relay.state(), title),
                console=console,
                refresh_per_second=_REFRESH_HZ,
                transient=True,
            ):
                relay.run(duration_s)
        else:
            console.print(f"passing messages: {title}", soft_wrap=True)
            relay.run(duration_s)
    except KeyboardInterrupt:
        return


def _display(state: EmulatorState, title: str) -> RenderableType:
    ways = [state.way(direction) for direction in Direction]
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column()
    for direction in Direction:
        table.add_column(_ARROWS[direction], justify="right", min_width=12)
    table.add_row("link", *map(_service, ways))
    for name in WayCounters.__struct_fields__:
        numbers = (f"{getattr(way.counters, name):,}" for way in ways)
        table.add_row(name.replace("_", " "), *numbers)
    settings = [_settings(way) for way in ways]
    for name in OneWay.__struct_fields__:
        if any(name in one for one in settings):
            table.add_row(Text(name, "cyan"), *(one.get(name, "") for one in settings))
    heading = Text(f"{title}, {state.elapsed_s:,.0f} s", "bold")
    return Group(heading, *_warnings(state), table)


def _warnings(state: EmulatorState) -> Iterator[Text]:
    for role, side in ((Role.ROVER, state.rover_side), (Role.GROUND, state.ground_side)):
        if side is not None and not side.connected:
            yield Text(f"{role} side: nobody connected, {side.unheard:,} unheard", "bold red")


def _service(way: WayState) -> Text:
    if way.outage is None:
        return Text("in service")
    left_s = way.outage.left_s
    left = "" if left_s is None else f", {left_s:,.0f} s left"
    return Text(f"OUT: {way.outage.reason}{left}", "bold red")


def _settings(way: WayState) -> dict[str, str]:
    """The settings that differ from those of a perfect link, as text."""
    perfect, found = msgspec.to_builtins(OneWay()), msgspec.to_builtins(way.settings)
    return {key: _text(value) for key, value in found.items() if value != perfect[key]}


def _text(value: object) -> str:
    match value:
        case dict():
            return "\n".join(f"{key} {_text(entry)}" for key, entry in value.items())
        case list() | tuple():
            return f"table of {len(value)}"
        case _:
            return str(value)
