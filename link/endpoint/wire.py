"""The frame on the wire: sealed by one end, opened by the other, refused with a reason if not ours.

    byte 0      `WIRE_VERSION`
    byte 1      flags (upper six bits); length of the sequence number less one (lower two)
    1 to 4      sequence number in this direction, big-endian
    n + 16      body, encrypted with AES-256-GCM, and its tag; all bytes before are associated data
    4           CRC-32 of all bytes before (that of zlib), little-endian

That is 23 bytes beside the body, 24 from frame 256 on, 25 from 65,536 on, 26 from 16,777,216 on.
The CRC tells noise on the way (`corrupted`) from a frame that somebody made up (`forged`).

Each direction has a key of its own, derived from the mission key, so no frame can be turned back.
The nonce is the direction and the sequence number. A number is used once: in simulation they
start at 0, in a real process `farside.link.endpoint.keys.SequenceFile` knows which may have been
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

WIRE_VERSION = 3
"""First byte of every frame. A frame of another version is refused. Every version ends in the CRC,
so that noise in this byte is told from a foreign version."""

KEY_BYTE = 32
"""Length of a mission key."""

OVERHEAD_BYTE = 26
"""What a frame has beside its body, at most."""

SEQUENCE_LIMIT = 2**32
"""Sequence numbers are below this; then a new mission key is due. It is what NIST SP 800-38D, 8.3,
allows for a key at most, and 49 days at 1,000 frames a second."""

REPLAY_WINDOW = 1024
"""How far behind the newest frame an older one may arrive (project default)."""

_LEAST_BYTE = 23
_CRC_OF_WHOLE = 0x2144DF1C  # the CRC-32 of anything that ends in its own CRC-32

_Message = TypeVar("_Message")


class Refusal(StrEnum):
    """Why a frame, or what was in it, was refused.

    Attributes:
        TRUNCATED: shorter than any frame. One that lost less is `CORRUPTED`.
        CORRUPTED: the CRC does not match: noise on the way.
        VERSION: whole, but of another version.
        FORGED: whole, but not sealed with this key for this direction.
        REPLAYED: genuine, but came before, or is too old to tell: so is a duplicate by the link.
        MALFORMED: genuine, but holds what no sender of this version says.
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
    """A frame was refused; the only error that received bytes can cause.

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
        STORED: made before an outage and kept until now; newer values take precedence.
        RELIABLE: belongs to the reliable service; expedited without.
        REPORT: the service's own: what has arrived.
    """

    FRAGMENT = 1
    STORED = 2
    RELIABLE = 4
    REPORT = 8


_NO_FLAGS = Flag(0)
_FLAGS = [Flag(bits) for bits in range(16)]  # looked up, since making one takes a microsecond


class Opened(NamedTuple):
    """What was in a genuine frame."""

    sequence: int
    flags: Flag
    body: bytes


class Numbers(Protocol):
    """Which sequence numbers one end may still use, or has not yet taken, in one direction."""

    @property
    def first(self) -> int:
        """The lowest of which it is certain that it has not been used under this key."""
        ...

    def reserve(self, sequence: int) -> int:
        """Make sure that `sequence` is below `first` after any restart, before it is used.

        Returns:
            the end of what is reserved: up to there no further call is needed.
        """
        ...


class FromZero:
    """The numbers of a simulated end, which never restarts."""

    first = 0

    def reserve(self, sequence: int) -> int:
        """Nothing to do, for all numbers at once."""
        return max(sequence + 1, SEQUENCE_LIMIT)


class Sealer:
    """Makes frames of bodies, for one direction. One owner: not for two threads or processes.

    Args:
        key: the mission key.
        direction: where the frames go.
        numbers: those that are free; by default all, as in simulation.

    Attributes:
        next_sequence: what the next frame will be numbered.

    Raises:
        ValueError: if the key is not `KEY_BYTE` long.
    """

    def __init__(self, key: bytes, direction: Direction, numbers: Numbers | None = None) -> None:
        self._cipher = _Cipher(key, direction)
        self._numbers = numbers or FromZero()
        self.next_sequence = self._reserved = self._numbers.first

    def seal(self, body: bytes, flags: Flag = _NO_FLAGS) -> bytes:
        """`body` as the next frame.

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
        # Before the number is used: whatever goes wrong from here on, it is not used again.
        self.next_sequence = sequence + 1
        width = (sequence.bit_length() + 7) // 8 or 1
        header = bytes((WIRE_VERSION, flags << 2 | width - 1)) + sequence.to_bytes(width, "big")
        sealed = header + self._cipher.encrypt(sequence, body, header)
        return sealed + zlib.crc32(sealed).to_bytes(4, "little")


class Opener:
    """Takes frames of one direction apart, and refuses all but each genuine one, once.

    Args:
        key: the mission key.
        direction: where the frames come from.
        numbers: those not yet taken; by default all, as in simulation. Frames below the first are
            refused, so after a restart nothing from before can be played back.
        window: how far behind the newest frame an older one may arrive.

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
    ) -> None:
        self._cipher = _Cipher(key, direction)
        self._numbers = numbers or FromZero()
        self._first = self._reserved = self._numbers.first
        self._newest = self._first - 1
        self._seen = 0  # bit n: frame `newest - n` has been here
        self._window = window
        self._mask = (1 << window) - 1
        self.refused: Counter[Refusal] = Counter()

    def open(self, wire: bytes) -> Opened:
        """What is in the frame `wire`.

        Raises:
            FrameError: if it is refused. Nothing but the count of refusals has changed then.
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
                f"found one that says {sequence} and was not sealed with its key",
            ) from None
        flags = wire[1] >> 2
        if flags >= len(_FLAGS):
            raise self._refused(
                Refusal.MALFORMED, f"expected known flags in frame {sequence}, found {flags:#08b}"
            )
        self._admit(sequence)
        return Opened(sequence, _FLAGS[flags], body)

    def _admit(self, sequence: int) -> None:
        """Note that a genuine frame is here.

        Raises:
            FrameError: if it has been here before, or may have been.
        """
        ahead = sequence - self._newest
        if ahead > 0:
            if sequence >= self._reserved:
                self._reserved = self._numbers.reserve(sequence)
            # Not shifted by any number that a frame may say: it could be four thousand million.
            self._seen = (self._seen << ahead | 1) & self._mask if ahead < self._window else 1
            self._newest = sequence
            return
        if sequence < self._first or -ahead >= self._window:
            raise self._refused(
                Refusal.REPLAYED,
                f"expected frame {max(self._first, self._newest - self._window + 1)} or later, "
                f"found {sequence}, too old to tell whether it was here before",
            )
        bit = 1 << -ahead
        if self._seen & bit:
            raise self._refused(
                Refusal.REPLAYED, f"expected each frame once, found {sequence} again"
            )
        self._seen |= bit

    def _refused(self, reason: Refusal, found: str) -> FrameError:
        return FrameError(f"{self._cipher} frame {reason}: {found}", reason)


def unpack(body: bytes, decoder: msgspec.msgpack.Decoder[_Message]) -> _Message:
    """The message in a genuine body.

    Raises:
        FrameError: if there is none that `decoder` knows.
    """
    try:
        return decoder.decode(body)
    except (ValueError, RecursionError) as error:
        # msgspec's own errors are ValueErrors; so is a string that is not UTF-8, which it lets
        # pass as it is. Unknown fields nested too deeply are a RecursionError.
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
