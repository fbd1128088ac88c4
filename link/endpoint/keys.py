"""Mission keys, and which sequence numbers a real process may use with them.

A simulated run derives its key from its seed. Anyone can do that, so it protects nothing, but
every run is the same. A real mission has a key file, the same at both ends:

    farside mission key 1
    (64 hexadecimal digits)

and each end has a sequence file per direction with the first sequence number that has certainly
not been used, for frames sent or received. Neither file may be restored to an older state, for
example from a backup: a nonce would be reused, which gives away the authentication key.
"""

import fcntl
import os
import re
import stat
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import Self

from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from farside.link.endpoint.wire import KEY_BYTE, SEQUENCE_LIMIT
from farside.node import Direction

_KEY_HEADER = "farside mission key 1"


class KeyFileError(Exception):
    """A key file or a sequence file is missing, damaged, in use, or belongs to another key."""


def simulated_key(seed: int) -> bytes:
    """The mission key of a simulated run. Not a secret."""
    return _derived(str(seed).encode(), b"farside simulated mission key")


def create_key(path: Path) -> bytes:
    """Create a random mission key in a file that only its owner may read.

    Raises:
        KeyFileError: if the file exists.
    """
    key = os.urandom(KEY_BYTE)
    try:
        # The mode is set before anything is written, so nobody else can ever read the key.
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise KeyFileError(f"{path}: expected no key file there yet, found one") from error
    _write_through(descriptor, f"{_KEY_HEADER}\n{key.hex()}\n")
    _sync_directory(path)
    return key


def read_key(path: Path) -> bytes:
    """The mission key in a file.

    Raises:
        KeyFileError: if there is none, or if anyone but its owner may read or write it.
    """
    try:
        with path.open(encoding="ascii", errors="replace") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            content = file.read(1024)
    except OSError as error:
        raise KeyFileError(f"{path}: expected a key file, found {error.strerror}") from error
    if mode & 0o077:
        raise KeyFileError(
            f"{path}: expected a key file for its owner alone, found mode {mode:04o}: "
            f"chmod 600 {path}, and make a new key if others may have read this one"
        )
    match = re.fullmatch(_KEY_HEADER + r"\n([0-9a-f]{64})\n", content)
    if match is None:
        raise KeyFileError(
            f"{path}: expected the line {_KEY_HEADER!r} and one of 64 hexadecimal digits, "
            "found something else"
        )
    return bytes.fromhex(match[1])


class Use(StrEnum):
    """What a sequence file counts: the frames that this end sent, or those it received."""

    SENT = "sent"
    HEARD = "heard"


class SequenceFile:
    """The `farside.link.endpoint.wire.Numbers` of one end in one direction, kept in a file.

    The file is one line: `farside sequence 1`, the use, the direction, a fingerprint of the key,
    and the first number that is certainly free. That number is raised on disk, some way ahead,
    before any number below it is used. After a crash, numbering continues from there: the sender
    skips some numbers, and the receiver refuses as many frames that it might have received.

    One process at a time holds the file, until `close` or until the process ends.

    Args:
        path: path of the file.
        key: the mission key.
        direction: the direction of the frames.
        use: whether they are sent or received here.
        ahead: how far to raise the number at once (project default: 1024 to send, 64 to receive).

    Attributes:
        first: the number on disk when the file was opened.

    Raises:
        KeyFileError: if there is no file for this key, direction and use, or another process holds
            it.
    """

    def __init__(
        self, path: Path, key: bytes, direction: Direction, use: Use, ahead: int | None = None
    ) -> None:
        self._path = path
        self._label = _label(key, direction, use)
        self._ahead = ahead or _AHEAD[use]
        self._lock: int | None = _locked(path)
        try:
            self.first = self._read()
        except BaseException:
            self.close()
            raise

    @staticmethod
    def create(path: Path, key: bytes, direction: Direction, use: Use) -> None:
        """Create the file for a key that has never been used at this end.

        Raises:
            KeyFileError: if the file exists.
        """
        lock = _locked(path)
        try:
            if path.exists():
                raise KeyFileError(f"{path}: expected no sequence file there yet, found one")
            _replace(path, f"{_label(key, direction, use)} 0\n")
        finally:
            os.close(lock)

    def reserve(self, sequence: int) -> int:
        """Reserve on disk all numbers up to `sequence`, and some ahead.

        Returns:
            the first number that is not reserved.

        Raises:
            OSError: if writing fails; `sequence` must then not be used.
            KeyFileError: if the file has been closed.
        """
        if self._lock is None:
            raise KeyFileError(f"{self._path}: expected an open sequence file, found it closed")
        end = max(sequence + 1, min(sequence + self._ahead, SEQUENCE_LIMIT))
        _replace(self._path, f"{self._label} {end}\n")
        return end

    def close(self) -> None:
        """Release the file for other processes."""
        if self._lock is not None:
            os.close(self._lock)
        self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _read(self) -> int:
        try:
            content = self._path.read_bytes().decode("ascii", errors="replace")
        except FileNotFoundError as error:
            raise KeyFileError(
                f"{self._path}: expected a sequence file, found none: create it if this key has "
                "never been used at this end; if it has, make a new key"
            ) from error
        match = re.fullmatch(re.escape(self._label) + r" ([0-9]{1,10})\n", content)
        if match is None:
            raise KeyFileError(
                f"{self._path}: expected '{self._label}' and a number, found {content[:80]!r}: "
                "give the file of this key, direction and use, or make a new key"
            )
        return int(match[1])


_AHEAD = {Use.SENT: 1024, Use.HEARD: 64}


def _label(key: bytes, direction: Direction, use: Use) -> str:
    fingerprint = _derived(key, b"farside key fingerprint")[:8].hex()
    return f"farside sequence 1 {use} {direction} {fingerprint}"


def _derived(secret: bytes, info: bytes) -> bytes:
    return HKDF(algorithm=SHA256(), length=KEY_BYTE, salt=None, info=info).derive(secret)


def _locked(path: Path) -> int:
    """A descriptor that locks the file at `path` until it is closed."""
    # The lock is a file of its own, since the sequence file is replaced with every change.
    lock = path.with_name(path.name + ".lock")
    try:
        descriptor = os.open(lock, os.O_WRONLY | os.O_CREAT, 0o600)
    except OSError as error:
        raise KeyFileError(f"{lock}: expected a file to lock, found {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(descriptor)
        raise KeyFileError(
            f"{path}: expected a sequence file that nobody uses, found it in use: "
            "end the other process first"
        ) from error
    return descriptor


def _replace(path: Path, content: str) -> None:
    """Replace the file at `path` atomically: after a crash it has the old or the new content."""
    draft = path.with_name(path.name + ".new")
    _write_through(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), content)
    draft.replace(path)
    _sync_directory(path)


def _write_through(descriptor: int, content: str) -> None:
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync_directory(path: Path) -> None:
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
