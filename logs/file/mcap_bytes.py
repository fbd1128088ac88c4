"""The parts of the MCAP format that are read and written byte by byte: for speed, or for checks.

Everything else is left to the `mcap` library. Reference: the MCAP format specification, version 0.
"""

import struct
import zlib
from collections.abc import Container, Iterable, Iterator, Mapping
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, DataEnd, Footer, McapRecord, Metadata

from farside.node import Record

MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of every MCAP file."""

GREATEST_RECORD_BYTE = 64 * 1024 * 1024
"""Limit on the length of a record, and of an uncompressed chunk, when reading (project default).

Ours are little longer than a megabyte, while a crafted file could ask for all memory.
"""

PICTURE = "farside.picture"
"""Key in the metadata of a channel that holds pictures, which are made of the other channels."""

HEAD = struct.Struct("<BQ")
"""What a record has before its body: opcode and length."""

CHUNK_HEAD = struct.Struct("<QQQII")
"""How the body of a chunk begins: times of its first and its last message, size and checksum of
its uncompressed records, length of the name of the compression."""

MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""A message up to its payload: opcode, length, channel, sequence, log and publish time."""

_MESSAGE_BODY_BYTE = MESSAGE_HEAD.size - HEAD.size
_LENGTH = struct.Struct("<Q")
_CRC = struct.Struct("<I")
_CRC_KEY = "crc32"
_PRESSED = {True: b"zstd", False: b""}

CHUNK_OVERHEAD_BYTE = HEAD.size + CHUNK_HEAD.size + len(_PRESSED[True]) + _LENGTH.size
"""What a compressed chunk has beside its records."""

_LEVEL = 3  # zstd's own default

DAMAGE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    LookupError,
    OverflowError,
    MemoryError,
)
"""What decoding wrong bytes ends in: sums, lengths, texts and channels that cannot be."""


class DamageError(ValueError):
    """Bytes that are not what was written; the text says what was found."""


# --- writing -----------------------------------------------------------------------------------


def record_bytes(record: McapRecord) -> bytes:
    """A record, encoded by the library."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


def end_marks() -> bytes:
    """The end of a file without a summary, before which any reader takes chunk by chunk."""
    return record_bytes(DataEnd(0)) + record_bytes(Footer(0, 0, 0)) + MAGIC


def message_bytes(records: Iterable[Record], channels: Mapping[str, int]) -> bytes:
    """Records encoded as MCAP messages, one after the other.

    Raises:
        KeyError: if a topic has no channel.
    """
    parts: list[bytes] = []
    pack, message = MESSAGE_HEAD.pack, int(Opcode.MESSAGE)
    for record in records:
        payload, topic = record.payload, record.topic
        length = _MESSAGE_BODY_BYTE + len(payload)
        times_ns = record.log_time_ns, record.publish_time_ns
        parts += (pack(message, length, channels[topic], 0, *times_ns), payload)
    return b"".join(parts)


def chunk_bytes(data: bytes, start_ns: int, end_ns: int, *, compressed: bool) -> bytes:
    """A chunk of encoded records, with their checksum.

    Args:
        data: the records.
        start_ns: least log time of the messages among them.
        end_ns: greatest.
        compressed: whether to compress them.
    """
    packed = zstandard.ZstdCompressor(_LEVEL).compress(data) if compressed else data
    name = _PRESSED[compressed]
    head = CHUNK_HEAD.pack(start_ns, end_ns, len(data), zlib.crc32(data), len(name))
    length = len(head) + len(name) + _LENGTH.size + len(packed)
    return b"".join(
        (HEAD.pack(Opcode.CHUNK, length), head, name, _LENGTH.pack(len(packed)), packed)
    )


def metadata_bytes(name: str, values: Mapping[str, str]) -> bytes:
    """Metadata with a checksum among them, as MCAP has none for it."""
    sealed = {**values, _CRC_KEY: _seal(name, values)}
    return record_bytes(Metadata(name=name, metadata=sealed))


def _seal(name: str, values: Mapping[str, str]) -> str:
    texts = (name, *(text for pair in sorted(values.items()) for text in pair))
    return f"{zlib.crc32(chr(0).join(texts).encode()):08x}"


# --- reading -----------------------------------------------------------------------------------


def inner_records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode, begin and end of the body of each record in the bytes of a chunk or summary.

    Raises:
        DamageError: where the bytes end within a record.
    """
    at, size = 0, len(data)
    while at < size:
        if at + HEAD.size > size:
            raise DamageError(f"{size - at} bytes after the last record")
        opcode, length = HEAD.unpack_from(data, at)
        begin = at + HEAD.size
        at = begin + length
        if at > size:
            raise DamageError(f"a record of {length} bytes where {size - begin} are left")
        yield opcode, begin, at


def messages(data: bytes, topics: Mapping[int, str], passed_over: Container[int]) -> list[Record]:
    """The messages among the records of a chunk.

    Args:
        data: the records.
        topics: topics of the channels to read, by channel number.
        passed_over: numbers of all known channels.

    Raises:
        DamageError: if a message is too short or its channel unknown, or the bytes end within a
            record.
        struct.error: likewise.
    """
    found: list[Record] = []
    at, size, unpack, topic_of = 0, len(data), MESSAGE_HEAD.unpack_from, topics.get
    message, head_byte, whole_byte = int(Opcode.MESSAGE), HEAD.size, MESSAGE_HEAD.size
    while at < size:
        opcode, length, channel, _, log_time_ns, publish_time_ns = unpack(data, at)
        begin = at + whole_byte
        at += head_byte + length
        if at > size:
            raise DamageError(f"a record of {length} bytes where {size - begin} are left")
        if opcode != message:
            continue
        if at < begin:
            raise DamageError(f"a message of {length} bytes")
        topic = topic_of(channel)
        if topic is not None:
            found.append(Record(topic, log_time_ns, publish_time_ns, data[begin:at]))
        elif channel not in passed_over:
            raise DamageError(f"a message of channel {channel}, which is unknown")
    return found


def channels_in(data: bytes) -> set[int]:
    """The numbers of the channels of the messages among the records of a chunk."""
    return {
        MESSAGE_HEAD.unpack_from(data, begin - HEAD.size)[2]
        for opcode, begin, _ in inner_records(data)
        if opcode == Opcode.MESSAGE
    }


def times_ns_in(data: bytes) -> tuple[int, int]:
    """Least and greatest log time of the messages among the records of a chunk."""
    times_ns = [
        MESSAGE_HEAD.unpack_from(data, begin - HEAD.size)[4]
        for opcode, begin, _ in inner_records(data)
        if opcode == Opcode.MESSAGE
    ]
    return min(times_ns), max(times_ns)


def chunk_records(body: bytes) -> bytes:
    """The uncompressed records of a chunk.

    Raises:
        DamageError: if they are not those that were written, or exceed `GREATEST_RECORD_BYTE`.
        zstandard.ZstdError: if they cannot be decompressed.
        struct.error: if the chunk is too short.
    """
    _, _, size_byte, crc, name_byte = CHUNK_HEAD.unpack_from(body)
    at = CHUNK_HEAD.size + name_byte
    compression, packed = body[CHUNK_HEAD.size : at], body[at + _LENGTH.size :]
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
            raise DamageError("a chunk in an unknown compression")
    if zlib.crc32(data) != crc:
        raise DamageError("a chunk whose contents are not what was written")
    return data


def attachment_of(body: bytes) -> Attachment:
    """The attachment in the body of its record.

    Raises:
        DamageError: if it is not what was written.
    """
    [crc] = _CRC.unpack_from(body, len(body) - _CRC.size)
    if zlib.crc32(body[: -_CRC.size]) != crc:
        raise DamageError("an attachment that is not what was written")
    attachment: Attachment = Attachment.read(ReadDataStream(BytesIO(body)))
    return attachment


def metadata_of(body: bytes) -> tuple[str, dict[str, str]]:
    """Name and values of the metadata in the body of its record.

    Raises:
        DamageError: if they are not what was written.
    """
    metadata = Metadata.read(ReadDataStream(BytesIO(body)))
    values = dict(metadata.metadata)
    if values.pop(_CRC_KEY, None) != _seal(metadata.name, values):
        raise DamageError("metadata that are not what was written")
    return metadata.name, values
