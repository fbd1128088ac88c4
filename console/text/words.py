"""What a screen says as text of a terminal: tones, values with their ages, rows of a width.

Colour is never alone: a tone has a mark, and a stale value stands in brackets.
"""

from collections.abc import Iterable, Iterator, Sequence
from io import StringIO

from rich.console import Console
from rich.text import Text

from farside.console.screen.screen import Said, Tone
from farside.escaping import printable

DIM, BOLD = "bright_black", "bold"

STYLES = {
    Tone.PLAIN: "",
    Tone.WORD: "bold cyan",
    Tone.CAUTION: "yellow",
    Tone.WRONG: "bold red",
}
"""The colour of each tone."""

MARKS = {Tone.PLAIN: "", Tone.WORD: "▸ ", Tone.CAUTION: "! ", Tone.WRONG: "!! "}
"""What stands before a text of each tone, so that it is seen without colours too."""

_BETWEEN = " · "
_CONSOLE = Console(file=StringIO(), color_system=None)


def told(text: str, tone: Tone = Tone.PLAIN, *, style: str = "") -> Text:
    """A text in its tone, with its mark; whatever could steer a terminal is escaped."""
    return Text(MARKS[tone] + printable(text), style=STYLES[tone] or style)


def said(value: Said) -> Text:
    """A value with its name; one that is stale stands in brackets."""
    text = printable(value.text)
    word = Text(f"[{text}]" if value.stale else text, style=STYLES[value.tone])
    name = Text(f"{printable(value.name)} " if value.name else "", style=DIM)
    return Text.assemble((MARKS[value.tone], STYLES[value.tone]), name, word)


def joined(parts: Iterable[Text], between: str = _BETWEEN) -> Text:
    """Texts one after the other."""
    return Text(between, style=DIM).join(part for part in parts if part.plain)


def wrapped(text: Text, width: int, most: int | None = None, *, hang: int = 0) -> list[Text]:
    """A text in rows of a width.

    Args:
        text: the text.
        width: columns.
        most: the most rows; the last one then says by an ellipsis that there was more.
        hang: by how many columns every row after the first stands in.
    """
    rows: list[Text] = []
    rest = text
    while rest.plain and len(rows) != most:
        stands_in = hang if rows else 0
        room = max(width - stands_in, 1)
        row = rest if len(rows) + 1 == most else rest.wrap(_CONSOLE, room)[0]
        rest = rest[len(row) :]
        rest = rest[len(rest.plain) - len(rest.plain.lstrip()) :]
        row.pad_left(stands_in)
        rows.append(line(row, width))
    return rows


def line(text: Text, width: int) -> Text:
    """A text in one row, cut with an ellipsis where it is longer."""
    text.no_wrap = True
    text.truncate(width, overflow="ellipsis")
    return text


def flowing(parts: Iterable[Text], width: int, between: str = " ") -> list[Text]:
    """Parts in as many rows as they need in `width` columns; none is broken in two."""
    rows: list[Text] = []
    for part in parts:
        if rows and rows[-1].cell_len + len(between) + part.cell_len <= width:
            rows[-1].append(between).append_text(part)
        else:
            rows.append(part.copy())
    return [line(row, width) for row in rows]


def filled(rows: Sequence[Text], height: int) -> Iterator[Text]:
    """Exactly `height` rows: the first ones, or blank ones after them."""
    yield from rows[:height]
    yield from (Text() for _ in range(height - len(rows)))
