"""Values that replace those of a mission file: `--set key=value`, and the same from Python."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from farside.files import MAX_KEY_PARTS, parse_toml
from farside.validation import Key, dotted, one_line, shown


class Assignment(NamedTuple):
    """A value to put at `key`; `origin` is how the user gave it."""

    key: Key
    value: object
    origin: str

    def touches(self, key: Key) -> bool:
        """Whether the override set what is at `key`, something in it, or something around it."""
        return all(mine == other for mine, other in zip(self.key, key, strict=False))


def read_overrides(given: Sequence[str] | Mapping[str, object]) -> list[Assignment]:
    """The overrides in `given`, in order.

    Args:
        given: texts `key=value`, the value in TOML or a bare word; or values by dotted key.

    Raises:
        ValueError: if a text is no `key=value`, or its value looks like TOML and is not.
    """
    if isinstance(given, Mapping):
        return [_from_python(key, value) for key, value in given.items()]
    return [_from_text(text) for text in given]


def _from_text(text: str) -> Assignment:
    origin = f"--set {one_line(text)}"
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals):
        raise ValueError(f"{origin}: expected KEY=VALUE, such as link.up.loss=0.2")
    try:
        parts = _parts(key)
    except ValueError as error:
        raise ValueError(f"{origin}: {error}") from error
    try:
        return Assignment(parts, _toml_value(value), origin)
    except ValueError as error:
        raise ValueError(f"{origin}: expected a TOML value, found: {error}") from error


def _from_python(key: str, value: object) -> Assignment:
    origin = f"override {one_line(key)}"
    try:
        return Assignment(_parts(key), _plain(value), origin)
    except RecursionError as error:
        raise ValueError(f"{origin}: expected values that are not nested so deeply") from error
    except ValueError as error:
        raise ValueError(f"{origin}: {error}") from error


def _parts(key: str) -> Key:
    """The parts of a dotted key."""
    parts = tuple(key.split("."))
    if len(parts) > MAX_KEY_PARTS:
        raise ValueError(f"expected a key of at most {MAX_KEY_PARTS} parts, found {len(parts)}")
    return parts


def _toml_value(text: str) -> object:
    """`text` as TOML; as it is where it does not even start like a value of several words."""
    try:
        table = parse_toml(f"value = {text}")
    except ValueError as error:
        if text.startswith(("[", "{", '"', "'")):
            reason, _, _ = str(error).partition(" (at ")  # the place is one in our line
            raise ValueError(reason) from error
        return text
    return table["value"] if len(table) == 1 else text


def _plain(value: object) -> object:
    """A copy of `value` in the types that TOML gives."""
    match value:
        case Mapping():
            return {str(key): _plain(entry) for key, entry in value.items()}
        case list() | tuple():
            return [_plain(entry) for entry in value]
        case _:
            return value


def put(override: Assignment, data: dict[str, Any]) -> None:
    """Put the override into `data`, making the tables on the way that are not there.

    Raises:
        ValueError: if its key goes past the end of an array, or through a plain value.
    """
    *way, last = override.key
    place: Any = data
    for part in way:
        slot = _slot(place, part)
        place = place.setdefault(slot, {}) if isinstance(place, dict) else place[slot]
    place[_slot(place, last)] = override.value


def _slot(place: object, part: str) -> Any:
    name = dotted((part,))
    match place:
        case dict():
            return part
        case list() if part.isdecimal() and int(part) < len(place):
            return int(part)
        case list():
            raise ValueError(f"expected an index into an array of {len(place)}, found {name}")
        case _:
            raise ValueError(f"expected a table or an array around {name}, found {shown(place)}")
