"""`farside link check`: the proof that the link does what a profile asks for."""

import math
from collections.abc import Iterator, Sequence
from time import monotonic
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn
from rich.table import Table

from farside.link.check import FRAMES, CheckReport, CheckVerdict, Measurement, check_link
from farside.link.emulator import look_ahead
from farside.link.profile.config import LinkConfig
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.profile import Profile
from farside.missions.commands.display.bar import Bar
from farside.missions.commands.display.patience import PATIENCE_S, patience
from farside.node import Direction

_UNMET = 1
_NAMED = 4
_TITLES = {Direction.UP: "Up, from the ground to the rover", Direction.DOWN: "Down, from the rover"}
_STYLES = {
    CheckVerdict.INSIDE: "green",
    CheckVerdict.OUTSIDE: "bold red",
    CheckVerdict.UNKNOWN: "yellow",
}
_COLUMNS = ("asked", "measured", "99 % interval", "frames", "verdict")


def check(
    profile: Annotated[
        str,
        typer.Argument(
            metavar="PROFILE", help="A preset such as 'moon', or a TOML file like a [link] table."
        ),
    ],
    frames: Annotated[
        int,
        typer.Option(min=100, metavar="N", help="Frames per direction, where chance is measured."),
    ] = FRAMES,
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Seed of the link and of the traffic.")
    ] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Measure whether a link does what its profile says.

    Traffic goes through the link in simulated time.
    What cannot be measured is said to be so, and why: a window too short, a delay too long.
    The exit status is 1 if a value asked for falls outside the interval measured, 2 if the
    profile is invalid, 3 if the check itself fails.

    \b
    farside link check moon
    farside link check mylink.toml --frames 200000 --seed 1
    farside link check mars-relay --json
    """
    try:
        with patience("reading the profile"):
            config = look_ahead(Profile.read(profile)).config
    except LinkConfigError as error:
        raise typer.BadParameter(str(error), param_hint="PROFILE") from error
    console = Console()
    report = _checked(config, frames, seed, Console(stderr=True))
    if json:
        print(msgspec.json.encode(report).decode())  # noqa: T201
    else:
        _show(report, console)
    if not report.passed:
        raise typer.Exit(_UNMET)


def _checked(config: LinkConfig, frames: int, seed: int, console: Console) -> CheckReport:
    """The report; a progress bar appears if it takes longer than two seconds."""
    bar = Bar(TextColumn("measuring"), BarColumn(), TaskProgressColumn(), console=console)
    task, started_s = bar.add_task("", total=1.0), monotonic()

    def show_progress(share: float) -> None:
        bar.update(task, completed=share)
        if monotonic() - started_s > PATIENCE_S:
            bar.start()

    try:
        return check_link(config, frames=frames, seed=seed, on_progress=show_progress)
    finally:
        bar.stop()


def _show(report: CheckReport, console: Console) -> None:
    for direction in Direction:
        table = Table("impairment", title=_TITLES[direction], title_justify="left")
        for name in _COLUMNS:
            table.add_column(name, justify="left" if name == "verdict" else "right")
        for one in report.measurements:
            if one.direction is direction:
                table.add_row(*_row(one), style=_STYLES[one.verdict] if _is_notable(one) else "")
        console.print(table)
        for text in _reasons([one for one in report.measurements if one.direction is direction]):
            console.print(text, style="yellow", soft_wrap=True, markup=False)
    outside = sum(one.verdict is CheckVerdict.OUTSIDE for one in report.measurements)
    console.print(
        f"{report.frames:,} frames, seed {report.seed}: "
        + (f"[bold red]{outside} outside[/]" if outside else "[green]nothing outside[/]")
    )


def _reasons(measurements: Sequence[Measurement]) -> Iterator[str]:
    """For each reason for which something was not measured: what, and the reason."""
    names: dict[str, list[str]] = {}
    for one in measurements:
        if one.why:
            names.setdefault(one.why, []).append(_name(one))
    for why, found in names.items():
        more = f" and {len(found) - _NAMED:,} more" if len(found) > _NAMED else ""
        yield f"not measured: {'; '.join(found[:_NAMED])}{more}: {why}"


def _name(one: Measurement) -> str:
    return f"{one.impairment}, from {one.from_s:g} s" if one.from_s else one.impairment


def _is_notable(one: Measurement) -> bool:
    return one.verdict is not CheckVerdict.INSIDE


def _row(one: Measurement) -> tuple[str, ...]:
    scale, unit = _scale(one)
    asked, measured, interval = "", "", ""
    if not math.isnan(one.asked):
        asked = f"{_number(one.asked, one.unit, scale)} {unit}"
    if one.verdict is not CheckVerdict.UNKNOWN:
        measured = f"{_number(one.measured, one.unit, scale)} {unit}"
        interval = f"{_number(one.low, one.unit, scale)} to {_number(one.high, one.unit, scale)}"
    return _name(one), asked, measured, interval, f"{one.frames:,}", one.verdict


def _scale(one: Measurement) -> tuple[float, str]:
    """The factor by which values are multiplied to be shown, and the unit they then have."""
    if one.unit == "share":
        return 100.0, "%"
    if one.unit == "bit/s" and one.asked >= 1e6:
        return 1e-6, "Mbit/s"
    return 1.0, one.unit


def _number(value: float, unit: str, scale: float) -> str:
    """Delays and rates are nearly exact; all else is good for four digits at most."""
    digits = 8 if unit in {"s", "bit/s"} else 4
    return "∞" if math.isinf(value) else f"{value * scale:,.{digits}g}"
