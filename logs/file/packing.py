"""Packing a log: its messages into compressed chunks of a megabyte, with an index."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.writer import Writer

from farside.logs.file.index import LogError
from farside.logs.file.reading import LogFile
from farside.node import Record

_CHUNK_BYTE = 1 << 20


class Recovered(NamedTuple):
    """The outcome of recovering a log.

    Attributes:
        path: the new log.
        messages: how many it holds.
        damage: what made the rest unreadable; `None` if nothing did.
    """

    path: Path
    messages: int
    damage: str | None


def recover(log: LogFile) -> Recovered:
    """Write a finished log, beside the old one, with all that is readable of an unfinished one.

    Raises:
        LogError: if it cannot be written, or exists already.
    """
    target = log.path.with_name(f"{log.path.stem}-recovered.mcap")
    if target.exists():
        raise LogError(f"{target} already exists, and a log is never overwritten: move it away")
    readable = _Readable(log)
    pack(log, target, readable)
    return Recovered(target, readable.count, readable.damage)


class _Readable:
    """The records of a log up to the first damage."""

    def __init__(self, log: LogFile) -> None:
        self._log = log
        self.count = 0
        self.damage: str | None = None

    def __iter__(self) -> Iterator[Record]:
        try:
            for record in self._log.records(pictures=True):
                yield record
                self.count += 1
        except LogError as error:
            self.damage = str(error)


def pack(log: LogFile, target: Path, records: Iterable[Record] | None = None) -> None:
    """Replace `target` by a packed copy of `log`, whole or not at all.

    Args:
        log: the log to copy.
        target: the file to replace.
        records: the records to copy, if not all of them.

    Raises:
        LogError: if `log` is damaged or the copy cannot be written; `target` stays as it was.
    """
    scratch = target.with_name(f".{target.name}.{os.getpid()}.packing")
    try:
        with scratch.open("xb") as file:
            _write(log, log.records(pictures=True) if records is None else records, file)
        scratch.replace(target)
    except OSError as error:
        raise LogError(f"{target} cannot be packed: {error.strerror}") from error
    finally:
        scratch.unlink(missing_ok=True)


def _write(log: LogFile, records: Iterable[Record], file: BinaryIO) -> None:
    writer = Writer(file, chunk_size=_CHUNK_BYTE)
    writer.start(library=log.library)
    schemas = {
        number: writer.register_schema(schema.name, schema.encoding, schema.data)
        for number, schema in log.index.schemas.items()
    }
    channels = {
        channel.topic: writer.register_channel(
            channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
        )
        for channel in log.index.channels.values()
    }
    for name, attachment in log.attachments.items():
        writer.add_attachment(0, 0, name, attachment.media_type, attachment.data)
    for record in records:
        writer.add_message(
            channels[record.topic], record.log_time_ns, record.payload, record.publish_time_ns
        )
    for name, metadata in log.metadata.items():
        writer.add_metadata(name, dict(metadata))
    writer.finish()
