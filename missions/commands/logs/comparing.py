"""`farside diff`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.display.patience import patience
from farside.missions.commands.logs.finding import damage_told
from farside.missions.commands.values import Json

if TYPE_CHECKING:
    from rich.console import Console

    from farside.logs.diff.comparing import Difference, Effect

DIFF_STATUS = "Exit status: 0 the runs are equal, record by record; 1 they differ; 2 bad input."
"""What `diff` ends with."""


def diff_logs(
    context: typer.Context,
    first: Annotated[Path, typer.Argument(metavar="A", help="Log of a run.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="Log of another run.")],
    json: Json = False,
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
        logs = damage_told(context, LogFile(first)), damage_told(context, LogFile(second))
        difference = compare(*logs)
    if json:
        print(msgspec.json.encode(difference).decode())  # noqa: T201
    else:
        _show(difference, Console())
    raise typer.Exit(0 if difference.equal else 1)


def _show(difference: "Difference", console: "Console") -> None:
    from farside.missions.commands.display.partings import (
        plain,
        show_parting,
        sides,
        value_text,
    )

    def tell(text: str = "") -> None:
        console.print(plain(text), soft_wrap=True)

    tell(f"A  {difference.first}")
    tell(f"B  {difference.second}")
    if difference.missions:
        tell()
        tell("their missions differ in:")
    for key in difference.missions:
        tell(f"  {key.key}" + (f", from {key.from_s:g} s on" if key.from_s else ""))
        for name, value in (("A", key.first), ("B", key.second)):
            tell(f"    {name}  {value_text(value)}")
    tell()
    if difference.parting is None:
        tell(f"equal: {difference.records} records")
        return
    tell(f"equal before they part: {difference.records} records")
    show_parting(difference.parting, ("A", "B"), console)
    if difference.effect is not None:
        _show_effect(difference.effect, console)
    tell()
    tell("when each thread of what happened parts:")
    for thread in difference.threads:
        tell(f"{thread.parting.t_s:9.2f} s  {thread.name}")
        for line in sides(thread.parting, ("A", "B")):
            tell(f"           {line}")
    _show_outcomes(difference, console)


def _show_effect(effect: "Effect", console: "Console") -> None:
    from farside.missions.commands.display.partings import plain

    console.print()
    console.print(plain(f"from there to another course in {effect.name}:"))
    for name, chain in (("A", effect.first), ("B", effect.second)):
        for link in chain:
            text = plain(f"  {name} {link.t_s:9.2f} s  {link.text}")
            if link.shared:
                text.append("  (in both)")
            console.print(text, soft_wrap=True)
        if not chain:
            console.print(plain(f"  {name}  nothing more of this"))


def _show_outcomes(difference: "Difference", console: "Console") -> None:
    from rich.table import Table

    from farside.missions.commands.display.partings import plain

    table = Table("what they came to", "A", "B", box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for row in difference.outcomes:
        table.add_row(*(plain(cell or "none") for cell in (row.what, row.first, row.second)))
    console.print()
    console.print(table)
