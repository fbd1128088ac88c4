"""Where two runs part, on the terminal."""

from itertools import islice

import msgspec
from rich.console import Console
from rich.text import Text

from farside.escaping import printable
from farside.logs.diff.parting import MISSING, Parting, Seen
from farside.validation import one_line

_MOST_FIELDS = 12
_LENGTH = 160


def show_parting(parting: Parting, names: tuple[str, str], console: Console) -> None:
    """Print where two rows of records part, and in which fields.

    Args:
        parting: where.
        names: what to call either row.
        console: where to print.
    """

    def tell(text: str) -> None:
        console.print(plain(text), soft_wrap=True)

    tell(f"the first that differs, at {parting.t_s:g} s in {parting.topic}:")
    for line in sides(parting, names):
        tell(line)
    fields = list(parting.fields()) if parting.is_one_record else []
    for key, one, other in islice(fields, _MOST_FIELDS):
        tell(f"  {key or 'the message'}: {value_text(one)} | {value_text(other)}")
    if len(fields) > _MOST_FIELDS:
        tell(f"  and {len(fields) - _MOST_FIELDS} more fields")


def sides(parting: Parting, names: tuple[str, str]) -> list[str]:
    """Both records in a line each; with the time where that is not when they part."""
    width = max(map(len, names))
    pairs = zip(names, (parting.first, parting.second), strict=True)
    return [f"  {name:{width}}  {_seen(seen, parting)}" for name, seen in pairs]


def plain(text: str) -> Text:
    """Text from a log, as it may be printed."""
    return Text(printable(text))


def value_text(value: object) -> str:
    """A value of JSON in one line."""
    if value is MISSING or value is None:
        return "none"
    return one_line(msgspec.json.encode(value).decode(), _LENGTH)


def _seen(seen: Seen | None, parting: Parting) -> str:
    if seen is None:
        return "nothing more of this"
    later = "" if seen.t_s == parting.t_s else f"nothing yet; at {seen.t_s:.2f} s: "
    return later + seen.text
