"""The schemas in a log fit every message and are simple enough for every viewer."""

from typing import Any

import msgspec
import pytest
from any_message import messages
from hypothesis import given
from noting import topic_of

from farside.logs import decode
from farside.logs.file.schemas import topic_schema
from farside.node import Journal
from farside.topics import TOPICS

PYTHON_TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "integer": (int,),
    "number": (int, float),
    "boolean": (bool,),
    "null": (type(None),),
}


def holds(value: Any, schema: dict[str, Any], definitions: dict[str, Any]) -> bool:
    """Whether `value` is valid under `schema`, for the keywords that msgspec uses."""

    def keeps(value: Any, schema: dict[str, Any]) -> bool:
        return holds(value, schema, definitions)

    if "$ref" in schema:
        return keeps(value, definitions[schema["$ref"].removeprefix("#/$defs/")])
    if "anyOf" in schema:
        return any(keeps(value, part) for part in schema["anyOf"])
    if "type" in schema and type(value) not in PYTHON_TYPES[schema["type"]]:
        return False
    if isinstance(value, dict):
        parts = schema.get("properties", {})
        return (
            set(value).issuperset(schema.get("required", ()))
            and all(keeps(value[name], parts[name]) for name in value if name in parts)
            and all(keeps(value, part) for part in schema.get("allOf", ()))
        )
    if isinstance(value, list):
        return all(keeps(item, schema["items"]) for item in value)
    return value in schema.get("enum", (value,))


def plain(schema: dict[str, Any]) -> bool:
    """Whether every viewer accepts it: a plain type everywhere, no array of arrays."""
    if schema["type"] == "object":
        return all(plain(part) for part in schema["properties"].values())
    if schema["type"] == "array":
        return schema["items"]["type"] != "array" and plain(schema["items"])
    return schema["type"] in PYTHON_TYPES and schema["type"] != "null"


@given(message=messages)
def test_every_message_is_valid_under_the_schema_of_its_topic(message: msgspec.Struct) -> None:
    schema = msgspec.json.decode(topic_schema(type(message)))
    value = msgspec.json.decode(msgspec.json.encode(message))

    assert holds(value, schema, schema["$defs"])


@given(message=messages)
def test_a_message_without_a_required_property_is_invalid(message: msgspec.Struct) -> None:
    schema = msgspec.json.decode(topic_schema(type(message)))
    value = msgspec.json.decode(msgspec.json.encode(message))
    required = schema["$defs"][type(message).__name__]["required"]

    del value[required[0]]

    assert not holds(value, schema, schema["$defs"])


@pytest.mark.parametrize("topic", TOPICS)
def test_viewers_accept_every_property_at_the_top_level_of_a_schema(topic: str) -> None:
    schema = msgspec.json.decode(topic_schema(TOPICS[topic].kind))

    assert schema["type"] == "object"
    assert plain(schema)


def test_the_top_level_of_a_schema_lists_scalars_enums_and_structs() -> None:
    schema = msgspec.json.decode(topic_schema(TOPICS["/ground/event"].kind))
    assert schema["properties"] == {
        "event": {
            "type": "object",
            "properties": {
                "type": {"type": "string", "enum": ["event"]},
                "number": {"type": "integer"},
                "time_ns": {"type": "integer"},
            },
        }
    }
    schema = msgspec.json.decode(topic_schema(TOPICS["/link/outage"].kind))
    assert schema["properties"] == {
        "direction": {"type": "string", "enum": ["down", "up"]},
        "down": {"type": "boolean"},
        "reason": {
            "type": "string",
            "enum": ["blackout", "conjunction", "contact", "control", "pass"],
        },
    }


@given(message=messages)
def test_a_record_of_a_journal_decodes_to_the_same_message(message: msgspec.Struct) -> None:
    journal = Journal()
    journal.note(topic_of(message), message)

    assert decode(journal.take()[0]) == message
