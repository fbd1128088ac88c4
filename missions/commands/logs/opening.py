"""The run that a command opens with the options `--as ground --at S`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.logs.finding import damage_told, log_named
from farside.missions.commands.values import Who

if TYPE_CHECKING:
    from farside.logs import RunView


At = Annotated[
    float | None,
    typer.Option("--at", metavar="S", help="By when, in simulated seconds; with --as ground."),
]
"""The option `--at S`, which goes with `--as ground`."""


def run_of(
    context: typer.Context, path: Path | None, as_: Who | None, at: float | None
) -> "RunView":
    """The run in the log that is named, or in the newest, as it was or as the ground had it.

    What is missing from it is told when the command ends.

    Raises:
        LogError: if there is none, or it cannot be read.
        typer.BadParameter: if `at` is no time, or stands without `as_`.
    """
    from farside.logs import open as open_log

    try:
        run = open_log(log_named(path), as_ground=as_ is not None, until_s=at)
    except ValueError as error:
        hint = "--at"
        if as_ is None:
            raise typer.BadParameter("expected it with --as ground", param_hint=hint) from error
        raise typer.BadParameter(str(error), param_hint=hint) from error
    damage_told(context, run.file)
    return run
