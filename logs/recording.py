"""Writing a run's log: one MCAP file, safe on disk up to the last window.

During the run each window is a chunk with a checksum, and the end of an MCAP file stands behind the
last one: whatever stops the writer, any MCAP reader can read the log as it is. After the run the
windows are packed into compressed chunks of a megabyte with an index. So neither the writer's
memory nor the index grows with the number of windows.
"""

import os
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from itertools import count
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, Self

import msgspec
from mcap import records as mcap
from mcap.well_known import MessageEncoding, SchemaEncoding

from farside.logs.file.digest import Digest
from farside.logs.file.mcap_bytes import (
    GREATEST_RECORD_BYTE,
    MAGIC,
    PICTURE,
    chunk_bytes,
    end_marks,
    message_bytes,
    metadata_bytes,
    record_bytes,
)
from farside.logs.file.packing import pack
from farside.logs.file.parts import LIBRARY, LogError
from farside.logs.file.reading import LogFile
from farside.logs.file.schemas import topic_schema
from farside.logs.foxglove.names import PICTURES, PictureTopic
from farside.node import NEVER_NS, Record, Topic
from farside.topics import TOPICS

try:
    _VERSION = version("farside")
except PackageNotFoundError:  # run from a source tree that nobody installed
    _VERSION = "0+source"

_END_MARKS = end_marks()
_CHUNK_BYTE = 1 << 20
_log_time_ns = attrgetter("log_time_ns")


class _Tail:
    """The unwritten tail of a file.

    The file is valid up to `end`, where the end marks follow; `end` moves only once more is on
    disk with new end marks behind it.
    """

    def __init__(self, path: Path, file: int) -> None:
        self.path = path
        self.file = file
        self.end = 0
        self._waiting = bytearray()

    def write(self, data: bytes) -> None:
        """Add what is to be written with the next flush."""
        self._waiting += data

    def flush(self) -> None:
        """Hand everything to the operating system, so that it outlives this process.

        Raises:
            LogError: if it cannot be written. The file then ends where it did.
        """
        if not self._waiting:
            return
        data = self._waiting + _END_MARKS
        try:
            written = 0
            while written < len(data):
                written += os.pwrite(self.file, data[written:], self.end + written)
        except OSError as error:
            with suppress(OSError):  # without the end marks our own reader takes it all the same
                os.ftruncate(self.file, self.end)
                os.pwrite(self.file, _END_MARKS, self.end)
            raise LogError(f"the log {self.path} cannot be written: {error.strerror}") from error
        self.end += len(self._waiting)
        self._waiting.clear()


class Recorder:
    """Writes a new log. A context manager that closes the log on exit, even after an error.

    Every log has a channel for each of `TOPICS` and of `PICTURES`, used or not, so that viewers
    list the same topics for every run. Attachments have no timestamps: nothing in a log depends
    on the wall clock.

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
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        except FileExistsError as error:
            message = f"{path} already exists, and a log is never overwritten: choose another file"
            raise LogError(message) from error
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise LogError(f"the log {path} cannot be written: {reason}") from error
        # Foxglove's library takes its time to load, and only who writes a log needs it.
        from farside.logs.foxglove.pictures import Pictures  # noqa: PLC0415

        self._is_open = True
        self._pictures = Pictures()
        self._digest = Digest()
        self._tail = _Tail(path, self._file)
        self._tail.write(MAGIC + record_bytes(mcap.Header("", f"{LIBRARY} {_VERSION}")))
        self._window: list[bytes] = []
        self._window_byte, self._start_ns, self._end_ns = 0, NEVER_NS, 0
        self._channels, declared = _declarations()
        # Without them no message can be read, so that they stand there twice.
        self._tail.write(declared + declared)
        try:
            self.flush()
        except LogError:
            os.close(self._file)
            path.unlink()
            raise

    @classmethod
    def in_folder(cls, folder: Path, stem: str) -> Self:
        """A new log `STEM-N.mcap` with the first free number, even if others create logs there too.

        Raises:
            LogError: if the folder or the log cannot be created.
        """
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LogError(
                f"{folder}: expected a folder for logs, found: {error.strerror}"
            ) from error
        for number in count(1):
            path = folder / f"{stem}-{number}.mcap"
            if not path.exists():
                try:
                    return cls(path)
                except LogError as error:
                    # Somebody else may have taken the name since.
                    if not isinstance(error.__cause__, FileExistsError):
                        raise
        raise AssertionError

    @property
    def digest(self) -> str:
        """The `Digest` of all records written so far, and of their pictures."""
        return self._digest.hex

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Attach a file to the log, such as the mission."""
        self._tail.write(record_bytes(mcap.Attachment(0, 0, name, media_type, data)))

    def metadata(self, name: str, data: dict[str, str]) -> None:
        """Add a group of keys and values to the log, such as the seed or the result."""
        self._tail.write(metadata_bytes(name, data))

    def write(self, records: Iterable[Record]) -> None:
        """Add records, which must come in log order, and their pictures.

        Whoever reads the log meanwhile takes it that nothing comes later with a time that is there
        already. So records of one time belong between two flushes, and are in one chunk.

        Raises:
            KeyError: if a record's topic is not in `TOPICS`.
        """
        self._add(self._pictures.beside(records))

    def _add(self, records: Sequence[Record]) -> None:
        if not records:
            return
        data = message_bytes(records, self._channels)
        if len(data) > _CHUNK_BYTE and (cut := _cut(records, len(data))):
            self._add(records[:cut])
            self._add(records[cut:])
            return
        self._digest.add(records)
        times_ns = [record.log_time_ns for record in records]
        self._start_ns = min(self._start_ns, *times_ns)
        self._end_ns = max(self._end_ns, *times_ns)
        self._window.append(data)
        self._window_byte += len(data)
        if self._window_byte >= _CHUNK_BYTE:
            self._end_chunk()

    def _end_chunk(self) -> None:
        """Make a chunk of the records since the last."""
        if self._window:
            data = b"".join(self._window)
            self._tail.write(chunk_bytes(data, self._start_ns, self._end_ns, compressed=False))
            self._window.clear()
            self._window_byte, self._start_ns, self._end_ns = 0, NEVER_NS, 0

    def flush(self) -> None:
        """Hand everything to the operating system, so that it outlives this process.

        Call it at the end of every window.

        Raises:
            LogError: if it cannot be written. What was flushed before stays readable.
        """
        self._end_chunk()
        self._tail.flush()

    def close(self, *, packed: bool = True) -> None:
        """Finish the log. Closing again is harmless.

        Args:
            packed: whether to compress and index it. Otherwise it stays readable but unfinished.

        Raises:
            LogError: if the file was deleted or cut during the run, or packing fails; what is
                there then stays as it was at the last flush.
        """
        if not self._is_open:
            return
        self._is_open = False
        try:
            self.flush()
            self.check()
            if packed:
                pack(LogFile(self.path), self.path)
        finally:
            os.close(self._file)

    def check(self) -> None:
        """Check that the file still holds all that was flushed.

        Raises:
            LogError: if it was deleted, replaced or cut.
        """
        ours = os.fstat(self._file)
        if not (self.path.exists() and os.path.samestat(ours, self.path.stat())):
            raise LogError(f"the log {self.path} was deleted or replaced while it was written")
        if ours.st_size < self._tail.end + len(_END_MARKS):
            raise LogError(f"the log {self.path} was cut short while it was written")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: object, _traceback: object) -> None:
        if isinstance(error, LogError):
            # The file cannot be written; what it holds stays as it is.
            with suppress(LogError):
                self.close(packed=False)
        else:
            self.close()


def _cut(records: Sequence[Record], size_byte: int) -> int:
    """Where to cut records that are too long for a chunk: between two times; 0 for nowhere."""
    half = len(records) // 2
    time_ns = records[half].log_time_ns
    begin = bisect_left(records, time_ns, key=_log_time_ns)
    cut = begin or bisect_right(records, time_ns, key=_log_time_ns)
    if cut < len(records):
        return cut
    # A chunk that is too long could not be read at all.
    return half if size_byte > GREATEST_RECORD_BYTE // 2 else 0


class _Declared(NamedTuple):
    """What is declared of a topic."""

    topic: str
    schema: str
    schema_encoding: str
    message_encoding: str
    metadata: dict[str, str]
    data: Callable[[], bytes]

    @classmethod
    def of_topic(cls, topic: Topic[msgspec.Struct]) -> Self:
        name, json = f"{LIBRARY}.{topic.kind.__name__}", MessageEncoding.JSON
        data = partial(topic_schema, topic.kind)
        return cls(topic.name, name, SchemaEncoding.JSONSchema, json, {}, data)

    @classmethod
    def of_picture(cls, topic: PictureTopic) -> Self:
        schema, protobuf = SchemaEncoding.Protobuf, MessageEncoding.Protobuf
        return cls(topic.name, topic.schema_name, schema, protobuf, {PICTURE: "1"}, topic.schema)


@cache
def _declarations() -> tuple[dict[str, int], bytes]:
    """The number of the channel of each topic, and a chunk that declares them all."""
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    records: list[mcap.McapRecord] = []
    for topic in (
        *map(_Declared.of_topic, TOPICS.values()),
        *map(_Declared.of_picture, PICTURES.values()),
    ):
        name = topic.schema
        if name not in schemas:
            schemas[name] = len(schemas) + 1
            schema = mcap.Schema(
                id=schemas[name], data=topic.data(), encoding=topic.schema_encoding, name=name
            )
            records.append(schema)
        channels[topic.topic] = len(channels) + 1
        records.append(
            mcap.Channel(
                id=channels[topic.topic],
                topic=topic.topic,
                message_encoding=topic.message_encoding,
                metadata=topic.metadata,
                schema_id=schemas[name],
            )
        )
    data = b"".join(map(record_bytes, records))
    return channels, chunk_bytes(data, 0, 0, compressed=True)
