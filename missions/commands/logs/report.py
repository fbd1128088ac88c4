"""`farside report`."""

import gc
from pathlib import Path
from typing import Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.logs.opening import At, run_of
from farside.missions.commands.values import As
from farside.validation import shown


def report_log(
    context: typer.Context,
    log: Annotated[
        Path | None,
        typer.Argument(metavar="LOG", help="Log of a run; the newest where none is named."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The page; beside the log where it is not given."),
    ] = None,
    as_: As = None,
    at: At = None,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Show the page in a browser.")
    ] = False,
) -> None:
    """Make one page of a log: what happened, drawn.

    The page needs no network and no other file. Its slider moves all views together, and its
    switch shows what the ground knew at the slider's time.

    \b
    farside report logs/runs/blackout-seed1-1.mcap
    farside report --out blackout.html --open
    farside report --as ground --at 700
    """
    from farside.logs.report import report_page

    run = run_of(context, log, as_, at)
    target = run.path.with_suffix(".html") if out is None else out
    if target.exists() and target.samefile(run.path):
        expected = f"expected another file than the log, found {shown(str(target))}"
        raise typer.BadParameter(expected, param_hint="--out")
    # What is gathered from a day's log has no circles, and looking for some takes an eighth more.
    gc.disable()
    try:
        with patience("making the page"):
            page = report_page(run.file)
    finally:
        gc.enable()
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(page, encoding="utf-8")
    print(printable(str(target)))  # noqa: T201
    if open_:
        typer.launch(str(target))
