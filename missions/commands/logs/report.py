"""`farside report`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience


class Who(StrEnum):
    """From whose side a log is read."""

    GROUND = "ground"


def report_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The page; beside the log where it is not given."),
    ] = None,
    as_: Annotated[
        Who | None,
        typer.Option("--as", metavar="WHO", help="'ground': nothing but what the ground knew."),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="S",
            help="With --as ground: what it knew at this simulated time, in seconds.",
        ),
    ] = None,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Show the page in a browser.")
    ] = False,
) -> None:
    """Make one page of a log: what happened, drawn.

    The page needs no network and no other file. Its slider moves all views together, and its
    switch shows what the ground knew at the slider's time.

    \b
    farside report logs/runs/blackout-seed1-1.mcap
    farside report logs/runs/blackout-seed1-1.mcap --out blackout.html --open
    farside report logs/runs/blackout-seed1-1.mcap --as ground --at 700
    """
    from farside.logs import LogFile
    from farside.logs.report.page import report_page
    from farside.node import to_ns, to_s

    if at is not None and as_ is None:
        raise typer.BadParameter("expected --as ground with it", param_hint="--at")
    with patience("making the page"):
        file = LogFile(log)
        if at is not None and to_ns(at) > file.end_ns:
            raise typer.BadParameter(
                f"expected a time within the run, 0 to {to_s(file.end_ns):.1f} s, found {at:g} s",
                param_hint="--at",
            )
        if as_ is not None:
            file = file.as_ground(None if at is None else to_ns(at))
        page = report_page(file)
    target = log.with_suffix(".html") if out is None else out
    target.write_text(page, encoding="utf-8")
    print(printable(str(target)))  # noqa: T201
    if open_:
        typer.launch(str(target))
