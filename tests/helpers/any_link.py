"""Tables that might describe a link, made from the schema of a profile, right and wrong ones."""

import math
from typing import Any

from hypothesis import strategies as st
from msgspec import inspect

from farside.link.profile.config import LinkConfig

NUMBERS = st.sampled_from(
    [-1, 0, 1, 2**63 - 1, 2**64, 10**30, 0.5, -0.999, 1e-300, 5e-324, 1e9, 1e10, 1e300]
)

JUNK = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner, max_size=2)
    ),
    max_leaves=4,
)

TEXTS = st.sampled_from(["moon", "perfect", "/dev/zero", "no.such", "\0", "2026-01-01"])


def any_tables(*, fitting: bool) -> st.SearchStrategy[dict[str, Any]]:
    """Tables with a few keys of a profile.

    Args:
        fitting: whether each value is of the right kind and in its range, at its ends as a rule.
    """
    return _Tables(JUNK if not fitting else st.nothing()).few(inspect.type_info(LinkConfig))


class _Tables:
    """Values by their type, or `junk` in their place."""

    def __init__(self, junk: st.SearchStrategy[Any]) -> None:
        self._junk = junk

    def few(self, schema: inspect.Type) -> st.SearchStrategy[dict[str, Any]]:
        """A few keys of a table that requires none."""
        assert isinstance(schema, inspect.StructType)
        entries = [
            st.tuples(st.just(field.encode_name), self._entry(field)) for field in schema.fields
        ]
        return st.lists(st.one_of(entries), min_size=1, max_size=4).map(dict)

    def _entry(self, field: inspect.Field) -> st.SearchStrategy[Any]:
        if field.encode_name in {"up", "down"}:
            return self.few(field.type)
        return self._value(field.type) | self._junk

    def _value(self, schema: inspect.Type) -> st.SearchStrategy[Any]:
        found: st.SearchStrategy[Any] = TEXTS
        match schema:
            case inspect.Metadata():
                found = self._value(schema.type)
            case inspect.UnionType():
                found = st.one_of(*map(self._value, schema.types))
            case inspect.StructType():
                found = self._table(schema)
            case inspect.VarTupleType():
                found = st.lists(self._value(schema.item_type) | self._junk, max_size=3)
            case inspect.EnumType():
                found = st.sampled_from([one.value for one in schema.cls])
            case inspect.NoneType():
                found = st.none()
            case inspect.FloatType():
                found = _bounded(schema)
            case inspect.IntType():
                found = _bounded(schema).map(int)
        return found

    def _table(self, schema: inspect.StructType) -> st.SearchStrategy[dict[str, Any]]:
        fields = {
            field.encode_name: self._value(field.type) | self._junk for field in schema.fields
        }
        required = {field.encode_name for field in schema.fields if field.required}
        tag = {} if schema.tag is None else {str(schema.tag_field): st.just(schema.tag)}
        return st.fixed_dictionaries(
            {**tag, **{name: fields[name] for name in required}},
            optional={name: one for name, one in fields.items() if name not in required},
        )


def _bounded(schema: inspect.FloatType | inspect.IntType) -> st.SearchStrategy[Any]:
    """The ends of the range, and what lies between them."""
    least, most = schema.ge, schema.le
    if least is None:
        least = 0 if schema.gt is None else math.nextafter(schema.gt, math.inf)
    if most is None:
        most = 10**9 if isinstance(schema, inspect.FloatType) else 2**63 - 1
    inside = [least, most, (least + min(most, 10**9)) / 2, least + (most - least) * 1e-9]
    return st.sampled_from(inside)
