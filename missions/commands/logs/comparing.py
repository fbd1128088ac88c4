"""`farside diff`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.display.patience import patience

if TYPE_CHECKING:
    from rich.console import Console

    from farside.logs.diff.comparing import Difference

DIFF_STATUS = "Exit status: 0 the runs are equal, record by record; 1 they differ; 2 bad input."
"""What `diff` ends with."""


def diff_logs(
    first: Annotated[Path, typer.Argument(metavar="A", help="Log of a run.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="Log of another run.")],
    json: Annotated[
        bool, typer.Option("--json", help="Print the result as one JSON object.")
    ] = False,
) -> None:
    """Say where two runs part for the first time, and what came of it.

    In what their missions differ, key by key; the first record that differs, and what led to it;
    when each thread of what happened parts: frames, commands, modes, goals, deeds, what the ground
    knew; and how the outcomes differ.

    \b
    farside diff logs/runs/blackout-seed1-1.mcap logs/runs/blackout-seed2-1.mcap
    farside diff before.mcap after.mcap --json
    """
    import msgspec
    from rich.console import Console

    from farside.logs import LogFile
    from farside.logs.diff.comparing import compare

    with patience("comparing the logs"):
        difference = compare(LogFile(first), LogFile(second))
    if json:
        print(msgspec.json.encode(difference).decode())  # noqa: T201
    else:
        _show(difference, Console())
    raise typer.Exit(0 if difference.equal else 1)


def _show(difference: "Difference", console: "Console") -> None:
    from rich.table import Table

    from farside.missions.commands.display.partings import (
        plain,
        seen_text,
        show_parting,
        value_text,
    )

    def tell(text: str) -> None:
        console.print(plain(text), soft_wrap=True)

    tell(f"A  {difference.first}")
    tell(f"B  {difference.second}")
    if difference.missions:
        table = Table("mission", "from", "A", "B", box=None, pad_edge=False)
        for row in difference.missions:
            since = f"{row.from_s:g} s" if row.from_s else "start"
            cells = row.key, since, value_text(row.first), value_text(row.second)
            table.add_row(*map(plain, cells))
        console.print()
        console.print(table)
    console.print()
    if difference.parting is None:
        tell(f"equal: {difference.records} records")
        return
    tell(f"equal up to there: {difference.records} records")
    show_parting(difference.parting, "A", "B", console)
    for name, causes in (("A", difference.causes_first), ("B", difference.causes_second)):
        for cause in causes:
            tell(f"  {name}  {cause}")
    table = Table("parts at", "", "A", "B", box=None, pad_edge=False)
    for thread in difference.threads:
        parting = thread.parting
        sides = (seen_text(seen, parting) for seen in (parting.first, parting.second))
        table.add_row(f"{parting.t_s:.2f} s", plain(thread.name), *map(plain, sides))
    console.print()
    console.print(table)
    table = Table("came to", "A", "B", box=None, pad_edge=False)
    for row in difference.outcomes:
        table.add_row(*(plain(cell or "none") for cell in row))
    if table.row_count:
        console.print()
        console.print(table)
