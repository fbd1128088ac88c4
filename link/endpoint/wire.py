"""The frame on the wire: sealed by one end, opened by the other, refused if not genuine.

    byte 0      `WIRE_VERSION`
    byte 1      flags (upper six bits); length of the sequence number less one (lower two)
    1 to 4      sequence number in this direction, big-endian
    n + 16      body, encrypted with AES-256-GCM, and tag; all bytes before are associated data
    4           CRC-32 (zlib) of all bytes before, little-endian

That is 23 bytes of overhead, 24 from frame 256 on, 25 from 65,536 on, 26 from 16,777,216 on.
The CRC distinguishes noise (`corrupted`) from a frame that somebody made up (`forged`).

Each direction has a key of its own, derived from the mission key, so no frame can be reflected.
The nonce is the direction and the sequence number. A number is used once: in simulation numbers
start at 0; in a real process `farside.link.endpoint.keys.SequenceFile` knows which may have been
used.
"""

import zlib
from collections import Counter
from enum import IntFlag, StrEnum
from typing import NamedTuple, Protocol, TypeVar

import msgspec
from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from farside.node import Direction

WIRE_VERSION = 5
"""First byte of every frame. Frames of other versions are refused. Every version ends in the CRC,
so noise in this byte is not mistaken for another version."""

KEY_BYTE = 32
"""Length of a mission key."""

OVERHEAD_BYTE = 26
"""The most that a frame has on top of its body."""

SEQUENCE_LIMIT = 2**32
"""Sequence numbers are below this; then a new mission key is due. NIST SP 800-38D, 8.3, allows no
more per key. At 1,000 frames a second they last 49 days."""

REPLAY_WINDOW = 1024
"""How far behind the newest frame an older one may arrive (project default).

Stored frames and all others are counted apart, so that a frame is overtaken only by those of higher
priority that have a lifetime of seconds, or must arrive in order."""

RELAYED_WINDOW = 1 << 16
"""The same on a way by other nodes, where frames wait for contacts, and those of higher priority
overtake them there: what is sent in 18 hours at one frame a second (project default)."""

_LEAST_BYTE = 23
_CRC_OF_WHOLE = 0x2144DF1C  # the CRC-32 of anything that ends in its own CRC-32

_Message = TypeVar("_Message")


class Refusal(StrEnum):
    """Why a frame, or its content, was refused.

    Attributes:
        TRUNCATED: shorter than any frame. A frame that lost fewer bytes is `CORRUPTED`.
        CORRUPTED: the CRC does not match, because of noise.
        VERSION: intact, but of another version.
        FORGED: intact, but not sealed with this key for this direction.
        REPLAYED: genuine, but received before, or too old to tell. So are duplicates by the link.
        MALFORMED: genuine, but its content is nothing that a sender of this version sends.
        CONFLICTING: a fragment that contradicts another one of the same message.
        OVERSIZED: a fragment of a message larger than the receiver takes.
    """

    TRUNCATED = "truncated"
    CORRUPTED = "corrupted"
    VERSION = "version"
    FORGED = "forged"
    REPLAYED = "replayed"
    MALFORMED = "malformed"
    CONFLICTING = "conflicting"
    OVERSIZED = "oversized"


class FrameError(Exception):
    """A frame was refused. Received bytes cause no other error.

    Attributes:
        reason: the kind of refusal, for counting.
    """

    def __init__(self, found: str, reason: Refusal = Refusal.MALFORMED) -> None:
        super().__init__(found)
        self.reason = reason


class SequenceExhaustedError(Exception):
    """All sequence numbers of a key and direction have been used; a new key is due."""


class Flag(IntFlag):
    """What a frame carries, and how.

    Attributes:
        FRAGMENT: the body is a fragment of a message, see `farside.link.endpoint.fragments`.
        STORED: of the stream of what was made during an outage and kept since; newer values take
            precedence.
        RELIABLE: a segment of the reliable service; without it, expedited.
        REPORT: a reception report of the reliable service.
    """

    FRAGMENT = 1
    STORED = 2
    RELIABLE = 4
    REPORT = 8


_NO_FLAGS = Flag(0)
_FLAGS = [Flag(bits) for bits in range(16)]  # looked up, since constructing one takes a microsecond


class Opened(NamedTuple):
    """The content of a genuine frame."""

    sequence: int
    flags: Flag
    body: bytes


class Numbers(Protocol):
    """Which sequence numbers one end has not yet sent, or received, in one direction."""

    @property
    def first(self) -> int:
        """The lowest number that has certainly not been used with this key."""
        ...

    def reserve(self, sequence: int) -> int:
        """Ensure, before `sequence` is used, that it is below `first` after any restart.

        Returns:
            the end of the reserved range, up to which no further call is needed.
        """
        ...


class FromZero:
    """The numbers of a simulated end, which never restarts."""

    first = 0

    def reserve(self, sequence: int) -> int:
        """Reserve all numbers at once, for there is nothing to do."""
        return max(sequence + 1, SEQUENCE_LIMIT)


class Sealer:
    """Seals bodies into frames of one direction. Not for use by several threads or processes.

    Args:
        key: the mission key.
        direction: the direction of the frames.
        numbers: the free sequence numbers; by default all, as in simulation.

    Attributes:
        next_sequence: the sequence number of the next frame.

    Raises:
        ValueError: if the key is not `KEY_BYTE` long.
    """

    def __init__(self, key: bytes, direction: Direction, numbers: Numbers | None = None) -> None:
        self._cipher = _Cipher(key, direction)
        self._numbers = numbers or FromZero()
        self.next_sequence = self._reserved = self._numbers.first

    def seal(self, body: bytes, flags: Flag = _NO_FLAGS) -> bytes:
        """Seal `body` into the next frame.

        Raises:
            SequenceExhaustedError: if `SEQUENCE_LIMIT` frames have been sealed.
        """
        sequence = self.next_sequence
        if sequence >= SEQUENCE_LIMIT:
            raise SequenceExhaustedError(
                f"expected a sequence number below {SEQUENCE_LIMIT} for the next {self._cipher} "
                "frame, found all of them used: give both ends a new mission key"
            )
        if sequence >= self._reserved:
            self._reserved = self._numbers.reserve(sequence)
        # Counted before it is used: whatever goes wrong below, the number is not used again.
        self.next_sequence = sequence + 1
        width = (sequence.bit_length() + 7) // 8 or 1
        header = bytes((WIRE_VERSION, flags << 2 | width - 1)) + sequence.to_bytes(width, "big")
        sealed = header + self._cipher.encrypt(sequence, body, header)
        return sealed + zlib.crc32(sealed).to_bytes(4, "little")


class _ReplayWindow:
    """Which of the newest frames of a kind have been received.

    Args:
        first: the lowest number that can be.
        size: how many numbers, up to the newest received, it covers.
    """

    def __init__(self, first: int, size: int) -> None:
        self._newest = first - 1
        self._seen = 0  # bit n: frame `newest - n` has been received
        self._size = size
        self._mask = (1 << size) - 1

    @property
    def oldest(self) -> int:
        """The lowest number that it covers."""
        return self._newest - self._size + 1

    def has(self, sequence: int) -> bool:
        """Whether a frame that is not below `oldest` has been received."""
        return sequence <= self._newest and bool(self._seen >> (self._newest - sequence) & 1)

    def add(self, sequence: int) -> None:
        """Note that a frame that is not below `oldest` has been received."""
        ahead = sequence - self._newest
        if ahead <= 0:
            self._seen |= 1 << -ahead
            return
        # Never shifted by an arbitrary sequence number: it could be four thousand million.
        self._seen = (self._seen << ahead | 1) & self._mask if ahead < self._size else 1
        self._newest = sequence


class Opener:
    """Opens frames of one direction: each genuine frame once, and no other.

    Args:
        key: the mission key.
        direction: the direction of the frames.
        numbers: the sequence numbers not yet received; by default all, as in simulation. Frames
            below the first are refused, so after a restart nothing older can be replayed.
        window: how far behind the newest frame an older one may arrive.
        relayed: whether frames come by way of other nodes; the window is then the wider one.

    Attributes:
        refused: how many frames were refused, by reason.

    Raises:
        ValueError: if the key is not `KEY_BYTE` long.
    """

    def __init__(
        self,
        key: bytes,
        direction: Direction,
        numbers: Numbers | None = None,
        window: int = REPLAY_WINDOW,
        *,
        relayed: bool = False,
    ) -> None:
        self._cipher = _Cipher(key, direction)
        self._numbers = numbers or FromZero()
        self._first = self._reserved = self._numbers.first
        # Stored frames wait below all others, and any number of those may overtake them.
        window = max(window, RELAYED_WINDOW) if relayed else window
        self._windows = {stored: _ReplayWindow(self._first, window) for stored in (False, True)}
        self.refused: Counter[Refusal] = Counter()

    def open(self, wire: bytes) -> Opened:
        """Open the frame `wire`.

        Raises:
            FrameError: if it is refused. Nothing but the count of refusals then changes.
        """
        try:
            return self._open(wire)
        except FrameError as error:
            self.refused[error.reason] += 1
            raise

    def _open(self, wire: bytes) -> Opened:
        size_byte = len(wire)
        if size_byte < _LEAST_BYTE:
            raise self._refused(
                Refusal.TRUNCATED, f"expected {_LEAST_BYTE} bytes or more, found {size_byte}"
            )
        if zlib.crc32(wire) != _CRC_OF_WHOLE:
            raise self._refused(
                Refusal.CORRUPTED, f"expected a CRC that matches, found noise in {size_byte} bytes"
            )
        if wire[0] != WIRE_VERSION:
            raise self._refused(
                Refusal.VERSION, f"expected version {WIRE_VERSION}, found version {wire[0]}"
            )
        body_at = 3 + (wire[1] & 3)
        header = wire[:body_at]
        sequence = int.from_bytes(header[2:], "big")
        try:
            body = self._cipher.decrypt(sequence, wire[body_at:-4], header)
        except InvalidTag:
            raise self._refused(
                Refusal.FORGED,
                f"expected a frame of this mission and direction, "
                f"found one numbered {sequence} that was not sealed with its key",
            ) from None
        flags = wire[1] >> 2
        if flags >= len(_FLAGS):
            raise self._refused(
                Refusal.MALFORMED, f"expected known flags in frame {sequence}, found {flags:#08b}"
            )
        self._admit(sequence, self._windows[bool(_FLAGS[flags] & Flag.STORED)])
        return Opened(sequence, _FLAGS[flags], body)

    def _admit(self, sequence: int, window: "_ReplayWindow") -> None:
        """Note that a genuine frame has been received.

        Raises:
            FrameError: if it has, or may have, been received before.
        """
        if sequence < max(self._first, window.oldest):
            raise self._refused(
                Refusal.REPLAYED,
                f"expected frame {max(self._first, window.oldest)} or later, "
                f"found {sequence}, too old to tell whether it was received before",
            )
        if window.has(sequence):
            raise self._refused(
                Refusal.REPLAYED, f"expected each frame once, found {sequence} again"
            )
        if sequence >= self._reserved:
            self._reserved = self._numbers.reserve(sequence)
        window.add(sequence)

    def _refused(self, reason: Refusal, found: str) -> FrameError:
        return FrameError(f"{self._cipher} frame {reason}: {found}", reason)


def unpack(body: bytes, decoder: msgspec.msgpack.Decoder[_Message]) -> _Message:
    """Decode the message in a genuine body.

    Raises:
        FrameError: if it is no message that `decoder` knows.
    """
    try:
        return decoder.decode(body)
    except (ValueError, RecursionError) as error:
        # msgspec's own errors are ValueErrors, and so is the UnicodeDecodeError that it lets
        # through. Unknown fields that nest too deeply raise a RecursionError.
        raise FrameError(f"expected a message, found {error}") from error


class _Cipher:
    """AES-256-GCM for one direction of a mission, with sequence numbers for nonces."""

    def __init__(self, key: bytes, direction: Direction) -> None:
        if len(key) != KEY_BYTE:
            raise ValueError(f"expected a mission key of {KEY_BYTE} bytes, found {len(key)}")
        info = f"farside link {WIRE_VERSION} {direction}".encode()
        derived = HKDF(algorithm=SHA256(), length=KEY_BYTE, salt=None, info=info).derive(key)
        self._aead = AESGCM(derived)
        self._direction = direction
        self._nonce_prefix = direction.encode().ljust(4, b"\0")

    def __str__(self) -> str:
        return self._direction

    def encrypt(self, sequence: int, body: bytes, header: bytes) -> bytes:
        nonce = self._nonce_prefix + sequence.to_bytes(8, "big")
        return self._aead.encrypt(nonce, body, header)

    def decrypt(self, sequence: int, sealed: bytes, header: bytes) -> bytes:
        nonce = self._nonce_prefix + sequence.to_bytes(8, "big")
        return self._aead.decrypt(nonce, sealed, header)
