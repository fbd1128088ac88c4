"""`farside export`."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.failures import print_error
from farside.missions.commands.logs.opening import At, run_of
from farside.missions.commands.values import As
from farside.validation import did_you_mean, shown

if TYPE_CHECKING:
    from farside.logs import RunView
    from farside.node import Topic


class _Format(StrEnum):
    PARQUET = "parquet"
    CSV = "csv"


def export_log(
    context: typer.Context,
    log: Annotated[
        Path | None,
        typer.Argument(metavar="LOG", help="Log of a run; the newest where none is named."),
    ] = None,
    form: Annotated[_Format, typer.Option("--format", help="How tables are written.")] = (
        _Format.PARQUET
    ),
    topic: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only this topic, such as /rover/mode; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for the tables; by default beside the log, by its name."
        ),
    ] = None,
    as_: As = None,
    at: At = None,
) -> None:
    """Write a log as tables, one for each topic that has messages.

    Units stand in the names of the columns. What is nested is laid out flat; lists stay lists, in
    CSV as JSON.

    \b
    farside export logs/runs/blackout-seed1-1.mcap
    farside export --format csv --topic /rover/mode --out tables
    farside export --as ground --at 700
    """
    try:
        from farside.logs.tables.writing import Format, write_tables  # an extra
    except ModuleNotFoundError as error:
        raise typer.BadParameter(
            f"expected pyarrow to write tables, found no {error.name}: "
            "pip install 'farside[tables]'"
        ) from error
    run = run_of(context, log, as_, at)
    topics = [_topic(name, run) for name in topic or ()]
    folder = run.path.with_suffix("") if out is None else out
    with patience("writing the tables"):
        written = write_tables(run.file, folder, Format(form), topics)
    for table in written:
        print(f"{printable(str(table.path))}: {table.rows} rows")  # noqa: T201
    if not written:
        print_error(f"{run.path}: no messages, and so no tables")


def _topic(name: str, run: "RunView") -> "Topic[Any]":
    from farside.topics import TOPICS

    if name not in TOPICS:
        hint = did_you_mean(name, TOPICS)
        raise typer.BadParameter(
            f"expected a topic of the log, found {shown(name)}{hint}", param_hint="--topic"
        )
    if run.is_as_ground and not name.startswith("/ground/"):
        raise typer.BadParameter(f"not known at the ground: {name}", param_hint="--topic")
    return TOPICS[name]
