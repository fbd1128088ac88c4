"""Mission keys, and which sequence numbers a real process may use under one.

A simulated run derives its key from its seed: anyone can, so it protects nothing, but a run is
the same every time. A real mission has a key file, the same at both ends:

    farside mission key 1
    (64 hexadecimal digits)

and each end has a file for each direction that says from where on no sequence number has been
used, for frames sent or heard. Neither may be put back to an older state, as from a backup:
numbers would be used twice, which gives away the key that authenticates.
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
    """A key file, or a file of sequence numbers, is not there, not whole, not ours or in use."""


def simulated_key(seed: int) -> bytes:
    """The mission key of a simulated run. Not a secret."""
    return _derived(str(seed).encode(), b"farside simulated mission key")


def create_key(path: Path) -> bytes:
    """A new random mission key, written to a file that only its owner may read.

    Raises:
        KeyFileError: if there is such a file.
    """
    key = os.urandom(KEY_BYTE)
    try:
        # Only afterwards does the file have a content, so nobody else ever may read it.
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise KeyFileError(f"{path}: expected no key file there yet, found one") from error
    _write_through(descriptor, f"{_KEY_HEADER}\n{key.hex()}\n")
    _sync_directory(path)
    return key


def read_key(path: Path) -> bytes:
    """The mission key in a file.

    Raises:
        KeyFileError: if there is none, or if others than its owner may read or write it.
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
    """What a file of sequence numbers counts: the frames that this end sent, or those it heard."""

    SENT = "sent"
    HEARD = "heard"


class SequenceFile:
    """The `farside.link.endpoint.wire.Numbers` of one end in one direction, kept in a file.

    The file is one line: `farside sequence 1`, the use, the direction, a fingerprint of the key,
    and the first number that is certainly free. That number is raised on disk, some way ahead,
    before any number below it is used. After a crash, counting goes on above: for the sender some
    numbers are never used, and the receiver refuses as many frames that it might have heard.

    One process at a time has the file open; it gives the file back by `close`, or by ending.

    Args:
        path: of the file.
        key: the mission key.
        direction: where the frames go.
        use: whether they are sent or heard here.
        ahead: how far to raise the number at once (project default: 1024 to send, 64 to hear).

    Attributes:
        first: as on disk when this was opened.

    Raises:
        KeyFileError: if there is no such file for this key, direction and use, or another process
            has it open.
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
        """Make the file for a key that has not been used here yet.

        Raises:
            KeyFileError: if there is such a file.
        """
        lock = _locked(path)
        try:
            if path.exists():
                raise KeyFileError(f"{path}: expected no sequence file there yet, found one")
            _replace(path, f"{_label(key, direction, use)} 0\n")
        finally:
            os.close(lock)

    def reserve(self, sequence: int) -> int:
        """Put on disk that all numbers up to `sequence`, and some ahead, may be used.

        Returns:
            the first number that is not.

        Raises:
            OSError: if the disk does not take it; then `sequence` must not be used.
            KeyFileError: if the file has been closed.
        """
        if self._lock is None:
            raise KeyFileError(f"{self._path}: expected an open sequence file, found it closed")
        end = max(sequence + 1, min(sequence + self._ahead, SEQUENCE_LIMIT))
        _replace(self._path, f"{self._label} {end}\n")
        return end

    def close(self) -> None:
        """Let another process have the file."""
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
    """A descriptor that keeps other processes from the file at `path` until it is closed."""
    # The lock has a file of its own, since the other one is replaced with each change.
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
    """Put `content` at `path`: after a crash there is either the old or the new one, whole."""
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
