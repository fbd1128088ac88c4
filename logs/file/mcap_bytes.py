"""The parts of the MCAP format that are read and written byte by byte, for speed.

Everything else is left to the `mcap` library. Reference: the MCAP format specification, version 0.
"""

import struct
import zlib
from collections.abc import Container, Iterable, Iterator, Mapping
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC

from farside.node import Record

GREATEST_RECORD_BYTE = 64 * 1024 * 1024
"""Limit on the length of a record, and of an uncompressed chunk, when reading (project default).

Ours are little longer than a megabyte, while a crafted file could ask for all memory.
"""

PICTURE = "farside.picture"
"""Key in the metadata of a channel that holds pictures, which are made of the other channels."""

_HEAD = struct.Struct("<BQ")

HEAD_BYTE = _HEAD.size
"""What a record has before its body: opcode and length."""

_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_BODY = struct.Struct("<HIQQ")
_MESSAGE_BODY_BYTE = _MESSAGE_BODY.size
_MESSAGE_KEY = struct.Struct("<HIQ")
_CHUNK = struct.Struct("<QQQII")
_TIMES = struct.Struct("<QQ")
_BUFFER_BYTE = 1 << 20


class Span(NamedTuple):
    """Position of a record's body in the file.

    Attributes:
        opcode: kind of record, an `mcap.opcode.Opcode`.
        offset: of its first byte.
        length: in bytes.
        start: its first bytes: the header of a message, or the times of a chunk.
    """

    opcode: int
    offset: int
    length: int
    start: bytes


class DamageError(ValueError):
    """Bytes that are not valid MCAP; the text says what was found."""


def end_marks() -> bytes:
    """The end of a file without a summary, before which any reader takes message by message."""
    builder = RecordBuilder()
    DataEnd(0).write(builder)
    Footer(0, 0, 0).write(builder)
    return bytes(builder.end()) + MCAP0_MAGIC


def message_bytes(records: Iterable[Record], channels: Mapping[str, int]) -> bytes:
    """Records encoded as MCAP messages, one after the other.

    Raises:
        KeyError: if a topic has no channel.
    """
    parts: list[bytes] = []
    for topic, log_time_ns, publish_time_ns, payload in map(_fields, records):
        length = _MESSAGE_BODY_BYTE + len(payload)
        head = _MESSAGE.pack(
            Opcode.MESSAGE, length, channels[topic], 0, log_time_ns, publish_time_ns
        )
        parts += (head, payload)
    return b"".join(parts)


def _fields(record: Record) -> tuple[str, int, int, bytes]:
    return record.topic, record.log_time_ns, record.publish_time_ns, record.payload


def spans(file: BinaryIO, start: int, end: int) -> Iterator[Span]:
    """The whole records from `start` to `end`, up to a footer.

    Raises:
        DamageError: at a record longer than `GREATEST_RECORD_BYTE`.
    """
    offset, base, buffer = start, start, b""
    while offset + _HEAD.size <= end:
        if offset + _MESSAGE.size > base + len(buffer):
            file.seek(offset)
            base, buffer = offset, file.read(_BUFFER_BYTE)
        at = offset - base
        opcode, length = _HEAD.unpack_from(buffer, at)
        offset += _HEAD.size
        if offset + length > end:
            return
        if length > GREATEST_RECORD_BYTE:
            raise DamageError(f"a record of {length} bytes at byte {offset}")
        yield Span(opcode, offset, length, buffer[at + _HEAD.size : at + _MESSAGE.size])
        if opcode == Opcode.FOOTER:
            return
        offset += length


def message_key(span: Span) -> tuple[int, int]:
    """Channel and log time of a message.

    Raises:
        DamageError: if it is too short.
    """
    if span.length < _MESSAGE_BODY_BYTE:
        raise DamageError(f"a message of {span.length} bytes at byte {span.offset}")
    channel, _, log_time_ns = _MESSAGE_KEY.unpack_from(span.start)
    return channel, log_time_ns


def chunk_times_ns(span: Span) -> tuple[int, int]:
    """Log times of the first and the last message of a chunk.

    Raises:
        DamageError: if it is too short.
    """
    if span.length < _CHUNK.size:
        raise DamageError(f"a chunk of {span.length} bytes at byte {span.offset}")
    start_ns, end_ns = _TIMES.unpack_from(span.start)
    return start_ns, end_ns


def inner_records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode, begin and end of the body of each record in the bytes of a chunk.

    Raises:
        DamageError: where the bytes end within a record.
    """
    at, size = 0, len(data)
    while at < size:
        if at + _HEAD.size > size:
            raise DamageError(f"{size - at} bytes after the last record")
        opcode, length = _HEAD.unpack_from(data, at)
        begin = at + _HEAD.size
        at = begin + length
        if at > size:
            raise DamageError(f"a record of {length} bytes where {size - begin} are left")
        yield opcode, begin, at


def messages(
    data: bytes, topics: Mapping[int, str], passed_over: Container[int]
) -> Iterator[Record]:
    """The messages in the bytes of a chunk, or of a row of plain messages.

    Args:
        data: the bytes.
        topics: topics of the channels to read, by channel number.
        passed_over: numbers of all known channels.

    Raises:
        DamageError: if a message is too short or its channel unknown, or the bytes end within a
            record.
    """
    for opcode, begin, end in inner_records(data):
        if opcode != Opcode.MESSAGE:
            continue
        if end - begin < _MESSAGE_BODY_BYTE:
            raise DamageError(f"a message of {end - begin} bytes")
        channel, _, log_time_ns, publish_time_ns = _MESSAGE_BODY.unpack_from(data, begin)
        if channel in topics:
            payload = data[begin + _MESSAGE_BODY_BYTE : end]
            yield Record(topics[channel], log_time_ns, publish_time_ns, payload)
        elif channel not in passed_over:
            raise DamageError(f"a message of channel {channel}, which is unknown")


def chunk_bytes(body: bytes) -> bytes:
    """The uncompressed records of a chunk.

    Raises:
        DamageError: if they do not match the chunk's header, or exceed `GREATEST_RECORD_BYTE`.
        zstandard.ZstdError: if they cannot be decompressed.
    """
    if len(body) < _CHUNK.size:
        raise DamageError(f"a chunk of {len(body)} bytes")
    _, _, size_byte, crc, name_byte = _CHUNK.unpack_from(body)
    at = _CHUNK.size + name_byte
    compression, packed = body[_CHUNK.size : at], body[at + 8 :]
    if size_byte > GREATEST_RECORD_BYTE:
        raise DamageError(f"a chunk of {size_byte} bytes")
    match compression:
        case b"zstd":
            # The decompressor allocates what the frame itself claims.
            if zstandard.frame_content_size(packed) != size_byte:
                raise DamageError("a chunk whose size is not that of its contents")
            data = zstandard.ZstdDecompressor().decompress(packed)
        case b"":
            data = packed
        case _:
            raise DamageError(f"a chunk compressed by {compression[:20]!r}")
    if len(data) != size_byte or (crc and zlib.crc32(data) != crc):
        raise DamageError("a chunk whose contents are not what was written")
    return data
