"""`farside link`: the link without a mission."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.layers import LinkConfigError, text_at
from farside.link.profile.sky.dates import parsed_date
from farside.link.profile.sky.kernels import kernel_orbits
from farside.link.profile.sky.light import LightTime, light_time
from farside.link.profile.sky.positions import EphemerisError, Orbit
from farside.link.profile.sky.sky import BODIES, sky_of
from farside.missions.commands.link_check import check
from farside.missions.commands.link_emulator import emulate

_MORATORIUM_DEG = 2.2

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, add_completion=False)
app.callback(invoke_without_command=True)(emulate)
app.command("check")(check)


@app.command("light-time")
def show_light_time(
    body: Annotated[
        str,
        typer.Argument(
            metavar="BODY",
            help=f"One of {', '.join(BODIES)}; with --kernel a NAIF name, or number, which goes "
            "after -- if it is negative; with --horizons none.",
        ),
    ],
    epoch: Annotated[
        str | None,
        typer.Argument(
            metavar="EPOCH",
            help="ISO 8601 with Z or an offset from UTC; a date alone is 00:00 UTC.",
            show_default=False,
        ),
    ] = None,
    kernel: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE.bsp", help="A SPICE kernel of positions. Repeatable."),
    ] = None,
    horizons: Annotated[
        str | None, typer.Option(metavar="FILE", help="A vector table as JPL Horizons prints it.")
    ] = None,
    center: Annotated[str, typer.Option(metavar="BODY", help="Where the ground is.")] = "earth",
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Light time between the Earth and a body or spacecraft.

    Up and down, and its angle from the Sun.

    The uplink leaves the Earth at the epoch, the downlink arrives there. Between the centres,
    from astropy's built-in ephemeris (needs Farside's extra `astropy`), SPICE kernels (`spice`)
    or a table of JPL Horizons.

    \b
    farside link light-time mars 2021-02-18T00:00:00Z
    farside link light-time moon 2026-07-20T14:56:00+02:00
    farside link light-time mars 2021-10-08 --json
    farside link light-time --kernel mro.bsp mro 2026-11-28
    farside link light-time --kernel mro.bsp -- -74 2026-11-28
    farside link light-time 2026-11-28 --horizons vectors.txt
    """
    if horizons is None:
        named: str | None = body
        date = epoch
    else:
        named, date = (None, body) if epoch is None else (body, epoch)
    if date is None:
        raise EphemerisError("expected a date after the body, found none")
    try:
        table = Ephemeris(body=named, center=center, kernel=tuple(kernel or ()), horizons=horizons)
        found = light_time(
            sky_of(table, parsed_date(date), _text, lambda name: kernel_orbits(Path(name)))
        )
    except ValueError as error:
        raise EphemerisError(str(error)) from error
    if json:
        print(msgspec.json.encode(found).decode())  # noqa: T201
    else:
        _show(found, Console())


def _text(name: str) -> str:
    try:
        return text_at(Path(name), ())
    except LinkConfigError as error:
        raise EphemerisError(str(error)) from error


def _orbits(name: str) -> Sequence[Orbit]:
    return kernel_orbits(Path(name))


def _show(found: LightTime, console: Console) -> None:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column()
    table.add_column(justify="right")
    for name, light_s in (("uplink", found.uplink_s), ("downlink", found.downlink_s)):
        table.add_row(name, f"{light_s:.3f} s")
    angle_deg = found.sun_earth_target_deg
    if angle_deg is None:
        console.print(table)
        return
    table.add_row("from the Sun", f"{angle_deg:.3f}°")
    console.print(table)
    if angle_deg < _MORATORIUM_DEG:
        console.print(
            f"in conjunction: below {_MORATORIUM_DEG}°, missions to Mars are sent no commands",
            style="yellow",
        )
