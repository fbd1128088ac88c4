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


def show_parting(parting: Parting, first: str, second: str, console: Console) -> None:
    """Print where two rows of records part.

    Args:
        parting: where.
        first, second: what to call either row.
        console: where to print.
    """
    width = max(len(first), len(second))

    def tell(text: str) -> None:
        console.print(plain(text), soft_wrap=True)

    tell(f"the first that differs, at {parting.t_s:g} s in {parting.topic}:")
    for name, seen in ((first, parting.first), (second, parting.second)):
        tell(f"  {name:{width}}  {seen_text(seen, parting)}")
    fields = list(parting.fields()) if parting.is_one_record else []
    for key, one, other in islice(fields, _MOST_FIELDS):
        tell(f"  {key or 'the message'}: {value_text(one)} {first}, {value_text(other)} {second}")
    if len(fields) > _MOST_FIELDS:
        tell(f"  and {len(fields) - _MOST_FIELDS} more fields")


def seen_text(seen: Seen | None, parting: Parting) -> str:
    """A record in one line; with topic and time where they are not those of the parting."""
    if seen is None:
        return "nothing more"
    other = (seen.topic, seen.t_s) != (parting.topic, parting.t_s)
    where = f"{seen.topic} at {seen.t_s:g} s: " if other else ""
    text = seen.text or msgspec.json.encode(seen.message).decode()
    return where + one_line(text, _LENGTH)


def plain(text: str) -> Text:
    """Text from a log, as it may be printed."""
    return Text(printable(text))


def value_text(value: object) -> str:
    """A value of JSON in one line."""
    if value is MISSING:
        return "nothing"
    return one_line(msgspec.json.encode(value).decode(), _LENGTH)
