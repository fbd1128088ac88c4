"""Compares a mission file or link profile with its schema, and puts mismatches into words."""

import difflib
import json
import operator
import re
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple, TypeGuard

import msgspec
from msgspec import inspect

from farside.escaping import printable

Key = tuple[str, ...]
"""The path to a value from the top of the file; arrays are indexed from 0."""

_GREATEST = 1e9  # in s, m, J, …: no mission needs more, and 1e9 s in nanoseconds fit 64 bits
_GREATEST_WHOLE = 2**63 - 1  # the greatest that TOML promises
_SHOWN_LENGTH = 60
_PATH_LENGTH = 300

MAX_ENTRIES = 10_000
"""The most entries of an array in a mission file or link profile (project default)."""

MAX_POINTS = 100_000
"""The most entries of a measured table, such as a `delay_table` (project default)."""

MEASURED = msgspec.Meta(extra={"entries": MAX_POINTS})
"""Marks the type of an array that may have up to `MAX_POINTS` entries."""

MAX_PROBLEMS = 100
"""The most mistakes in one file that are told at once (project default)."""

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")

_Number = inspect.IntType | inspect.FloatType


class Problem(NamedTuple):
    """A mistake at `key`, worded "expected …, found …"."""

    key: Key
    text: str


class _Bound(NamedTuple):
    sign: str
    limit: float
    holds: Callable[[float, float], bool]


def dotted(key: Key) -> str:
    """`key` as it is written for `--set`; parts that TOML would quote are quoted."""
    return ".".join(one_line(part) if _BARE_KEY.fullmatch(part) else shown(part) for part in key)


def one_line(text: str, most: int = _SHOWN_LENGTH) -> str:
    """`printable` text fit for one line, cut after `most` characters."""
    line = printable(text[: most + 1])
    return line if len(line) <= most else line[:most] + "…"


def shown(value: object) -> str:
    """`value` as TOML writes it, abbreviated where that would be long."""
    match value:
        case dict():
            return "a table"
        case list():
            return "an array"
        case str():
            return one_line(json.dumps(value, ensure_ascii=False))
        case None | bool():
            return json.dumps(value)
        case int() if value.bit_length() > 64:
            return f"a whole number of {value.bit_length()} bits"
        case _:
            return one_line(str(value))


def shown_path(path: str) -> str:
    """A path in quotes; longer than other values, for its end tells the most."""
    return one_line(json.dumps(path, ensure_ascii=False), _PATH_LENGTH)


def did_you_mean(found: str, known: Iterable[str]) -> str:
    """A suggestion of the known name nearest to `found`; empty where none is near."""
    if len(found) > _SHOWN_LENGTH:
        return ""
    folded = {name.casefold(): name for name in known}
    near = difflib.get_close_matches(found.casefold(), folded, n=1, cutoff=0.4)
    return f"; did you mean {folded[near[0]]}?" if near else ""


def mismatches(data: object, schema: inspect.Type, key: Key = ()) -> Iterator[Problem]:
    """Every way in which `data` does not match `schema`.

    Args:
        data: the file's value at `key`, tables as dicts and arrays as lists.
        schema: from `msgspec.inspect.type_info`.
        key: where `data` stands.
    """
    match schema:
        case inspect.Metadata(type=inspect.VarTupleType() as array) if isinstance(data, list):
            most = (schema.extra or {}).get("entries", MAX_ENTRIES)
            yield from _in_array(data, array, key, most)
        case inspect.Metadata():
            yield from mismatches(data, schema.type, key)
        case inspect.UnionType():
            yield from _in_union(data, schema, key)
        case inspect.StructType() if isinstance(data, dict):
            yield from _in_table(data, schema, key)
        case inspect.VarTupleType() if isinstance(data, list):
            yield from _in_array(data, schema, key, MAX_ENTRIES)
        case inspect.DictType() if isinstance(data, dict):
            for name, entry in data.items():
                yield from _option((*key, name), entry, schema)
        case _ if not _fits(data, schema):
            hint = did_you_mean(data, _choices(schema)) if isinstance(data, str) else ""
            yield Problem(key, f"expected {_expected(schema, data)}, found {shown(data)}{hint}")


def named(
    what: str, data: object, schema: inspect.Type, key: Key = ()
) -> Iterator[tuple[Key, str]]:
    """Every string in `data` that names a `what`, such as a place, with its key.

    The types of such strings are marked by `Meta(extra={"names": what})`.

    Args:
        what: the kind of thing named.
        data: the file's value at `key`, which matches `schema`.
        schema: from `msgspec.inspect.type_info`.
        key: where `data` stands.
    """
    match schema:
        case inspect.Metadata() if isinstance(data, str) and schema.extra == {"names": what}:
            yield key, data
        case inspect.UnionType():
            for kind in schema.types:
                if not isinstance(kind, inspect.StructType) or _is_of(data, kind):
                    yield from named(what, data, kind, key)
        case inspect.StructType() if isinstance(data, dict):
            for field in schema.fields:
                if field.encode_name in data:
                    inner = (*key, field.encode_name)
                    yield from named(what, data[field.encode_name], field.type, inner)
        case inspect.VarTupleType() if isinstance(data, list):
            for index, entry in enumerate(data):
                yield from named(what, entry, schema.item_type, (*key, str(index)))


def _in_array(
    data: list[object], schema: inspect.VarTupleType, key: Key, most: int
) -> Iterator[Problem]:
    if len(data) > most:
        yield Problem(key, f"expected at most {most} entries, found {len(data)}")
        return
    for index, entry in enumerate(data):
        yield from mismatches(entry, schema.item_type, (*key, str(index)))


def _is_of(data: object, table: inspect.StructType) -> bool:
    """Whether `data` is a table of this kind, by its tag if the kind has one."""
    return isinstance(data, dict) and (
        table.tag_field is None or data.get(table.tag_field) == table.tag
    )


def _in_union(data: object, schema: inspect.UnionType, key: Key) -> Iterator[Problem]:
    """The mismatches of an optional value, or of a table of one of several kinds."""
    kinds = [kind for kind in schema.types if not isinstance(kind, inspect.NoneType)]
    structs = [kind for kind in kinds if isinstance(kind, inspect.StructType)]
    if structs and isinstance(data, dict):
        tagged = {str(kind.tag): kind for kind in structs if kind.tag is not None}
        if tagged:
            yield from _in_tagged(data, tagged, key)
        else:
            yield from _in_table(data, structs[0], key)
    elif isinstance(data, list) and (arrays := _arrays(kinds)):
        yield from mismatches(data, arrays[0], key)
    elif data is None and schema.includes_none:
        pass
    elif len(plain := [kind for kind in kinds if kind not in structs]) > 1:
        if not any(_fits(data, kind) for kind in plain):
            yield Problem(key, f"expected {_any_of(plain)}, found {shown(data)}")
    else:
        yield from mismatches(data, kinds[0], key)


def _arrays(kinds: Iterable[inspect.Type]) -> list[inspect.Type]:
    return [kind for kind in kinds if isinstance(kind, inspect.VarTupleType)]


def _any_of(kinds: Iterable[inspect.Type]) -> str:
    return " or ".join(dict.fromkeys(map(_expected, kinds)))


def _option(key: Key, data: object, schema: inspect.DictType) -> Iterator[Problem]:
    """What is wrong with an entry of a table whose keys are the user's own."""
    if not _fits(key[-1], _bare(schema.key_type)):
        yield Problem(key, f"expected a name of letters, digits and _, found {dotted(key[-1:])}")
    yield from mismatches(data, schema.value_type, key)


def _in_tagged(
    data: dict[str, object], tables: dict[str, inspect.StructType], key: Key
) -> Iterator[Problem]:
    tag_field = str(next(iter(tables.values())).tag_field)
    tag = data.get(tag_field)
    if isinstance(tag, str) and tag in tables:
        yield from _in_table(data, tables[tag], key)
        return
    found = shown(tag) if tag_field in data else "no such key"
    hint = did_you_mean(tag, tables) if isinstance(tag, str) else ""
    yield Problem((*key, tag_field), f"expected {_one_of(tables)}, found {found}{hint}")


def _in_table(data: dict[str, object], schema: inspect.StructType, key: Key) -> Iterator[Problem]:
    fits = True
    for problem in _in_parts(data, schema, key):
        fits = False
        yield problem
    if fits:
        yield from _as_a_whole(data, schema.cls, key)


def _in_parts(data: dict[str, object], schema: inspect.StructType, key: Key) -> Iterator[Problem]:
    fields = {field.encode_name: field for field in schema.fields}
    for name in data:
        if name not in fields and name != schema.tag_field:
            yield _unknown((*key, name), fields)
    for name, field in fields.items():
        if name in data:
            yield from mismatches(data[name], field.type, (*key, name))
        elif field.required:
            text = f"expected {_expected(_bare(field.type))}, found no such key"
            yield Problem((*key, name), text)


def _as_a_whole(data: dict[str, object], table: type, key: Key) -> list[Problem]:
    """Violations of the rules between the keys of a table, from its `__post_init__`."""
    try:
        msgspec.convert(data, table)
    except msgspec.ValidationError as error:
        return [Problem(key, str(error))]
    return []


def _unknown(key: Key, known: Iterable[str]) -> Problem:
    names = ", ".join(known)
    expected = f"one of the keys {names}" if names else "no further key"
    hint = did_you_mean(key[-1], known)
    return Problem(key, f"expected {expected}, found {dotted(key[-1:])}{hint}")


def _choices(schema: inspect.Type) -> list[str]:
    if isinstance(schema, inspect.EnumType):
        return [choice.value for choice in schema.cls]
    return []


def _one_of(choices: Iterable[str]) -> str:
    return "one of " + ", ".join(map(shown, choices))


def _fits(data: object, schema: inspect.Type) -> bool:
    match schema:
        case inspect.IntType() | inspect.FloatType():
            bounds = _bounds(schema, data)
            return _is_number(data, schema) and all(b.holds(data, b.limit) for b in bounds)
        case inspect.StrType():
            is_text = isinstance(data, str) and len(data) >= (schema.min_length or 0)
            return is_text and bool(re.search(schema.pattern or "", str(data)))
        case inspect.EnumType():
            return data in _choices(schema)
        case inspect.BoolType():
            return isinstance(data, bool)
        case _:
            return False


def _is_number(data: object, schema: _Number) -> TypeGuard[float]:
    kinds = int if isinstance(schema, inspect.IntType) else int | float
    return isinstance(data, kinds) and not isinstance(data, bool)


def _bounds(schema: _Number, data: object) -> list[_Bound]:
    """The bounds of a number: the schema's, and the overall maximum if `data` exceeds it."""
    greatest = _GREATEST_WHOLE if isinstance(schema, inspect.IntType) else _GREATEST
    beyond = _is_number(data, schema) and not abs(data) <= greatest
    bounds = (
        (">", schema.gt, operator.gt),
        (">=", schema.ge, operator.ge),
        ("<", schema.lt, operator.lt),
        ("<=", greatest if schema.le is None and beyond else schema.le, operator.le),
    )
    return [_Bound(sign, limit, holds) for sign, limit, holds in bounds if limit is not None]


def _bare(schema: inspect.Type) -> inspect.Type:
    return schema.type if isinstance(schema, inspect.Metadata) else schema


def _expected(schema: inspect.Type, data: object = None) -> str:
    """What `schema` expects, in words that show what is wrong with `data`."""
    match schema:
        case inspect.IntType() | inspect.FloatType():
            kind = "a whole number" if isinstance(schema, inspect.IntType) else "a number"
            bounds = " and ".join(f"{sign} {limit:g}" for sign, limit, _ in _bounds(schema, data))
            return f"{kind} {bounds}".strip()
        case inspect.StrType():
            text = f"text of length >= {schema.min_length}" if schema.min_length else "text"
            return f"text that matches {schema.pattern}" if schema.pattern else text
        case inspect.EnumType():
            return _one_of(_choices(schema))
        case inspect.BoolType():
            return "true or false"
        case inspect.VarTupleType():
            return "an array"
        case _:
            return "a table"
