"""The columns of a topic: its messages, nested as they are, laid out flat.

What is nested gets the names of all that it is in, joined by underscores: `pose_value_x_m`. An
order, or whatever else is of one of several types, has a column for its type and one for each field
that any of them has. A list stays a list in one column.
"""

from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum
from functools import partial, reduce
from operator import attrgetter
from typing import Any, NamedTuple

import msgspec
import msgspec.inspect as mi
import pyarrow as pa

from farside.node import Topic

Value = bool | int | float | str | list["Value"] | dict[str, "Value"] | None
"""What a cell of a table may hold."""

_SCALARS: dict[type[mi.Type], pa.DataType] = {
    mi.BoolType: pa.bool_(),
    mi.IntType: pa.int64(),
    mi.FloatType: pa.float64(),
    mi.StrType: pa.string(),
    mi.EnumType: pa.string(),
}

_Step = Callable[[Any], Any]


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        name: with its unit, as fields have it.
        kind: the type of its cells; every cell may be null.
        of: the cell of a message.
    """

    name: str
    kind: pa.DataType
    of: Callable[[msgspec.Struct], Value]


def columns_of(topic: Topic[Any]) -> tuple[Column, ...]:
    """The columns of a topic's messages, without those of their times.

    Raises:
        TypeError: if a type of the topic has no column, or two columns have one name.
    """
    columns: dict[str, Column] = {}
    for path, steps, kind in _leaves(mi.type_info(topic.kind), (), ()):
        name = "_".join(path)
        flat = len(path) == 1 and not isinstance(_alternatives(kind)[0], mi.VarTupleType)
        column = Column(name, _arrow(kind), attrgetter(name) if flat else partial(_cell, steps))
        if name in columns and columns[name].kind != column.kind:
            raise TypeError(f"{topic.name}: expected one type for {name}, found two")
        columns[name] = column
    return tuple(columns.values())


def _leaves(
    kind: mi.Type, path: tuple[str, ...], steps: tuple[_Step, ...]
) -> Iterator[tuple[tuple[str, ...], tuple[_Step, ...], mi.Type]]:
    """All that is not nested any more: where it stands, how to get there, and its type."""
    structs = _structs(kind)
    if not structs:
        yield path, steps, kind
        return
    if len(structs) > 1:
        yield (*path, "type"), (*steps, _tag), mi.StrType()
    for name in dict.fromkeys(field.name for struct in structs for field in struct.fields):
        for struct in structs:
            for field in struct.fields:
                if field.name == name:
                    step = partial(_field, name)
                    yield from _leaves(field.type, (*path, name), (*steps, step))


def _alternatives(kind: mi.Type) -> tuple[mi.Type, ...]:
    kinds = kind.types if isinstance(kind, mi.UnionType) else (kind,)
    return tuple(one for one in kinds if not isinstance(one, mi.NoneType))


def _structs(kind: mi.Type) -> list[mi.StructType]:
    return [one for one in _alternatives(kind) if isinstance(one, mi.StructType)]


def _arrow(kind: mi.Type) -> pa.DataType:
    structs = _structs(kind)
    if structs:
        fields: dict[str, pa.DataType] = {"type": pa.string()} if len(structs) > 1 else {}
        for struct in structs:
            fields |= {field.name: _arrow(field.type) for field in struct.fields}
        return pa.struct(list(fields.items()))
    (one,) = _alternatives(kind)
    if isinstance(one, mi.VarTupleType):
        return pa.list_(_arrow(one.item_type))
    found = _SCALARS.get(type(one))
    if found is None:
        raise TypeError(f"expected a type that tables have, found {one}")
    return found


# --- the cells ---------------------------------------------------------------------------------


def _cell(steps: Iterable[_Step], message: msgspec.Struct) -> Value:
    return _plain(reduce(_follow, steps, message))


def _follow(value: Any, step: _Step) -> Any:
    return None if value is None else step(value)


def _field(name: str, value: msgspec.Struct) -> Any:
    # Of a value of another type, which has no such field, the cell is null.
    return getattr(value, name) if name in value.__struct_fields__ else None


def _tag(value: msgspec.Struct) -> str:
    return str(value.__struct_config__.tag)


def _plain(value: Any) -> Value:
    match value:
        case msgspec.Struct():
            fields = {name: _plain(getattr(value, name)) for name in value.__struct_fields__}
            tag = value.__struct_config__.tag
            return fields if tag is None else {"type": str(tag), **fields}
        case tuple():
            return [_plain(item) for item in value]
        case StrEnum():
            return value.value
        case bool() | int() | float() | str() | None:
            return value
        case _:
            raise TypeError(f"expected a value that tables have, found {value!r}")
