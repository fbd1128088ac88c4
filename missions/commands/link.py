"""`farside link`: the link without a mission."""

from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from farside.link.profile.sky.light import BODIES, LightTime, light_time
from farside.missions.commands.link_check import check
from farside.missions.commands.link_emulator import emulate

_MORATORIUM_DEG = 2.2

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, add_completion=False)
app.callback(invoke_without_command=True)(emulate)
app.command("check")(check)


@app.command("light-time")
def show_light_time(
    body: Annotated[str, typer.Argument(metavar="BODY", help=f"One of {', '.join(BODIES)}.")],
    epoch: Annotated[
        str,
        typer.Argument(
            metavar="EPOCH",
            help="ISO 8601 with Z or an offset from UTC; a date alone is 00:00 UTC.",
        ),
    ],
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Light time between the Earth and a body, up and down.

    And its angle from the Sun.

    The uplink leaves the Earth at the epoch, the downlink arrives there. Between the centres,
    from astropy's built-in ephemeris; needs Farside's extra `astropy`.

    \b
    farside link light-time mars 2021-02-18T00:00:00Z
    farside link light-time moon 2026-07-20T14:56:00+02:00
    farside link light-time mars 2021-10-08 --json
    """
    found = light_time(body, epoch)
    if json:
        print(msgspec.json.encode(found).decode())  # noqa: T201
    else:
        _show(found, Console())


def _show(found: LightTime, console: Console) -> None:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column()
    table.add_column(justify="right")
    for name, light_s in (("uplink", found.uplink_s), ("downlink", found.downlink_s)):
        table.add_row(name, f"{light_s:.3f} s")
    angle_deg = found.sun_earth_target_deg
    table.add_row("from the Sun", f"{angle_deg:.3f}°")
    console.print(table)
    if angle_deg < _MORATORIUM_DEG:
        console.print(
            f"in conjunction: below {_MORATORIUM_DEG}°, missions to Mars are sent no commands",
            style="yellow",
        )
