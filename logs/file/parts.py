"""What a log is made of when it is read: chunks, attachments, and damage."""

import struct
from dataclasses import dataclass
from typing import BinaryIO, NamedTuple

from farside.logs.file.mcap_bytes import HEAD, channels_in, chunk_records
from farside.node import to_s

LIBRARY = "farside"
"""First word of the library field in the header of every log of Farside's."""

SIZES = "farside.sizes"
"""Name of the metadata that give the length of all payloads of each topic, in bytes."""

LISTED_CHANNEL = struct.Struct("<HQ")
"""An entry of `Block.listed`: number of a channel, and where its messages are indexed."""


class LogError(Exception):
    """A log cannot be written or read; the message tells people which, and why."""


class Attachment(NamedTuple):
    """A file inside a log."""

    media_type: str
    data: bytes


class Damage(NamedTuple):
    """Bytes of a log that cannot be read.

    Attributes:
        start, end: first byte, and the one behind the last.
        found: what is wrong with them.
        lost: what is missing, in words; where it is empty, the messages that stood there.
        start_ns, end_ns: between which log times; `None` for the begin or the end of the run.
    """

    start: int
    end: int
    found: str
    lost: str = ""
    start_ns: int | None = None
    end_ns: int | None = None

    @property
    def sentence(self) -> str:
        """The damage in words."""
        return f"bytes {self.start} to {self.end}: {self.found}; {self.lost or self._times}"

    @property
    def _times(self) -> str:
        since = None if self.start_ns is None else f"{to_s(self.start_ns):.1f} s"
        until = None if self.end_ns is None else f"{to_s(self.end_ns):.1f} s"
        match since, until:
            case None, None:
                return "whatever the run left is missing"
            case None, "0.0 s":
                return "no message after 0.0 s is missing"
            case None, _:
                return f"what came before {until} is missing"
            case _, None:
                return f"what came after {since} is missing"
            case _:
                return f"messages from {since} to {until} are missing"


@dataclass(slots=True, eq=False)
class Block:
    """A chunk in the file, and what it holds.

    Attributes:
        offset, length: of its body.
        start_ns, end_ns: least and greatest log time.
        listed: the numbers of the channels in it, as its index gives them; empty if unknown.
        channels: the same with a bit for each number, once they are known.
    """

    offset: int
    length: int
    start_ns: int
    end_ns: int
    listed: bytes = b""
    channels: int | None = None

    @property
    def start(self) -> int:
        """Where the chunk begins, its head included."""
        return self.offset - HEAD.size

    @property
    def end(self) -> int:
        """Where the chunk ends."""
        return self.offset + self.length

    def has(self, channels: int) -> bool:
        """Whether it may hold messages of any of these channels."""
        if self.channels is None:
            if not self.listed:
                return True
            listed = LISTED_CHANNEL.iter_unpack(self.listed)
            self.channels = sum(1 << number for number, _ in listed)
        return bool(self.channels & channels)

    def learn(self, data: bytes) -> None:
        """Take the numbers of the channels from the records, where no index gave them."""
        if self.channels is None and not self.listed:
            self.channels = sum(1 << number for number in channels_in(data))


def block_records(file: BinaryIO, block: Block) -> bytes:
    """The uncompressed records of a block.

    Raises:
        DamageError: if they are missing, or are not what was written.
        zstandard.ZstdError: if they cannot be decompressed.
        struct.error: if the chunk is too short.
    """
    return chunk_records(read_at(file, block.offset, block.length))


def read_at(file: BinaryIO, offset: int, length: int) -> bytes:
    """The bytes from `offset` on; fewer than `length` where the file ends before."""
    file.seek(offset)
    return file.read(length)
