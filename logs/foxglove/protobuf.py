"""States and numbers in protobuf: their schema, and their messages.

Foxglove's library has its own schemas only, and these are flat: all that protobuf asks for here is
a tag before each value. Numbers are of fixed length. Source: the protocol buffers encoding guide,
and `descriptor.proto`.
"""

import struct
from collections.abc import Callable
from typing import Any

import msgspec

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_TYPES: dict[type, tuple[int, int, str]] = {
    float: (1, _FIXED64, "d"),
    int: (7, _FIXED32, "I"),
    bool: (8, _VARINT, "?"),
    str: (9, _BYTES, ""),
}
"""The type's number in `descriptor.proto`, how it is laid out, and in which `struct` format."""

_OPTIONAL = 1
_MOST = 2**32 - 1


def descriptor_set(kind: type[msgspec.Struct], package: str) -> bytes:
    """The `FileDescriptorSet` of a struct of `float`, `int`, `bool` and `str`.

    Args:
        kind: the struct. Its fields are numbered in their order, from 1.
        package: of the message.
    """
    fields = b"".join(
        _sized(
            2,
            _sized(1, field.name.encode())
            + _number(3, number)
            + _number(4, _OPTIONAL)
            + _number(5, _TYPES[field.type][0]),
        )
        for number, field in enumerate(msgspec.structs.fields(kind), start=1)
    )
    message = _sized(1, kind.__name__.encode()) + fields
    file = (
        _sized(1, f"{package}/{kind.__name__}.proto".encode())
        + _sized(2, package.encode())
        + _sized(4, message)
        + _sized(12, b"proto3")
    )
    return _sized(1, file)


def encoder(kind: type[msgspec.Struct]) -> Callable[[Any], bytes]:
    """What encodes messages of a struct that `descriptor_set` takes.

    A whole number below 0 is told as 0, and one above 2³² - 1 as that: they are counts, and no
    message of a run is too odd to be drawn.
    """
    fields = list(enumerate(msgspec.structs.fields(kind), start=1))
    fixed = [(number, field) for number, field in fields if field.type is not str]
    texts = [(number, field.name) for number, field in fields if field.type is str]
    layout = struct.Struct("<" + "".join(f"B{_TYPES[field.type][2]}" for _, field in fixed))
    template: list[Any] = [0] * (2 * len(fixed))
    template[::2] = [_tag(number, _TYPES[field.type][1]) for number, field in fixed]
    names = [field.name for _, field in fixed]

    def encode(message: Any) -> bytes:
        told = template.copy()
        told[1::2] = [getattr(message, name) for name in names]
        try:
            data = layout.pack(*told)
        except struct.error:
            data = layout.pack(*map(_within, told))
        for number, name in texts:
            data += _sized(number, getattr(message, name).encode())
        return data

    return encode


def _within(value: Any) -> Any:
    return min(max(value, 0), _MOST) if isinstance(value, int) else value


def _tag(number: int, layout: int) -> int:
    return number << 3 | layout


def _number(number: int, value: int) -> bytes:
    return _varint(_tag(number, _VARINT)) + _varint(value)


def _sized(number: int, data: bytes) -> bytes:
    return _varint(_tag(number, _BYTES)) + _varint(len(data)) + data


def _varint(value: int) -> bytes:
    """Seven bits a byte, the least first; all but the last have the eighth set."""
    data = bytearray()
    while value > 0x7F:
        data.append(value & 0x7F | 0x80)
        value >>= 7
    data.append(value)
    return bytes(data)
