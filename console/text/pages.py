"""Pages that cover the board while somebody reads them: the help, and everything in full."""

from collections.abc import Iterator
from enum import StrEnum

from rich.text import Text

from farside.console.screen.screen import Screen
from farside.console.text.blocks import (
    events_in_full,
    exercise_in_full,
    next_in_full,
    state_rows,
    status_rows,
    way_in_full,
    way_title,
)
from farside.console.text.keys import help_rows
from farside.console.text.words import BOLD, filled

_ALL = 1000  # rows: more than any state needs


class Page(StrEnum):
    """What can be read."""

    HELP = "help"
    ALL = "everything in full"


class Pages:
    """Which page is open, if any. The status stays above it.

    Attributes:
        shown: what is read, and which of its pages, from 0 on; `None` while none is open.
    """

    def __init__(self) -> None:
        self.shown: tuple[Page, int] | None = None

    def turn(self, page: Page, screen: Screen, width: int, height: int) -> None:
        """Open something, or go to its next page; after the last one it is closed."""
        number = self.shown[1] + 1 if self.shown is not None and self.shown[0] is page else 0
        room = _room(screen, width, height)
        # Its first page opens even if there is nothing to read.
        more = number == 0 or number * room < len(_rows(page, screen, width))
        self.shown = (page, number) if more else None

    def close(self) -> None:
        """Close what is open."""
        self.shown = None

    def rows(self, screen: Screen, width: int, height: int) -> list[Text]:
        """The page that is open, in so many rows."""
        page, number = self.shown if self.shown is not None else (Page.HELP, 0)
        room = _room(screen, width, height)
        shown = _rows(page, screen, width)[number * room :]
        return [*status_rows(screen, width), *filled(shown, room)]


def _room(screen: Screen, width: int, height: int) -> int:
    return max(height - len(status_rows(screen, width)), 1)


def _rows(page: Page, screen: Screen, width: int) -> list[Text]:
    return list(help_rows(width) if page is Page.HELP else _in_full(screen, width))


def _in_full(screen: Screen, width: int) -> Iterator[Text]:
    for title, rows in (
        ("NEXT", next_in_full(screen, width)),
        (way_title(screen).upper(), way_in_full(screen, width)),
        ("STATE", state_rows(screen, width, _ALL)),
        ("EVENTS", events_in_full(screen, width)),
        ("EXERCISE", exercise_in_full(screen, width)),
    ):
        if rows:
            yield Text(title, style=f"{BOLD} underline")
            yield from rows
