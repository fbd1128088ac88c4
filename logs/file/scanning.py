"""Walking a log from record to record where it has no index, and past what is damaged."""

import re
import struct
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode

from farside.logs.file.mcap_bytes import GREATEST_RECORD_BYTE, HEAD

_LAYOUTS: dict[int, tuple[int, ...]] = {
    Opcode.HEADER: (-4, -4),
    Opcode.FOOTER: (20,),
    Opcode.SCHEMA: (2, -4, -4, -4),
    Opcode.CHANNEL: (4, -4, -4, -4),
    Opcode.CHUNK: (28, -4, -8),
    Opcode.MESSAGE_INDEX: (2, -4),
    Opcode.CHUNK_INDEX: (32, -4, 8, -4, 16),
    Opcode.ATTACHMENT: (16, -4, -4, -8, 4),
    Opcode.ATTACHMENT_INDEX: (40, -4, -4),
    Opcode.STATISTICS: (42, -4),
    Opcode.METADATA: (-4, -4),
    Opcode.METADATA_INDEX: (16, -4),
    Opcode.SUMMARY_OFFSET: (17,),
    Opcode.DATA_END: (4,),
}
"""The fields of each record that stands outside chunks in a log of ours: so many bytes, or, where
negative, a length of so many bytes and then as many bytes as it says. So a record gives its length
twice, and a wrong one is seen."""

_LENGTHS = {4: struct.Struct("<I"), 8: struct.Struct("<Q")}

# A chunk, an attachment or metadata of at most 64 MB, at whatever byte it begins.
_BEGINNING = re.compile(rb"(?=[\x06\x09\x0c][\x00-\xff]{3}[\x00-\x04]\x00{4})")
_BUFFER_BYTE = 1 << 20
_GLANCE_BYTE = 64


class Span(NamedTuple):
    """Position of a record's body in the file.

    Attributes:
        opcode: kind of record, an `mcap.opcode.Opcode`.
        offset: of its first byte.
        length: in bytes.
    """

    opcode: int
    offset: int
    length: int

    @property
    def start(self) -> int:
        """Where the record begins, its head included."""
        return self.offset - HEAD.size

    @property
    def end(self) -> int:
        """Where the record ends."""
        return self.offset + self.length


def spans(file: BinaryIO, start: int, end: int) -> Iterator[Span]:
    """The records between two offsets that are whole by their lengths.

    Where one does not begin at the end of the one before, the bytes between are damaged: the next
    chunk, attachment or metadata behind them was searched for.
    """
    offset: int | None = start
    while offset is not None and offset < end:
        span = span_at(file, offset, end)
        if span is None:
            offset = _next_beginning(file, offset + 1, end)
        else:
            yield span
            offset = span.end


def span_at(file: BinaryIO, offset: int, end: int) -> Span | None:
    """The record that begins at `offset`; `None` if none does that fits the rules of the format."""
    file.seek(offset)
    glance = file.read(_GLANCE_BYTE)
    if len(glance) < HEAD.size:
        return None
    opcode, length = HEAD.unpack_from(glance)
    layout = _LAYOUTS.get(opcode)
    begin = offset + HEAD.size
    if layout is None or length > GREATEST_RECORD_BYTE or begin + length > end:
        return None

    def number(at: int, size: int) -> int:
        within = at - offset
        if within + size <= len(glance):
            return int(_LENGTHS[size].unpack_from(glance, within)[0])
        file.seek(at)
        return int(_LENGTHS[size].unpack(file.read(size))[0])

    at, stop = begin, begin + length
    for field in layout:
        if field < 0 and at - field <= stop:
            at += number(at, -field)
        at += abs(field)
        if at > stop:
            return None
    return Span(opcode, begin, length) if at == stop else None


def _next_beginning(file: BinaryIO, offset: int, end: int) -> int | None:
    """Where the next record of those that a search can find begins; `None` if none does."""
    while offset < end:
        file.seek(offset)
        data = file.read(_BUFFER_BYTE)
        for found in _BEGINNING.finditer(data):
            if span_at(file, offset + found.start(), end) is not None:
                return offset + found.start()
        if len(data) < _BUFFER_BYTE:
            return None
        offset += len(data) - HEAD.size + 1
    return None
