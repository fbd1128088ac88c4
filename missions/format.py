"""The format of mission files as JSON Schema, for editors and for `docs/mission.md`."""

import inspect
import re
from collections.abc import Iterator
from typing import Any

import msgspec

from farside.missions.schema import MissionFile

_DIALECT = "http://json-schema.org/draft-07/schema#"  # the newest that TOML editors read
_ATTRIBUTES = re.compile(r"^Attributes:\n((?: +.*\n?|\n)+)", re.MULTILINE)
_ATTRIBUTE = re.compile(r"^    (\w[\w, ]*): ((?:.+\n?)(?:^      +.+\n?)*)", re.MULTILINE)


def mission_schema() -> dict[str, Any]:
    """The JSON Schema of a mission file.

    What it cannot say, `farside check` does: rules between keys, and whether a place is on the map.
    """
    kinds = {kind.__name__: kind for kind in _structs(msgspec.inspect.type_info(MissionFile))}
    (top,), definitions = msgspec.json.schema_components(
        [MissionFile], ref_template="#/definitions/{name}"
    )
    for name, definition in definitions.items():
        if kind := kinds.get(name):
            definition["description"] = summary(kind)
            for key, text in key_texts(kind).items():
                definition["properties"][key]["description"] = text
    return {"$schema": _DIALECT, **_plain({**top, "definitions": definitions})}


def summary(kind: type) -> str:
    """What a table is, from its docstring: all before the first section."""
    text = inspect.cleandoc(kind.__doc__ or "")
    return _one_line(re.split(r"^(?:Attributes|Raises):$", text, flags=re.MULTILINE)[0])


def key_texts(kind: type) -> dict[str, str]:
    """What each key of a table means, from the attributes in its docstring or an older kind's."""
    older = [base for base in kind.__bases__ if issubclass(base, msgspec.Struct)]
    inherited = {key: text for base in older for key, text in key_texts(base).items()}
    section = _ATTRIBUTES.search(inspect.cleandoc(kind.__doc__ or "") + "\n")
    return inherited | {
        name.strip(): _one_line(text)
        for names, text in _ATTRIBUTE.findall(section.group(1) if section else "")
        for name in names.split(",")
    }


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _structs(schema: msgspec.inspect.Type) -> Iterator[type]:
    """The tables in a type, also those within each other."""
    match schema:
        case msgspec.inspect.StructType():
            yield schema.cls
            for field in schema.fields:
                yield from _structs(field.type)
        case msgspec.inspect.UnionType():
            for kind in schema.types:
                yield from _structs(kind)
        case msgspec.inspect.VarTupleType():
            yield from _structs(schema.item_type)
        case msgspec.inspect.Metadata():
            yield from _structs(schema.type)


def _plain(schema: Any) -> Any:
    """`schema` without what TOML does not have, null, and with patterns as editors read them."""
    match schema:
        case {"anyOf": list(kinds), **rest} if {"type": "null"} in kinds:
            left = [kind for kind in kinds if kind != {"type": "null"}]
            return _plain({**rest, **(left[0] if len(left) == 1 else {"anyOf": left})})
        case dict():
            return {
                key: value.replace(r"\Z", "$") if key == "pattern" else _plain(value)
                for key, value in schema.items()
                if not (key == "default" and value is None)
            }
        case list() | tuple():
            return [_plain(entry) for entry in schema]
        case _:
            return schema
