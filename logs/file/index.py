"""The index of a log: read from its summary, or built by a scan where it has none."""

import os
import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from farside.logs.file.mcap_bytes import (
    CHUNK_HEAD,
    DAMAGE,
    GREATEST_RECORD_BYTE,
    HEAD,
    MAGIC,
    DamageError,
    attachment_of,
    end_marks,
    inner_records,
    metadata_of,
    times_ns_in,
)
from farside.logs.file.parts import (
    LIBRARY,
    LISTED_CHANNEL,
    SIZES,
    Attachment,
    Block,
    Damage,
    LogError,
    block_records,
    read_at,
)
from farside.logs.file.scanning import Span, span_at, spans
from farside.logs.file.sparse import SPARSE, sparse_blocks

_END_MARKS = end_marks()
_FOOTER_BYTE = HEAD.size + 20
_INDEX_HEAD = struct.Struct("<QQQQI")
_NOTHING = "no message is missing"
_LOST: dict[int, str] = {
    Opcode.ATTACHMENT: "an attachment is missing",
    Opcode.METADATA: "metadata are missing",
    Opcode.HEADER: _NOTHING,
}
"""What is missing where a record cannot be read that is no chunk."""
_MESSAGE = bytes([Opcode.MESSAGE])
_OF_DATA = frozenset({Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA})


class LogIndex:
    """What a log holds and where.

    A finished log has a summary. Any other, whose writer was killed or is still running, or whose
    summary is damaged, is scanned from its beginning to its end.

    Args:
        path: the file, for error messages.
        file: the same, open.

    Attributes:
        complete: whether the writer finished it, and its summary is whole.
        size_byte: length of the file.
        library: the program that wrote it, such as `farside 0.1.0`.
        schemas, channels: by number.
        attachments: by name; of several with one name, the last.
        metadata: likewise.
        blocks: the chunks with messages, in order.
        counts: the number of messages by channel; `None` without a summary.
        payload_byte: the length of all payloads of each topic; empty if the log does not say.
        sparse: chunks with copies of all messages of `sparse_topics`; see `sparse`.
        sparse_topics: their names; none where there are no such chunks.
        damage: what could not be read so far, by its first byte.

    Raises:
        LogError: if the file is not a log.
    """

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.complete = False
        self.library = ""
        self.schemas: dict[int, mcap.Schema] = {}
        self.channels: dict[int, mcap.Channel] = {}
        self.attachments: dict[str, Attachment] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.blocks: list[Block] = []
        self.counts: dict[int, int] | None = None
        self.payload_byte: dict[str, int] = {}
        self.sparse: list[Block] = []
        self.sparse_topics: frozenset[str] = frozenset()
        self.damage: dict[int, Damage] = {}
        self._path = path
        self._identity = _identity(file)
        self._scanned = len(MAGIC)
        self._tail: Damage | None = None
        self._look_over(file)

    def _look_over(self, file: BinaryIO) -> None:
        size = self.size_byte = _size(file)
        ends = [read_at(file, at, len(MAGIC)) for at in (0, max(size - len(MAGIC), 0))]
        if MAGIC not in ends:
            raise LogError(f"{self._path} is not a log: it is not an MCAP file")
        if ends[0] != MAGIC:
            self._note(Damage(0, len(MAGIC), "not how an MCAP file begins", _NOTHING))
        if not self._by_summary(file, size):
            self._scan(file, size)
        if not self._is_ours:
            author = self.library or "an unknown program"
            raise LogError(f"{self._path} is not a Farside log: it was written by {author}")

    @property
    def _is_ours(self) -> bool:
        if self.library.split(" ")[0] == LIBRARY:
            return True
        names = (schema.name for schema in self.schemas.values())
        return any(name.startswith(f"{LIBRARY}.") for name in names)

    def is_of(self, file: BinaryIO) -> bool:
        """Whether it is the index of this file, which may have grown since."""
        return self._identity == _identity(file) and _size(file) >= self._scanned

    def update(self, file: BinaryIO) -> bool:
        """Take in what was appended since; returns whether there was anything."""
        before = len(self.blocks), len(self.attachments), len(self.metadata)
        if not self.complete:
            self.size_byte = _size(file)
            self._scan(file, self.size_byte)
        return before != (len(self.blocks), len(self.attachments), len(self.metadata))

    def sentences(self, until_ns: int | None, *, inside: bool = False) -> tuple[str, ...]:
        """The damage found so far in words, in the order of the file.

        Args:
            until_ns: without what is known to have begun later; `None` for all.
            inside: without an end that was cut off.
        """
        tail = [] if self._tail is None or inside else [self._tail]
        found = [*self.damage.values(), *tail]
        return tuple(
            damage.sentence
            for damage in sorted(found, key=lambda damage: damage.start)
            if until_ns is None or (damage.start_ns or 0) <= until_ns
        )

    def note_block(self, block: Block, error: Exception) -> None:
        """Note that a chunk cannot be read."""
        self._note(Damage(block.start, block.end, _words(error), "", block.start_ns, block.end_ns))

    def _note(self, damage: Damage) -> None:
        self.damage[damage.start] = damage

    # --- by the summary ------------------------------------------------------------------------

    def _by_summary(self, file: BinaryIO, size: int) -> bool:
        """Index a finished log by its header and its summary; `False` if it has no whole one."""
        data = _summary(file, size)
        if data is None:
            return False
        header = span_at(file, len(MAGIC), size)
        try:
            if header is None or header.opcode != Opcode.HEADER:
                raise DamageError("not a header")
            self._take(file, header)
        except DAMAGE as error:
            self._note(Damage(len(MAGIC), len(MAGIC) + HEAD.size, _words(error), _NOTHING))
        try:
            self._take_summary(file, data, size)
        except DAMAGE:
            self.blocks.clear()
            return False
        self.complete = True
        return True

    def _take_summary(self, file: BinaryIO, data: bytes, size: int) -> None:
        left_byte = size  # so that a summary cannot have one attachment read a million times
        for opcode, begin, end in inner_records(data):
            body = data[begin:end]
            match opcode:
                case Opcode.SCHEMA | Opcode.CHANNEL:
                    self._declare(opcode, body)
                case Opcode.CHUNK_INDEX:
                    self.blocks.append(_indexed(body, size))
                case Opcode.STATISTICS:
                    self.counts = dict(mcap.Statistics.read(_stream(body)).channel_message_counts)
                case Opcode.ATTACHMENT_INDEX:
                    entry = mcap.AttachmentIndex.read(_stream(body))
                    if entry.name == SPARSE:
                        self.sparse = list(sparse_blocks(file, entry))
                        continue
                    span = Span(Opcode.ATTACHMENT, entry.offset + HEAD.size, entry.length)
                    name = f"the attachment {entry.name}"
                    left_byte -= self._take_indexed(file, span, name, size)
                case Opcode.METADATA_INDEX:
                    note = mcap.MetadataIndex.read(_stream(body))
                    span = Span(Opcode.METADATA, note.offset + HEAD.size, note.length)
                    name = f"the metadata {note.name}"
                    left_byte -= self._take_indexed(file, span, name, size)
            if left_byte < 0:
                raise DamageError("attachments that overlap")

    def _take_indexed(self, file: BinaryIO, span: Span, name: str, size: int) -> int:
        """Take the record that an index names, and return its length in bytes."""
        span = span._replace(length=span.length - HEAD.size)
        if span.end > size:
            raise DamageError("an index of what cannot be")
        try:
            if read_at(file, span.start, HEAD.size) != HEAD.pack(span.opcode, span.length):
                raise DamageError("not the record that the index names")
            self._take(file, span)
        except DAMAGE as error:
            self._note(Damage(span.start, span.end, _words(error), f"{name} is missing"))
        return span.length

    # --- by a scan -----------------------------------------------------------------------------

    def _scan(self, file: BinaryIO, size: int) -> None:
        """Take every record behind the last that was taken before."""
        at, ended_at, before = self._scanned, None, len(self.blocks)
        holes: list[Damage] = []
        for span in spans(file, at, size):
            if ended_at is not None and span.opcode in _OF_DATA:
                ended_at = None  # that was not the end
            if ended_at is None and span.start > at:
                holes.append(Damage(at, span.start, "not what was written"))
            if span.opcode == Opcode.DATA_END:
                ended_at = span.start
            try:
                self._take(file, span)
            except DAMAGE as error:
                lost = _LOST.get(span.opcode, "")
                holes.append(Damage(span.start, span.end, _words(error), lost))
            at = span.end
        holes += self._settle(file, before)
        for hole in holes:
            start_ns, end_ns = self._times_around(hole)
            self._note(hole._replace(start_ns=start_ns, end_ns=end_ns))
        self._scanned = at if ended_at is None else ended_at
        self._tail = self._end_of(file, ended_at, at, size)

    def _end_of(self, file: BinaryIO, ended_at: int | None, at: int, size: int) -> Damage | None:
        """What is wrong with the end of the file, which has whole records up to `at`."""
        if ended_at is None:
            found = "the file ends before the log does" if at == size else "not what was written"
            return Damage(at, size, found, "", self.blocks[-1].end_ns if self.blocks else None)
        if read_at(file, ended_at, size - ended_at) != _END_MARKS:
            return Damage(ended_at, size, "not how a log ends", _NOTHING)
        return None

    def _times_around(self, hole: Damage) -> tuple[int | None, int | None]:
        """Log times between which the messages of a hole lay."""
        before = [block.end_ns for block in self.blocks if block.offset < hole.start]
        behind = [block.start_ns for block in self.blocks if block.offset > hole.start]
        return before[-1] if before else None, behind[0] if behind else None

    def _settle(self, file: BinaryIO, first: int) -> list[Damage]:
        """Check the times of new chunks, which no checksum covers.

        They follow each other in log order. Where they do not, and in the last chunk, those of the
        messages count. Chunks that cannot be read then are taken out, and returned.
        """
        holes = []
        doubtful = {len(self.blocks) - 1} if len(self.blocks) > first else set()
        reached_ns = self.blocks[first - 1].end_ns if first else 0
        for number, block in enumerate(self.blocks[first:], start=first):
            if not reached_ns <= block.start_ns <= block.end_ns:
                doubtful |= {max(number - 1, 0), number}
            reached_ns = block.end_ns
        for number in sorted(doubtful, reverse=True):
            block = self.blocks[number]
            try:
                block.start_ns, block.end_ns = times_ns_in(block_records(file, block))
            except DAMAGE as error:
                self.blocks.remove(block)
                holes.append(Damage(block.start, block.end, _words(error)))
        return holes

    # --- record by record ----------------------------------------------------------------------

    def _take(self, file: BinaryIO, span: Span) -> None:
        match span.opcode:
            case Opcode.CHUNK:
                self._take_chunk(file, span)
            case Opcode.HEADER:
                self.library = mcap.Header.read(_stream(_body(file, span))).library
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._declare(span.opcode, _body(file, span), known=True)
            case Opcode.ATTACHMENT:
                attachment = attachment_of(_body(file, span))
                if attachment.name == SPARSE:
                    return
                self.attachments[attachment.name] = Attachment(
                    attachment.media_type, attachment.data
                )
            case Opcode.METADATA:
                name, values = metadata_of(_body(file, span))
                if name == SIZES:
                    self.payload_byte = {topic: int(byte) for topic, byte in values.items()}
                elif name == SPARSE:
                    self.sparse_topics = frozenset(values["topics"].split())
                else:
                    self.metadata[name] = values

    def _take_chunk(self, file: BinaryIO, span: Span) -> None:
        """A chunk without an index; it may declare the channels of this one and of others."""
        head = read_at(file, span.offset, CHUNK_HEAD.size)
        start_ns, end_ns, *_ = CHUNK_HEAD.unpack(head)
        block = Block(span.offset, span.length, start_ns, end_ns)
        if not _begins_with_message(file, block):
            data = block_records(file, block)
            opcodes = set()
            for opcode, begin, end in inner_records(data):
                opcodes.add(opcode)
                if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                    self._declare(opcode, data[begin:end])
            if Opcode.MESSAGE not in opcodes:
                return
        self.blocks.append(block)

    def _declare(self, opcode: int, body: bytes, *, known: bool = False) -> None:
        """Take a schema or channel; if `known`, one that has no checksum and says nothing new."""
        if opcode == Opcode.SCHEMA:
            schema = mcap.Schema.read(_stream(body))
            if not (known and schema.id in self.schemas):
                self.schemas[schema.id] = schema
        else:
            channel = mcap.Channel.read(_stream(body))
            if not (known and channel.id in self.channels):
                self.channels[channel.id] = channel


def _begins_with_message(file: BinaryIO, block: Block) -> bool:
    """Whether the first record of a chunk is a message, without reading the others."""
    head = read_at(file, block.offset, CHUNK_HEAD.size)
    name_byte = CHUNK_HEAD.unpack(head)[-1]
    name = read_at(file, block.offset + CHUNK_HEAD.size, name_byte)
    at = block.offset + CHUNK_HEAD.size + name_byte + 8
    if not name:
        return read_at(file, at, 1) == _MESSAGE
    file.seek(at)
    with zstandard.ZstdDecompressor().stream_reader(file, closefd=False) as stream:
        return stream.read(1) == _MESSAGE


def _summary(file: BinaryIO, size: int) -> bytes | None:
    """The summary of a finished log; `None` if there is none, or it is not what was written."""
    end = size - _FOOTER_BYTE - len(MAGIC)
    if end < len(MAGIC):
        return None
    marks = read_at(file, end, _FOOTER_BYTE + len(MAGIC))
    if marks[_FOOTER_BYTE:] != MAGIC or marks[0] != Opcode.FOOTER:
        return None
    footer = mcap.Footer.read(_stream(marks[HEAD.size :]))
    start = footer.summary_start
    if not len(MAGIC) <= start <= end or end - start > GREATEST_RECORD_BYTE:
        return None
    data = read_at(file, start, end - start)
    # The checksum covers the summary, and the footer up to the checksum itself.
    crc = zlib.crc32(marks[: _FOOTER_BYTE - 4], zlib.crc32(data))
    return data if footer.summary_crc == crc else None


def _indexed(body: bytes, size: int) -> Block:
    start_ns, end_ns, offset, length, listed_byte = _INDEX_HEAD.unpack_from(body)
    listed = body[_INDEX_HEAD.size : _INDEX_HEAD.size + listed_byte]
    if offset + length > size or listed_byte % LISTED_CHANNEL.size:
        raise DamageError("an index of what cannot be")
    # The body of a chunk follows its opcode and its length.
    return Block(offset + HEAD.size, length - HEAD.size, start_ns, end_ns, listed)


def _words(error: Exception) -> str:
    return str(error) if isinstance(error, DamageError) else "not what was written"


def _identity(file: BinaryIO) -> tuple[int, int]:
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino


def _size(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(body))


def _body(file: BinaryIO, span: Span) -> bytes:
    return read_at(file, span.offset, span.length)
