"""Reading a run's log, even if its writer was killed."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple, Self

import msgspec
import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC

from farside.logs.recording import LIBRARY, LogError, digest_of
from farside.node import Record, to_s
from farside.topics import TOPICS

_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_TIMES = struct.Struct("<QQ")
_DAMAGE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    LookupError,
    OverflowError,
    MemoryError,
)
"""What decoding damaged bytes raises: bad checksums, lengths, text or channel numbers."""


class Attachment(NamedTuple):
    """A file attached to a log."""

    media_type: str
    data: bytes


class LogEntry(NamedTuple):
    """A record with its message decoded.

    Attributes:
        log_time_ns: see `farside.node.Record`.
        publish_time_ns: likewise.
        topic: name of the topic.
        message: the decoded payload, of the type of the topic in `TOPICS`.
    """

    log_time_ns: int
    publish_time_ns: int
    topic: str
    message: msgspec.Struct

    @classmethod
    def of(cls, record: Record) -> Self:
        """Decode a record.

        Raises:
            LogError: see `decode`.
        """
        return cls(record.log_time_ns, record.publish_time_ns, record.topic, decode(record))


class _Span(NamedTuple):
    """Position of an MCAP record's body in the file, in bytes."""

    opcode: int
    offset: int
    length: int


def decode(record: Record) -> msgspec.Struct:
    """The message of a record.

    Raises:
        LogError: if the topic is not in `TOPICS`, or the payload does not match its type.
    """
    topic = TOPICS.get(record.topic)
    if topic is None:
        raise LogError(
            f"unknown topic {record.topic}: read the log with the version of Farside that wrote it"
        )
    try:
        return topic.decode(record.payload)
    except msgspec.MsgspecError as error:
        where = f"{record.topic} at {to_s(record.log_time_ns)} s"
        raise LogError(f"{where}: expected a {topic.kind.__name__}, found: {error}") from error


class LogFile:
    """A log on disk, indexed when it is opened and read lazily.

    An unfinished log, whose writer was killed or is still running, ends with the last chunk that
    is whole.

    Attributes:
        path: the file.
        complete: whether the writer finished it.
        library: the program that wrote it, such as `farside 0.1.0`.
        end_ns: log time of the last message; 0 if there is none.
        attachments: by name; of several with one name, the last.
        metadata: likewise.

    Raises:
        LogError: if the file cannot be read, is not a Farside log, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete = False
        self.library = ""
        self.end_ns = 0
        self.attachments: dict[str, Attachment] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self._chunks: list[_Span] = []
        try:
            with path.open("rb") as file:
                self._index(file)
        except OSError as error:
            raise LogError(f"the log {path} cannot be read: {error.strerror}") from error
        if self.library.split(" ")[0] != LIBRARY:
            author = self.library or "an unknown program"
            raise LogError(f"{path} is not a Farside log: it was written by {author}")

    def records(self) -> Iterator[Record]:
        """All records in log order. Each call reads the file again.

        Raises:
            LogError: at a damaged part of the file.
        """
        topics: dict[int, str] = {}
        with self.path.open("rb") as file:
            for span in self._chunks:
                with self._reporting_damage(span):
                    records = _chunk_records(_body(file, span), topics)
                yield from records

    def entries(self) -> Iterator[LogEntry]:
        """All records in log order, each decoded when it is reached.

        Raises:
            LogError: at a record that cannot be decoded, or a damaged part of the file.
        """
        for record in self.records():
            yield LogEntry.of(record)

    def digest(self) -> str:
        """The `Digest` of the log, computed from its records."""
        return digest_of(self.records())

    def _index(self, file: BinaryIO) -> None:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise LogError(f"{self.path} is not a log: it is not an MCAP file")
        for span in _whole_records(file):
            with self._reporting_damage(span):
                self._add(file, span)

    def _add(self, file: BinaryIO, span: _Span) -> None:
        match span.opcode:
            case Opcode.HEADER:
                self.library = mcap.Header.read(_body(file, span)).library
            case Opcode.CHUNK:
                self._chunks.append(span)
                file.seek(span.offset)
                _, self.end_ns = _CHUNK_TIMES.unpack(file.read(_CHUNK_TIMES.size))
            case Opcode.ATTACHMENT:
                attachment = mcap.Attachment.read(_body(file, span))
                self.attachments[attachment.name] = Attachment(
                    attachment.media_type, attachment.data
                )
            case Opcode.METADATA:
                metadata = mcap.Metadata.read(_body(file, span))
                self.metadata[metadata.name] = metadata.metadata
            case Opcode.FOOTER:
                file.seek(span.offset + span.length)
                self.complete = file.read() == MCAP0_MAGIC

    @contextmanager
    def _reporting_damage(self, span: _Span) -> Iterator[None]:
        try:
            yield
        except _DAMAGE as error:
            message = f"{self.path} is damaged at byte {span.offset}: nothing after it can be read"
            raise LogError(message) from error


def _whole_records(file: BinaryIO) -> Iterator[_Span]:
    """The complete MCAP records, up to and including the footer."""
    offset, size = len(MCAP0_MAGIC), file.seek(0, 2)
    while offset + _RECORD_HEAD.size <= size:
        file.seek(offset)
        opcode, length = _RECORD_HEAD.unpack(file.read(_RECORD_HEAD.size))
        offset += _RECORD_HEAD.size
        if offset + length > size:
            return
        yield _Span(opcode, offset, length)
        if opcode == Opcode.FOOTER:
            return
        offset += length


def _chunk_records(body: ReadDataStream, topics: dict[int, str]) -> list[Record]:
    """The records in a chunk. `topics` maps the channel numbers seen so far and is added to."""
    records = []
    for part in breakup_chunk(mcap.Chunk.read(body), validate_crc=True):
        if isinstance(part, mcap.Message):
            topic = topics[part.channel_id]
            records.append(Record(topic, part.log_time, part.publish_time, part.data))
        elif isinstance(part, mcap.Channel):
            topics[part.id] = part.topic
    return records


def _body(file: BinaryIO, span: _Span) -> ReadDataStream:
    file.seek(span.offset)
    return ReadDataStream(BytesIO(file.read(span.length)))
