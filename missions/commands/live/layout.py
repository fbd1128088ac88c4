"""`farside layout`."""

from pathlib import Path
from typing import Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.failures import print_error
from farside.missions.commands.values import As

_FOXGLOVE = "farside-foxglove.json"
_FOXGLOVE_AS_GROUND = "farside-foxglove-as-ground.json"
_RERUN = "farside-rerun.rbl"


def write_layouts(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the files.", show_default="this one")
    ] = Path(),
    as_: As = None,
) -> None:
    """Write layouts for Foxglove, Lichtblick and Rerun.

    With them, a log shows its map, its rovers, modes, numbers and events at once: one file for
    Foxglove and Lichtblick, and a blueprint for Rerun, which takes rerun-sdk. With --as ground the
    layout is one for `farside replay --live --as ground`, and there is no blueprint, since Rerun
    reads logs whole.

    \b
    farside layout
    farside layout --out viewers
    farside layout --as ground
    """
    foxglove = out / (_FOXGLOVE if as_ is None else _FOXGLOVE_AS_GROUND)
    rerun = out / _RERUN if as_ is None else None
    for path in (foxglove, rerun):
        if path is not None and path.exists():
            raise typer.BadParameter(
                f"{path} already exists, and is not overwritten: choose another folder",
                param_hint="--out",
            )
    with patience("writing the layouts"):
        written = _write(foxglove, rerun, as_ground=as_ is not None)
    print(f"{_shown(foxglove)}: in Foxglove or Lichtblick, Layout > Import from file")  # noqa: T201
    if rerun in written:
        print(  # noqa: T201
            f"{_shown(rerun)}: in Rerun, open a log, then this file; or in a terminal:\n"
            "  rerun mcap convert LOG --application-id farside -o log.rrd\n"
            f"  rerun log.rrd {_shown(rerun)}"
        )
    elif rerun is not None:
        print_error(
            "no blueprint for Rerun, as rerun-sdk is missing or too old: "
            "pip install --upgrade rerun-sdk"
        )


def _write(foxglove: Path, rerun: Path | None, *, as_ground: bool) -> list[Path]:
    from farside.logs.layouts.foxglove import foxglove_layout

    foxglove.parent.mkdir(parents=True, exist_ok=True)
    with foxglove.open("xb") as file:
        file.write(foxglove_layout(as_ground=as_ground))
    if rerun is None:
        return [foxglove]
    try:
        from farside.logs.layouts.rerun import write_blueprint
    except ImportError:
        return [foxglove]
    write_blueprint(rerun)
    return [foxglove, rerun]


def _shown(path: Path) -> str:
    return printable(str(path))
