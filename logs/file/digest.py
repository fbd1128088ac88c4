"""The digest of a run: equal digests, equal runs."""

import hashlib
import struct
from collections.abc import Iterable
from itertools import islice

from farside.node import Record

_HEAD = struct.Struct("<HqI")
_AT_ONCE = 1000  # so that they need little memory, and one call of the hash serves them all


class Digest:
    """SHA-256 over topic, log time and payload of every record in order.

    Each record is hashed as a head of 14 bytes, little-endian (length of the topic: 2 bytes,
    unsigned; log time in nanoseconds: 8, signed; length of the payload: 4, unsigned), then the
    topic in UTF-8, then the payload. Equal digests mean equal records.
    """

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._topics: dict[str, bytes] = {}

    def add(self, records: Iterable[Record]) -> None:
        """Add the next records."""
        parts: list[bytes] = []
        pack, encoded = _HEAD.pack, self._topics
        for record in records:
            topic, payload = encoded.get(record.topic), record.payload
            if topic is None:
                topic = encoded[record.topic] = record.topic.encode()
            parts += (pack(len(topic), record.log_time_ns, len(payload)), topic, payload)
        self._hash.update(b"".join(parts))

    @property
    def hex(self) -> str:
        """The digest of all records so far, as 64 hexadecimal digits."""
        return self._hash.hexdigest()


def digest_of(records: Iterable[Record]) -> str:
    """The digest of records in log order; equal to `LogFile.digest` of a log of them."""
    digest = Digest()
    rest = iter(records)
    while some := tuple(islice(rest, _AT_ONCE)):
        digest.add(some)
    return digest.hex
