"""Packing a log: its messages into compressed chunks of a megabyte, with an index."""

import os
import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap import records as mcap
from mcap.opcode import Opcode

from farside.logs.file.mcap_bytes import (
    CHUNK_OVERHEAD_BYTE,
    DAMAGE,
    HEAD,
    MAGIC,
    MESSAGE_HEAD,
    DamageError,
    chunk_bytes,
    metadata_bytes,
    record_bytes,
)
from farside.logs.file.parts import SIZES, LogError
from farside.logs.file.reading import LogFile
from farside.logs.file.sparse import MEDIA_TYPE, SPARSE, SparseTopics

_CHUNK_BYTE = 1 << 20
_LARGE_CHUNKS = 8  # fewer are as soon read as what would be kept of them
_INDEX_HEAD = struct.Struct("<BQHI")
_CRC = struct.Struct("<I")
_MESSAGE_OVERHEAD_BYTE = MESSAGE_HEAD.size - HEAD.size


class Recovered(NamedTuple):
    """The outcome of recovering a log.

    Attributes:
        path: the new log.
        messages: how many it holds.
        damage: what is missing; see `LogFile.damage`.
    """

    path: Path
    messages: int
    damage: tuple[str, ...]


def recover(log: LogFile) -> Recovered:
    """Write a finished log, beside the old one, with all that is readable of the old one.

    Raises:
        LogError: if it cannot be written, or exists already.
    """
    target = log.path.with_name(f"{log.path.stem}-recovered.mcap")
    if target.exists():
        raise LogError(f"{target} already exists, and a log is never overwritten: move it away")
    return Recovered(target, _replace(target, log, must_be_whole=False), log.damage)


def pack(log: LogFile, target: Path) -> None:
    """Replace `target` by a packed copy of `log`, whole or not at all.

    Raises:
        LogError: if `log` is damaged or the copy cannot be written; `target` stays as it was.
    """
    _replace(target, log, must_be_whole=True)


def _replace(target: Path, log: LogFile, *, must_be_whole: bool) -> int:
    """Write a packed copy of `log`, and return how many messages it holds."""
    scratch = target.with_name(f".{target.name}.{os.getpid()}.packing")
    try:
        with scratch.open("xb") as file:
            count = _Packer(log, file).write()
        if must_be_whole and log.damage:
            raise LogError(f"{log.path} is damaged: {log.damage[0]}")
        scratch.replace(target)
    except OSError as error:
        raise LogError(f"{target} cannot be packed: {error.strerror}") from error
    finally:
        scratch.unlink(missing_ok=True)
    return count


class _Packer:
    """Writes a log as a finished file.

    Args:
        log: the log.
        file: where to write it.
    """

    def __init__(self, log: LogFile, file: BinaryIO) -> None:
        self._log = log
        self._file = file
        self._counts: Counter[int] = Counter()
        self._sizes: Counter[int] = Counter()
        self._chunk_indexes: list[mcap.ChunkIndex] = []
        self._attachment_indexes: list[mcap.AttachmentIndex] = []
        self._metadata_indexes: list[mcap.MetadataIndex] = []
        self._declared = [*log.index.schemas.values(), *log.index.channels.values()]
        self._filled = bytearray(b"".join(map(record_bytes, self._declared)))
        self._sparse = SparseTopics()
        self._early: list[tuple[bytes, dict[int, list[int]]]] = []
        # Of each message log time, offset in the chunk and length, by channel.
        self._places: dict[int, list[int]] = {}

    def write(self) -> int:
        """Write all of it, and return the number of messages."""
        self._file.write(MAGIC + record_bytes(mcap.Header(profile="", library=self._log.library)))
        for name, attachment in self._log.attachments.items():
            self._attach(name, *attachment)
        for block, data in self._log.contents():
            if len(self._filled) + len(data) > _CHUNK_BYTE and self._places:
                self._end_chunk()
            try:
                self._add(data)
            except DAMAGE as error:
                self._log.index.note_block(block, error)
        if self._filled:
            self._end_chunk()
        self._keep_sparse()
        for name, values in self._log.metadata.items():
            self._note(name, values)
        self._note(SIZES, self._sizes_by_topic())
        self._file.write(record_bytes(mcap.DataEnd(0)))
        self._finish()
        return self._counts.total()

    def _attach(self, name: str, media_type: str, data: bytes) -> None:
        at = self._file.tell()
        length = self._file.write(record_bytes(mcap.Attachment(0, 0, name, media_type, data)))
        self._attachment_indexes.append(
            mcap.AttachmentIndex(at, length, 0, 0, len(data), name, media_type)
        )

    def _keep_sparse(self) -> None:
        """Attach the messages of rare topics, where the log is large."""
        if len(self._chunk_indexes) >= _LARGE_CHUNKS:
            topics, data = self._sparse.finish(self._log.index.channels)
            self._attach(SPARSE, MEDIA_TYPE, data)
            self._note(SPARSE, {"topics": topics})

    def _note(self, name: str, values: Mapping[str, str]) -> None:
        at = self._file.tell()
        length = self._file.write(metadata_bytes(name, values))
        self._metadata_indexes.append(mcap.MetadataIndex(at, length, name))

    def _sizes_by_topic(self) -> dict[str, str]:
        channels = self._log.index.channels
        return {channels[number].topic: str(byte) for number, byte in self._sizes.items()}

    # --- chunks --------------------------------------------------------------------------------

    def _add(self, data: bytes) -> None:
        """Add the messages of a chunk of the old file to the chunk in progress.

        Raises:
            DamageError: if they are no messages of known channels; none is added then.
            struct.error: likewise.
        """
        unpack, message = MESSAGE_HEAD.unpack_from, int(Opcode.MESSAGE)
        added: dict[int, list[int]] = {}
        row: list[bytes] = []
        at, start, size, moved = 0, 0, len(data), len(self._filled)
        while at < size:
            opcode, length, channel, _, log_time_ns, _ = unpack(data, at)
            if opcode == message:
                places = added.get(channel)
                if places is None:
                    if channel not in self._log.index.channels:
                        raise DamageError(f"a message of channel {channel}, which is unknown")
                    places = added[channel] = []
                places += (log_time_ns, moved + at, length)
                at += HEAD.size + length
            else:
                row.append(data[start:at])
                start = at = at + HEAD.size + length
                moved = len(self._filled) + sum(map(len, row)) - start
        if at > size:
            raise DamageError(f"{at - size} bytes are missing from the last record")
        self._filled += b"".join((*row, data[start:]))
        for channel, places in added.items():
            self._places.setdefault(channel, []).extend(places)

    def _end_chunk(self) -> None:
        """Write the chunk in progress, and the index of its messages."""
        times_ns = [time_ns for places in self._places.values() for time_ns in places[::3]]
        start_ns, end_ns = min(times_ns, default=0), max(times_ns, default=0)
        data = bytes(self._filled)
        self._early.append((data, self._places))
        chunk = chunk_bytes(data, start_ns, end_ns, compressed=True)
        at = self._file.tell()
        self._file.write(chunk)
        offsets = {}
        for channel, places in self._places.items():
            offsets[channel] = self._file.tell()
            count = len(places) // 3
            self._counts[channel] += count
            self._sizes[channel] += sum(places[2::3]) - count * _MESSAGE_OVERHEAD_BYTE
            self._file.write(_message_index(channel, places))
        self._chunk_indexes.append(
            mcap.ChunkIndex(
                message_start_time=start_ns,
                message_end_time=end_ns,
                chunk_start_offset=at,
                chunk_length=len(chunk),
                message_index_offsets=offsets,
                message_index_length=self._file.tell() - at - len(chunk),
                compression="zstd",
                compressed_size=len(chunk) - CHUNK_OVERHEAD_BYTE,
                uncompressed_size=len(data),
            )
        )
        self._filled.clear()
        self._places = {}
        if len(self._chunk_indexes) >= _LARGE_CHUNKS:
            for early in self._early:
                self._sparse.add(*early)
            self._early.clear()

    # --- the summary ---------------------------------------------------------------------------

    def _finish(self) -> None:
        """Write the summary and the footer."""
        start = self._file.tell()
        groups: dict[int, Sequence[mcap.McapRecord]] = {
            Opcode.SCHEMA: list(self._log.index.schemas.values()),
            Opcode.CHANNEL: list(self._log.index.channels.values()),
            Opcode.STATISTICS: [self._statistics()],
            Opcode.CHUNK_INDEX: self._chunk_indexes,
            Opcode.ATTACHMENT_INDEX: self._attachment_indexes,
            Opcode.METADATA_INDEX: self._metadata_indexes,
        }
        summary, offsets = bytearray(), bytearray()
        for opcode, records in groups.items():
            group = b"".join(map(record_bytes, records))
            offset = mcap.SummaryOffset(opcode, start + len(summary), len(group))
            summary += group
            offsets += record_bytes(offset) if group else b""
        offset_start = start + len(summary)
        summary += offsets
        # The checksum covers the summary, and the footer up to the checksum itself.
        footer = record_bytes(mcap.Footer(start, offset_start, 0))[: -_CRC.size]
        crc = _CRC.pack(zlib.crc32(footer, zlib.crc32(summary)))
        self._file.write(summary + footer + crc + MAGIC)

    def _statistics(self) -> mcap.Statistics:
        indexes = self._chunk_indexes
        return mcap.Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._log.index.channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(indexes),
            message_count=self._counts.total(),
            message_start_time=min((index.message_start_time for index in indexes), default=0),
            message_end_time=max((index.message_end_time for index in indexes), default=0),
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._log.index.schemas),
        )


def _message_index(channel: int, places: list[int]) -> bytes:
    """The index of the messages of a channel in a chunk: log time and offset of each.

    Args:
        channel: its number.
        places: of each message log time, offset and length.
    """
    pairs = places[:]
    del pairs[2::3]
    entries = struct.pack(f"<{len(pairs)}Q", *pairs)
    length = 2 + 4 + len(entries)
    return _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, length, channel, len(entries)) + entries
