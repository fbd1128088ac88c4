"""Reading a run's log, also one whose writer was killed."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

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
"""What decoding wrong bytes ends in: sums, lengths, texts and channels that cannot be."""


class Attachment(NamedTuple):
    """A file inside a log."""

    media_type: str
    data: bytes


class LogEntry(NamedTuple):
    """A record of a log, decoded: `entry` has the type of its topic in `TOPICS`."""

    log_time_ns: int
    publish_time_ns: int
    topic: str
    entry: msgspec.Struct


class _Span(NamedTuple):
    """Where the body of an MCAP record lies in the file."""

    opcode: int
    offset: int
    length: int


def decode(record: Record) -> msgspec.Struct:
    """The entry that a record carries.

    Raises:
        LogError: if the topic is not one of `TOPICS`, or the payload is not of its type.
    """
    topic = TOPICS.get(record.topic)
    if topic is None:
        raise LogError(
            f"topic {record.topic} is unknown here: read the log with the version that wrote it"
        )
    try:
        return topic.decode(record.payload)
    except msgspec.MsgspecError as error:
        where = f"{record.topic} at {to_s(record.log_time_ns)} s"
        raise LogError(f"{where} does not hold a {topic.kind.__name__}: {error}") from error


def decoded(record: Record) -> LogEntry:
    """A record with its entry decoded.

    Raises:
        LogError: as `decode`.
    """
    return LogEntry(record.log_time_ns, record.publish_time_ns, record.topic, decode(record))


class LogFile:
    """A log on disk, looked through once on opening and then read as far as one asks.

    A log whose writer was killed, or is still at work, is read up to its last whole record.

    Attributes:
        path: the file.
        complete: whether the writer finished it.
        library: what wrote it, such as `farside 0.1.0`.
        end_ns: log time of the last message, 0 without any.
        attachments: by name; the last where a name was used twice.
        metadata: by name, likewise.

    Raises:
        LogError: if there is no such file, or it is not a log of Farside's, or it is damaged.
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
                self._look_through(file)
        except OSError as error:
            raise LogError(f"the log {path} cannot be read: {error.strerror}") from error
        if self.library.split(" ")[0] != LIBRARY:
            author = self.library or "an unknown program"
            raise LogError(f"{path} is not a log of Farside's: {author} wrote it")

    def records(self) -> Iterator[Record]:
        """Every message in order, still encoded. Each call reads the file anew."""
        topics: dict[int, str] = {}
        with self.path.open("rb") as file:
            for span in self._chunks:
                with self._damage_told(span):
                    records = _chunk_records(_body(file, span), topics)
                yield from records

    def entries(self) -> Iterator[LogEntry]:
        """Every message in order, decoded one by one as they are asked for.

        Raises:
            LogError: at a message that cannot be decoded, or a part of the file that is damaged.
        """
        for record in self.records():
            yield decoded(record)

    def digest(self) -> str:
        """The `Digest` of all messages, computed anew from the file."""
        return digest_of(self.records())

    def _look_through(self, file: BinaryIO) -> None:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise LogError(f"{self.path} is not a log: it is not an MCAP file")
        for span in _whole_records(file):
            with self._damage_told(span):
                self._note(file, span)

    def _note(self, file: BinaryIO, span: _Span) -> None:
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
    def _damage_told(self, span: _Span) -> Iterator[None]:
        try:
            yield
        except _DAMAGE as error:
            message = f"{self.path} is damaged at byte {span.offset}: only what comes before counts"
            raise LogError(message) from error


def _whole_records(file: BinaryIO) -> Iterator[_Span]:
    """The MCAP records whose bytes are all there, up to the footer."""
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
    """The messages of a chunk. `topics` are those of the channels met so far, by number."""
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
