"""JSON Schemas of the topics, in a form that log viewers accept."""

from typing import Any

import msgspec

_Schema = dict[str, Any]

_SCALARS = frozenset({"boolean", "integer", "number", "string"})


def topic_schema(kind: type[msgspec.Struct]) -> bytes:
    """The JSON Schema of a message type, encoded.

    Foxglove requires an object at the top level. Lichtblick drops a topic if any property is a
    reference, a union, nullable, or an array of arrays. So the top level lists only the
    properties that every viewer accepts, and `allOf` refers to the complete type in `$defs`;
    viewers still show the other properties, as they find them in the messages.
    """
    schema = msgspec.json.schema(kind)
    definitions: dict[str, _Schema] = schema["$defs"]
    reference: str = schema["$ref"]
    whole = _resolved(schema, definitions)
    return msgspec.json.encode(
        {
            "title": kind.__name__,
            "description": whole.get("description", ""),
            **_object(whole, definitions),
            "allOf": [{"$ref": reference}],
            "$defs": definitions,
        }
    )


def _resolved(schema: _Schema, definitions: dict[str, _Schema]) -> _Schema:
    reference = schema.get("$ref")
    return definitions[reference.removeprefix("#/$defs/")] if reference else schema


def _object(schema: _Schema, definitions: dict[str, _Schema]) -> _Schema:
    plain = {name: _plain(part, definitions) for name, part in schema["properties"].items()}
    return {"type": "object", "properties": {name: part for name, part in plain.items() if part}}


def _plain(schema: _Schema, definitions: dict[str, _Schema]) -> _Schema | None:
    """`schema` with references resolved; `None` if not every viewer accepts it."""
    schema = _resolved(schema, definitions)
    kind = schema.get("type")
    if "enum" in schema:
        return {"type": "string", "enum": schema["enum"]}
    if kind == "object":
        return _object(schema, definitions)
    if kind == "array":
        items = _plain(schema["items"], definitions)
        return {"type": "array", "items": items} if items and items["type"] != "array" else None
    return {"type": kind} if kind in _SCALARS else None
