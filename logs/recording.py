"""Writing a run's log: one MCAP file, which survives a crash up to the last window."""

import hashlib
import struct
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Self

import msgspec
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import Writer

from farside.logs.schemas import topic_schema
from farside.node import Record, Topic
from farside.topics import TOPICS

LIBRARY = "farside"
"""First word of the library field in the header of a log; marks the file as a Farside log."""

try:
    _VERSION = version("farside")
except PackageNotFoundError:  # running from a source tree that is not installed
    _VERSION = "0+source"

_DIGEST_HEAD = struct.Struct("<HqI")


class LogError(Exception):
    """A log cannot be written or read. The text, meant for people, names the log and the reason."""


class Digest:
    """SHA-256 over topic, log time and payload of every record in order.

    Each record is hashed as a head of 14 bytes, little-endian (length of the topic: 2 bytes,
    unsigned; log time in nanoseconds: 8, signed; length of the payload: 4, unsigned), then the
    topic in UTF-8, then the payload. Equal digests mean equal records.
    """

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def add(self, record: Record) -> None:
        """Add the next record."""
        topic, payload = record.topic.encode(), record.payload
        head = _DIGEST_HEAD.pack(len(topic), record.log_time_ns, len(payload))
        self._hash.update(head + topic + payload)

    @property
    def hex(self) -> str:
        """The digest of all records so far, as 64 hexadecimal digits."""
        return self._hash.hexdigest()


def digest_of(records: Iterable[Record]) -> str:
    """The digest of records in log order; equal to `LogFile.digest` of a log of them."""
    digest = Digest()
    for record in records:
        digest.add(record)
    return digest.hex


class Recorder:
    """Writes a new log. A context manager that closes the log on exit, even after an error.

    Every log has a channel for each of `TOPICS`, used or not, so that viewers list the same
    topics for every run. Attachments have no timestamps: nothing in a log depends on the wall
    clock.

    Args:
        path: the file to create, in an existing folder.

    Attributes:
        path: the file.

    Raises:
        LogError: if `path` exists (a log is never overwritten) or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("xb")
        except FileExistsError:
            message = f"{path} already exists, and a log is never overwritten: choose another file"
            raise LogError(message) from None
        except OSError as error:
            raise LogError(f"the log {path} cannot be written: {error.strerror}") from error
        self._digest = Digest()
        self._writer = Writer(self._file)
        self._writer.start(library=f"{LIBRARY} {_VERSION}")
        self._schemas: dict[type[msgspec.Struct], int] = {}
        self._channels = {topic.name: self._register(topic) for topic in TOPICS.values()}
        self._writer.flush()

    def _register(self, topic: Topic[msgspec.Struct]) -> int:
        kind = topic.kind
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(
                f"farside.{kind.__name__}", SchemaEncoding.JSONSchema, topic_schema(kind)
            )
        return self._writer.register_channel(topic.name, MessageEncoding.JSON, self._schemas[kind])

    @property
    def digest(self) -> str:
        """The `Digest` of all records written so far."""
        return self._digest.hex

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Attach a file to the log, such as the mission."""
        self._writer.add_attachment(0, 0, name, media_type, data)

    def metadata(self, name: str, data: dict[str, str]) -> None:
        """Add a group of keys and values to the log, such as the seed or the result."""
        self._writer.add_metadata(name, data)

    def write(self, records: Iterable[Record]) -> None:
        """Add records, which must come in log order.

        Raises:
            KeyError: if a record's topic is not in `TOPICS`.
        """
        for record in records:
            self._writer.add_message(
                self._channels[record.topic],
                record.log_time_ns,
                record.payload,
                record.publish_time_ns,
            )
            self._digest.add(record)

    def flush(self) -> None:
        """Finish the chunk and hand it to the operating system, so that it outlives this process.

        Call it at the end of every window. It costs little if nothing was written.
        """
        self._writer.flush()

    def close(self) -> None:
        """Finish the log with its index and footer. Closing it again does nothing."""
        if not self._file.closed:
            self._writer.finish()
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
