"""The index of a log: read from its summary, or built by a scan if it has none."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from farside.logs.file.mcap_bytes import (
    GREATEST_RECORD_BYTE,
    HEAD_BYTE,
    DamageError,
    Span,
    chunk_bytes,
    chunk_times_ns,
    inner_records,
    message_key,
    spans,
)

LIBRARY = "farside"
"""First word of the library field in the header of every log of Farside's."""

_FOOTER_BYTE = HEAD_BYTE + 20
_BLOCK_BYTE = 1 << 20
_DAMAGE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    LookupError,
    OverflowError,
    MemoryError,
)
"""What decoding wrong bytes ends in: sums, lengths, texts and channels that cannot be."""


class LogError(Exception):
    """A log cannot be written or read; the message tells people which, and why."""


class Attachment(NamedTuple):
    """A file inside a log."""

    media_type: str
    data: bytes


@dataclass(slots=True)
class Block:
    """A chunk in the file, or a row of plain messages, and what it holds.

    Attributes:
        offset, length: of its bytes; for a chunk, of its body.
        start_ns, end_ns: least and greatest log time.
        channels: numbers of the channels in it; `None` if unknown.
        is_chunk: whether it is a chunk.
    """

    offset: int
    length: int
    start_ns: int
    end_ns: int
    channels: set[int] | None
    is_chunk: bool


class LogIndex:
    """What a log holds and where.

    A finished log has a summary. An unfinished one, whose writer was killed or is still running,
    is scanned from its beginning to its last whole record.

    Args:
        path: the file, for error messages.
        file: the same, open.

    Attributes:
        complete: whether the writer finished it.
        library: the program that wrote it, such as `farside 0.1.0`.
        schemas, channels: by number.
        attachments: by name; of several with one name, the last.
        metadata: likewise.
        blocks: the messages, in order.

    Raises:
        LogError: if the file is not a log, or is damaged.
    """

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.complete = False
        self.library = ""
        self.schemas: dict[int, mcap.Schema] = {}
        self.channels: dict[int, mcap.Channel] = {}
        self.attachments: dict[str, Attachment] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.blocks: list[Block] = []
        self._path, self._file = path, file
        self._look_over()

    def _look_over(self) -> None:
        file = self._file
        size_byte = file.seek(0, 2)
        file.seek(0)
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise LogError(f"{self._path} is not a log: it is not an MCAP file")
        summary = _summary(file, size_byte)
        if summary is not None:
            with reporting_damage(self._path, summary[0]):
                self._by_index(*summary)
            self.complete = True
            return
        for span in self._spans(len(MCAP0_MAGIC), size_byte):
            with reporting_damage(self._path, span.offset):
                self._take(span)

    def _by_index(self, start: int, end: int) -> None:
        """Index a finished log by its header and the summary from `start` to `end`."""
        left_byte = end  # so that a summary cannot have one attachment read a million times
        self._take_at(len(MCAP0_MAGIC), end)
        for span in spans(self._file, start, end):
            match span.opcode:
                case Opcode.SCHEMA | Opcode.CHANNEL:
                    self._take(span)
                case Opcode.CHUNK_INDEX:
                    self.blocks.append(_indexed(mcap.ChunkIndex.read(_body(self._file, span))))
                case Opcode.ATTACHMENT_INDEX:
                    offset = mcap.AttachmentIndex.read(_body(self._file, span)).offset
                    left_byte -= self._take_at(offset, end)
                case Opcode.METADATA_INDEX:
                    offset = mcap.MetadataIndex.read(_body(self._file, span)).offset
                    left_byte -= self._take_at(offset, end)
            if left_byte < 0:
                raise DamageError("attachments that overlap")

    def _take_at(self, offset: int, end: int) -> int:
        """Take the record at `offset`, and return its length in bytes."""
        length = 0
        for span in islice(spans(self._file, offset, end), 1):
            self._take(span)
            length = span.length
        return length

    def _take(self, span: Span) -> None:
        match span.opcode:
            case Opcode.MESSAGE:
                self._take_message(span)
            case Opcode.CHUNK:
                self._take_chunk(span)
            case Opcode.HEADER:
                self.library = mcap.Header.read(_body(self._file, span)).library
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._take_channel(span.opcode, _body(self._file, span))
            case Opcode.ATTACHMENT:
                attachment = mcap.Attachment.read(_body(self._file, span))
                self.attachments[attachment.name] = Attachment(
                    attachment.media_type, attachment.data
                )
            case Opcode.METADATA:
                metadata = mcap.Metadata.read(_body(self._file, span))
                self.metadata[metadata.name] = metadata.metadata

    def _take_message(self, span: Span) -> None:
        channel, time_ns = message_key(span)
        begin, end = span.offset - HEAD_BYTE, span.offset + span.length
        row = self.blocks[-1] if self.blocks else None
        if row is None or row.offset + row.length != begin or row.length >= _BLOCK_BYTE:
            row = Block(begin, 0, time_ns, time_ns, set(), is_chunk=False)
            self.blocks.append(row)
        row.length = end - row.offset
        row.start_ns, row.end_ns = min(row.start_ns, time_ns), max(row.end_ns, time_ns)
        if row.channels is not None:
            row.channels.add(channel)

    def _take_chunk(self, span: Span) -> None:
        """A chunk without an index; its channels are declared in it, or in one before."""
        start_ns, end_ns = chunk_times_ns(span)
        block = Block(span.offset, span.length, start_ns, end_ns, None, is_chunk=True)
        self.blocks.append(block)
        with suppress(*_DAMAGE):  # reported when the chunk is read
            data = block_bytes(self._file, block)
            for opcode, begin, end in inner_records(data):
                if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                    self._take_channel(opcode, ReadDataStream(BytesIO(data[begin:end])))

    def _take_channel(self, opcode: int, body: ReadDataStream) -> None:
        if opcode == Opcode.SCHEMA:
            schema = mcap.Schema.read(body)
            self.schemas[schema.id] = schema
        else:
            channel = mcap.Channel.read(body)
            self.channels[channel.id] = channel

    def _spans(self, start: int, end: int) -> Iterator[Span]:
        with reporting_damage(self._path, start):
            yield from spans(self._file, start, end)


@contextmanager
def reporting_damage(path: Path, offset: int) -> Iterator[None]:
    """Turn whatever decoding damaged bytes raises into a `LogError` with file and offset."""
    try:
        yield
    except _DAMAGE as error:
        message = f"{path} is damaged at byte {offset}: only what comes before counts"
        raise LogError(message) from error


def block_bytes(file: BinaryIO, block: Block) -> bytes:
    """The uncompressed records of a block.

    Raises:
        DamageError: if they are missing or damaged.
        zstandard.ZstdError: if they cannot be decompressed.
    """
    file.seek(block.offset)
    data = file.read(block.length)
    if len(data) < block.length:
        raise DamageError("the file was cut short")
    return chunk_bytes(data) if block.is_chunk else data


def _summary(file: BinaryIO, size_byte: int) -> tuple[int, int] | None:
    """Begin and end of the summary of a finished log; `None` if there is no valid one."""
    end = size_byte - _FOOTER_BYTE - len(MCAP0_MAGIC)
    if end < len(MCAP0_MAGIC):
        return None
    file.seek(end)
    marks = file.read()
    if marks[_FOOTER_BYTE:] != MCAP0_MAGIC or marks[0] != Opcode.FOOTER:
        return None
    footer = mcap.Footer.read(ReadDataStream(BytesIO(marks[HEAD_BYTE:])))
    start = footer.summary_start
    if not len(MCAP0_MAGIC) <= start <= end or end - start > GREATEST_RECORD_BYTE:
        return None
    file.seek(start)
    # The checksum covers the summary, and the footer up to the checksum itself.
    crc = zlib.crc32(marks[: _FOOTER_BYTE - 4], zlib.crc32(file.read(end - start)))
    return (start, end) if footer.summary_crc in {0, crc} else None


def _indexed(index: mcap.ChunkIndex) -> Block:
    # The body of a chunk follows its opcode and its length.
    return Block(
        index.chunk_start_offset + HEAD_BYTE,
        index.chunk_length - HEAD_BYTE,
        index.message_start_time,
        index.message_end_time,
        set(index.message_index_offsets) or None,
        is_chunk=True,
    )


def _body(file: BinaryIO, span: Span) -> ReadDataStream:
    file.seek(span.offset)
    return ReadDataStream(BytesIO(file.read(span.length)))
