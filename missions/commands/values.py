"""Values of options that several commands take, read from the command line."""

import math
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Annotated

import typer


class Who(StrEnum):
    """As whom a log is looked at."""

    GROUND = "ground"


As = Annotated[
    Who | None,
    typer.Option("--as", metavar="WHO", help="'ground': only what the ground had learned."),
]
"""The option `--as ground`."""

Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Set a value of the mission file."),
]
"""The option `--set` of commands that run or check a mission."""

Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]
"""The option `--json` of commands that come to a result."""


def completing(words: Mapping[str, str]) -> Callable[[str], list[tuple[str, str]]]:
    """Completes, in a shell, to one of these words; each is shown with what it means."""

    def complete(incomplete: str) -> list[tuple[str, str]]:
        return [(word, text) for word, text in words.items() if word.startswith(incomplete)]

    return complete


def pace_of(text: str) -> float:
    """Simulated seconds per wall second: a number above 0, or `max`.

    Raises:
        typer.BadParameter: if it is neither.
    """
    if text == "max":
        return math.inf
    try:
        pace = float(text)
    except ValueError:
        pace = math.nan
    if not pace > 0 or math.isinf(pace):
        raise typer.BadParameter(f"expected a number above 0, or 'max', found {text!r}")
    return pace
