"""The digest of a run: equal digests, equal runs."""

import hashlib
import struct
from collections.abc import Iterable

from farside.node import Record

_HEAD = struct.Struct("<HqI")


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
        head = _HEAD.pack(len(topic), record.log_time_ns, len(payload))
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
