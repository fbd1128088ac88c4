"""Messages larger than a frame: cut into fragments, and reassembled at the other end.

A frame is no longer than the MTU. The body of a frame with the flag `FRAGMENT` is

    4 bytes     number of the message
    2           index of the fragment, from 0
    2           count of the fragments, 2 or more
    1 or more   the fragment

all big-endian. A message that fits into a frame is the body as it is.

For the expedited service; the reliable service cuts messages into segments by itself.
"""

import struct
from collections import Counter
from dataclasses import dataclass, field

from farside.link.endpoint.wire import OVERHEAD_BYTE, REPLAY_WINDOW, FrameError, Refusal

_HEADER = struct.Struct(">IHH")
_MAX_COUNT = 2**16 - 1

FRAGMENT_OVERHEAD_BYTE = _HEADER.size
"""Header of a fragment, on top of the overhead of its frame."""

# Memory that Python takes for a fragment on top of its bytes, so that the bound holds.
_HELD_OVERHEAD_BYTE = 128

# How many numbers of closed messages are remembered, so that a late fragment does not reopen one:
# as many as the frames by which a frame may be late.
_CLOSED_REMEMBERED = REPLAY_WINDOW


class Fragmenter:
    """Cuts messages into frame bodies.

    Args:
        mtu_byte: the longest frame.

    Raises:
        ValueError: if a frame of this length cannot hold a fragment.
    """

    def __init__(self, mtu_byte: int) -> None:
        self._body_byte = mtu_byte - OVERHEAD_BYTE
        self._chunk_byte = self._body_byte - FRAGMENT_OVERHEAD_BYTE
        if self._chunk_byte < 1:
            raise ValueError(
                f"expected an MTU of {OVERHEAD_BYTE + FRAGMENT_OVERHEAD_BYTE + 1} bytes or more, "
                f"found {mtu_byte}"
            )

    def cut(self, message: bytes, number: int) -> list[bytes]:
        """The bodies of the frames that carry `message`: the message if it fits, else fragments.

        Args:
            message: any bytes.
            number: of the message. It must never be used again in this direction, not even after
                a restart; `Sealer.next_sequence` is such a number.

        Raises:
            ValueError: if it would need more than 65,535 fragments.
        """
        if len(message) <= self._body_byte:
            return [message]
        step = self._chunk_byte
        count = -(-len(message) // step)
        if count > _MAX_COUNT:
            raise ValueError(
                f"expected a message of {step * _MAX_COUNT} bytes at most with this MTU, "
                f"found {len(message)}"
            )
        return [
            _HEADER.pack(number, index, count) + message[index * step : (index + 1) * step]
            for index in range(count)
        ]


@dataclass(slots=True)
class _Partial:
    """A message of which some fragments have arrived."""

    count: int
    since_ns: int
    chunks: dict[int, bytes] = field(default_factory=dict)
    held_byte: int = 0


class Reassembler:
    """Reassembles the messages of one direction from fragments in any order.

    Its memory is bounded: to make room, it drops the incomplete message that began first.

    Args:
        max_age_ns: how long after its first fragment an incomplete message is dropped.
        max_messages: how many incomplete messages to hold (project default: 64).
        max_byte: how much memory they may take (project default: 4 MiB).

    Attributes:
        refused: how many fragments were refused, by reason.
        surplus: how many fragments were ignored: duplicates, or of a complete or dropped message.
        expired: how many messages were dropped because of their age.
        displaced: how many messages were dropped to make room.
        held_byte: memory that incomplete messages take.
    """

    def __init__(
        self, max_age_ns: int, max_messages: int = 64, max_byte: int = 4 * 1024 * 1024
    ) -> None:
        self._max_age_ns = max_age_ns
        self._max_messages = max_messages
        self._max_byte = max_byte
        self._partials: dict[int, _Partial] = {}  # in order of their first fragment
        self._closed: dict[int, None] = {}  # the last messages that were completed or dropped
        self.refused: Counter[Refusal] = Counter()
        self.surplus = 0
        self.expired = 0
        self.displaced = 0
        self.held_byte = 0

    def add(self, body: bytes, now_ns: int) -> bytes | None:
        """Add a fragment; returns its message if this completes it.

        Args:
            body: the body of a genuine frame.
            now_ns: simulated time, never before that of an earlier call.

        Raises:
            FrameError: if it is no fragment, contradicts another, or its message is too large.
        """
        self.expire(now_ns)
        try:
            number, index, count = _checked_header(body)
            if number in self._closed:
                self.surplus += 1
                return None
            return self._add(number, index, count, body[FRAGMENT_OVERHEAD_BYTE:], now_ns)
        except FrameError as error:
            self.refused[error.reason] += 1
            raise

    def expire(self, now_ns: int) -> None:
        """Drop the messages that have been incomplete for too long."""
        while self._partials:
            number, oldest = next(iter(self._partials.items()))
            if now_ns - oldest.since_ns < self._max_age_ns:
                return
            self._close(number)
            self.expired += 1

    def _add(self, number: int, index: int, count: int, chunk: bytes, now_ns: int) -> bytes | None:
        partial = self._partials.get(number) or _Partial(count, now_ns)
        if partial.count != count:
            raise FrameError(
                f"expected one of {partial.count} fragments of message {number}, "
                f"found one of {count}",
                Refusal.CONFLICTING,
            )
        known = partial.chunks.get(index)
        if known == chunk:
            self.surplus += 1
            return None
        if known is not None:
            raise FrameError(
                f"expected fragment {index} of message {number} as it came before, "
                "found different bytes",
                Refusal.CONFLICTING,
            )
        self._check_size(number, index, count, chunk)
        self._partials[number] = partial
        self._hold(partial, index, chunk)
        if len(partial.chunks) < count:
            self._make_room()
            return None
        self._close(number)
        return b"".join(partial.chunks[index] for index in range(count))

    def _check_size(self, number: int, index: int, count: int, chunk: bytes) -> None:
        # All fragments but the last have the same length, so one of them shows how much is to come.
        # A message that could never be completed must not displace those that could.
        least = count if index < count - 1 else 1
        needed_byte = least * (len(chunk) + _HELD_OVERHEAD_BYTE)
        if needed_byte > self._max_byte:
            raise FrameError(
                f"expected messages that fit in {self._max_byte} bytes of memory, "
                f"found message {number} of {count} fragments",
                Refusal.OVERSIZED,
            )

    def _hold(self, partial: _Partial, index: int, chunk: bytes) -> None:
        taken_byte = len(chunk) + _HELD_OVERHEAD_BYTE
        partial.chunks[index] = chunk
        partial.held_byte += taken_byte
        self.held_byte += taken_byte

    def _make_room(self) -> None:
        while len(self._partials) > self._max_messages or self.held_byte > self._max_byte:
            self._close(next(iter(self._partials)))
            self.displaced += 1

    def _close(self, number: int) -> None:
        self.held_byte -= self._partials.pop(number).held_byte
        self._closed[number] = None
        if len(self._closed) > _CLOSED_REMEMBERED:
            del self._closed[next(iter(self._closed))]


def _checked_header(body: bytes) -> tuple[int, int, int]:
    """Number of the message, index of the fragment, count of fragments.

    Raises:
        FrameError: if the header is invalid, or nothing follows it.
    """
    if len(body) <= FRAGMENT_OVERHEAD_BYTE:
        raise FrameError(
            f"expected a fragment of more than {FRAGMENT_OVERHEAD_BYTE} bytes, found {len(body)}"
        )
    number, index, count = _HEADER.unpack_from(body)
    if count < 2 or index >= count:
        raise FrameError(
            f"expected a fragment index below a count of 2 or more, found {index} of {count}"
        )
    return number, index, count
