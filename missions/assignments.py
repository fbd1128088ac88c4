"""Assignments to keys of a mission file: `--set key=value`, and the same from Python.

A key is dotted, with indices into arrays counted from 0: `link.blackouts.0.end_s`.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, NamedTuple

from farside.files import MAX_KEY_PARTS, parse_toml
from farside.validation import Key, Problem, dotted, one_line, shown


class Assignment(NamedTuple):
    """A value for a key of a mission file.

    Attributes:
        key: the parts of the dotted key.
        value: the value, in the types of TOML.
        origin: how the user gave it, for error messages.
    """

    key: Key
    value: object
    origin: str

    def touches(self, key: Key) -> bool:
        """Whether the assignment sets the value at `key`, part of it, or a table around it."""
        return all(mine == other for mine, other in zip(self.key, key, strict=False))


def read_assignments(given: Sequence[str] | Mapping[str, object]) -> list[Assignment]:
    """Parse assignments, keeping their order.

    Args:
        given: `key=value` strings, the value in TOML, a bare word or `null`; or values by dotted
            key.

    Raises:
        ValueError: if a string is not `key=value`, or its value starts like TOML but is invalid.
    """
    if isinstance(given, Mapping):
        return [_from_python(key, value) for key, value in given.items()]
    return [_from_text(text) for text in given]


def _from_text(text: str) -> Assignment:
    origin = f"--set {one_line(text)}"
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals):
        missing = "key" if equals else "="
        raise ValueError(f"{origin}: expected KEY=VALUE, found no {missing}")
    try:
        parts = _parts(key)
    except ValueError as error:
        raise ValueError(f"{origin}: {error}") from error
    try:
        return Assignment(parts, _toml_value(value), origin)
    except ValueError as error:
        raise ValueError(f"{origin}: expected a TOML value, found: {error}") from error


def _from_python(key: str, value: object) -> Assignment:
    origin = f"{one_line(key)} set from Python"
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
    """`text` as a TOML value; a bare string unless it starts like an array, table or string.

    TOML has no `null`, which removes a key of the link; here it is one.
    """
    if text == "null":
        return None
    try:
        table = parse_toml(f"value = {text}")
    except ValueError as error:
        if text.startswith(("[", "{", '"', "'")):
            reason, _, _ = str(error).partition(" (at ")  # a position in the line made up here
            raise ValueError(reason) from error
        return text
    return table["value"] if len(table) == 1 else text


def _plain(value: object) -> object:
    """A copy of `value` in the types of TOML."""
    match value:
        case Mapping():
            return {str(key): _plain(entry) for key, entry in value.items()}
        case list() | tuple():
            return [_plain(entry) for entry in value]
        case _:
            return value


def assign(assignment: Assignment, data: dict[str, Any]) -> None:
    """Set the value in `data`, creating missing tables on the way.

    Args:
        assignment: the key and the value.
        data: the parsed mission file, changed in place.

    Raises:
        ValueError: if the key goes past the end of an array or through a plain value.
    """
    *path, last = assignment.key
    container: Any = data
    for part in path:
        index = _index(container, part)
        if isinstance(container, dict):
            container = container.setdefault(index, {})
        else:
            container = container[index]
    container[_index(container, last)] = assignment.value


def as_layer(assignment: Assignment, data: Mapping[str, Any]) -> dict[str, Any]:
    """The table that makes the assignment when it is laid over `data`; an array is laid as a whole.

    Raises:
        ValueError: as `assign`.
    """
    changed: Any = deepcopy(dict(data))
    assign(assignment, changed)
    layer: dict[str, Any] = {}
    part = layer
    *path, last = assignment.key
    for name in path:
        changed = changed[name]
        if not isinstance(changed, dict):
            part[name] = changed
            return layer
        part[name] = part = {}
    part[last] = assignment.value
    return layer


def origin_of(problem: Problem, made: Sequence[Assignment]) -> str:
    """The last assignment that has to do with a problem, in brackets; empty without one."""
    origins = [one.origin for one in made if one.touches(problem.key)]
    return f" (with {origins[-1]})" if origins else ""


def _index(container: object, part: str) -> Any:
    """The key of a table, or the index into an array, that `part` of a dotted key stands for."""
    name = dotted((part,))
    match container:
        case dict():
            return part
        case list() if part.isdecimal() and int(part) < len(container):
            return int(part)
        case list():
            raise ValueError(f"expected an index into an array of {len(container)}, found {name}")
        case _:
            raise ValueError(
                f"expected a table or an array around {name}, found {shown(container)}"
            )
