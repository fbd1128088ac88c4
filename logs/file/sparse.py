"""Copies of the messages of rare topics, so that they are found in a large log without reading it.

Of a topic such as the goals there are few messages, and what is so at a moment depends on all of
them since the start; but they stand all over the log, a few in each chunk. So a large log holds
them once more, together, in an attachment: chunks that follow each other. Nothing depends on it:
where it is missing or damaged, the log itself is read.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import BinaryIO

from mcap import records as mcap

from farside.logs.file.mcap_bytes import CHUNK_HEAD, HEAD, chunk_bytes
from farside.logs.file.parts import Block, read_at
from farside.logs.file.scanning import spans

SPARSE = "farside.sparse"
"""Name of the attachment, and of the metadata that tell which topics it holds."""

MEDIA_TYPE = "application/x-mcap-chunks"

_LEAST_BYTE = 64 * 1024
_SHARE = 2000
_ALL = -1  # a bit for every channel
_CHUNK_BYTE = 1 << 20


class SparseTopics:
    """Collects the messages of those channels that make up no more than 1/2000 of the log each.

    That is little memory, compressed, beside what the log takes on disk (project default).
    """

    def __init__(self) -> None:
        self._sizes: Counter[int] = Counter()
        self._frequent: set[int] = set()
        self._all_byte = 0
        self._filled: list[bytes] = []
        self._filled_byte, self._start_ns, self._end_ns = 0, 0, 0
        self._chunks: list[bytes] = []

    def add(self, data: bytes, places: Mapping[int, list[int]]) -> None:
        """Take the next messages of the log.

        Args:
            data: where they stand.
            places: of each message log time, offset and length of its body, by channel.
        """
        self._all_byte += len(data)
        found: list[tuple[int, int, int]] = []
        for channel, of_channel in places.items():
            if channel in self._frequent:
                continue
            self._sizes[channel] += sum(of_channel[2::3])
            if self._sizes[channel] > max(_LEAST_BYTE, self._all_byte // _SHARE):
                self._frequent.add(channel)
                continue
            rows = zip(of_channel[1::3], of_channel[::3], of_channel[2::3], strict=True)
            found += rows
        for offset, time_ns, length in sorted(found):
            if not self._filled:
                self._start_ns = self._end_ns = time_ns
            self._start_ns = min(self._start_ns, time_ns)
            self._end_ns = max(self._end_ns, time_ns)
            message = data[offset : offset + HEAD.size + length]
            self._filled.append(message)
            self._filled_byte += len(message)
        if self._filled_byte >= _CHUNK_BYTE:
            self._end_chunk()

    def _end_chunk(self) -> None:
        data = b"".join(self._filled)
        self._chunks.append(chunk_bytes(data, self._start_ns, self._end_ns, compressed=True))
        self._filled.clear()
        self._filled_byte = 0

    def finish(self, channels: Mapping[int, mcap.Channel]) -> tuple[str, bytes]:
        """The names of the topics whose messages were all kept, and the attachment."""
        if self._filled:
            self._end_chunk()
        kept = (channels[number].topic for number in channels if number not in self._frequent)
        return " ".join(kept), b"".join(self._chunks)


def sparse_blocks(file: BinaryIO, entry: mcap.AttachmentIndex) -> Iterator[Block]:
    """The chunks of the attachment.

    Raises:
        struct.error: if it is not what was written.
    """
    # Head, two times, name and media type with their lengths, and the length of the data.
    start = entry.offset + HEAD.size + 16 + 4 + len(entry.name) + 4 + len(entry.media_type) + 8
    for span in spans(file, start, start + entry.data_size):
        head = read_at(file, span.offset, CHUNK_HEAD.size)
        start_ns, end_ns, *_ = CHUNK_HEAD.unpack(head)
        yield Block(span.offset, span.length, start_ns, end_ns, channels=_ALL)
