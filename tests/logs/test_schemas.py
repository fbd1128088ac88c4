"""The schemas in a log are true of every message, and plain enough for every viewer."""

from typing import Any

import msgspec
import msgspec.inspect as mi
import pytest
from hypothesis import given
from hypothesis import strategies as st
from noting import topic_of

from farside.logs import decode
from farside.logs.schemas import topic_schema
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


SCALARS: dict[type[mi.Type], st.SearchStrategy[Any]] = {
    mi.FloatType: st.floats(allow_nan=False, allow_infinity=False),
    mi.IntType: st.integers(-(2**63), 2**63 - 1),
    mi.StrType: st.text(max_size=8),
    mi.BoolType: st.booleans(),
    mi.NoneType: st.none(),
}


def values(kind: mi.Type) -> st.SearchStrategy[Any]:
    """Any value that msgspec takes for `kind`."""
    match kind:
        case mi.StructType(cls=cls, fields=fields):
            return st.builds(cls, **{field.name: values(field.type) for field in fields})
        case mi.VarTupleType(item_type=item):
            return st.lists(values(item), max_size=3).map(tuple)
        case mi.UnionType(types=types):
            return st.one_of(*map(values, types))
        case mi.EnumType(cls=cls):
            return st.sampled_from(cls)
    return SCALARS[type(kind)]


entries = st.sampled_from(list(TOPICS.values())).flatmap(
    lambda topic: values(mi.type_info(topic.kind))
)


def holds(value: Any, schema: dict[str, Any], definitions: dict[str, Any]) -> bool:
    """Whether `value` keeps to `schema`, as far as schemas of msgspec's go."""

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
    """Whether the pickiest viewer takes it: a known type everywhere, no array in an array."""
    if schema["type"] == "object":
        return all(plain(part) for part in schema["properties"].values())
    if schema["type"] == "array":
        return schema["items"]["type"] != "array" and plain(schema["items"])
    return schema["type"] in PYTHON_TYPES and schema["type"] != "null"


@given(entry=entries)
def test_every_message_keeps_to_the_schema_of_its_topic(entry: msgspec.Struct) -> None:
    schema = msgspec.json.decode(topic_schema(type(entry)))
    message = msgspec.json.decode(msgspec.json.encode(entry))

    assert holds(message, schema, schema["$defs"])


@given(entry=entries)
def test_a_message_that_lacks_a_required_property_breaks_the_schema(entry: msgspec.Struct) -> None:
    schema = msgspec.json.decode(topic_schema(type(entry)))
    message = msgspec.json.decode(msgspec.json.encode(entry))
    required = schema["$defs"][type(entry).__name__]["required"]

    del message[required[0]]

    assert not holds(message, schema, schema["$defs"])


@pytest.mark.parametrize("topic", TOPICS)
def test_a_viewer_takes_every_property_at_the_top_of_a_schema(topic: str) -> None:
    schema = msgspec.json.decode(topic_schema(TOPICS[topic].kind))

    assert schema["type"] == "object"
    assert plain(schema)


def test_a_schema_names_the_scalars_enums_and_structs_of_its_type_for_viewers() -> None:
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


@given(entry=entries)
def test_what_a_journal_notes_is_decoded_to_the_same_entry(entry: msgspec.Struct) -> None:
    journal = Journal()
    journal.note(topic_of(entry), entry)

    assert decode(journal.take()[0]) == entry
