"""The standard streams of the `farside` command, where nobody may be left to read them."""

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO, cast

_SIGPIPE_STATUS = 141  # what a shell shows for a program that SIGPIPE ended
_INFRASTRUCTURE = 3
_STANDARD_STREAMS = 3


class OutputError(Exception):
    """Standard output takes no more. No OSError: others would take it for one of their own.

    Attributes:
        status: the exit status that says so.
        message: what to tell a person; `None` where whoever read has merely seen enough.
    """

    def __init__(self, error: OSError) -> None:
        super().__init__(str(error))
        broken_pipe = error.errno == errno.EPIPE
        self.status = _SIGPIPE_STATUS if broken_pipe else _INFRASTRUCTURE
        self.message = (
            None if broken_pipe else f"standard output cannot be written: {error.strerror}"
        )


class _Output(io.TextIOWrapper):
    """A stream that fails once, with `OutputError`, and takes everything after that."""

    def write(self, text: str, /) -> int:
        with self._told():
            return super().write(text)

    def flush(self) -> None:
        with self._told():
            super().flush()

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            # What is still buffered has to go somewhere when the interpreter ends.
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            self._failed(error)

    def _failed(self, error: OSError) -> None:
        raise OutputError(error) from error


class _Errors(_Output):
    """A stream for words on the side: a run goes on without anybody who reads them."""

    def write(self, text: str, /) -> int:
        super().write(text)
        return len(text)

    def _failed(self, error: OSError) -> None:
        pass


def fill_standard_streams() -> None:
    """Open what was closed, so that no log or socket gets the number of a standard stream.

    What is written there falls away.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) < _STANDARD_STREAMS:
        os.set_inheritable(number, True)  # noqa: FBT003
    os.close(number)
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", closefd=False)


@contextmanager
def telling_streams() -> Iterator[None]:
    """Within this, standard output fails with `OutputError`, and standard error never.

    Raises:
        OutputError: also at the end, if what was buffered cannot be written.
    """
    for name, kind in (("stdout", _Output), ("stderr", _Errors)):
        bare = getattr(sys, name)
        setattr(sys, name, _wrapped(kind, bare))
        # Textual draws on the original one, which is of no use from now on.
        if getattr(sys, f"__{name}__") is bare:
            setattr(sys, f"__{name}__", getattr(sys, name))
    try:
        yield
    finally:
        sys.stdout.flush()


def _wrapped(kind: type[_Output], stream: TextIO) -> TextIO:
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    settings = (stream.encoding, stream.errors, None, stream.line_buffering)
    return cast("TextIO", kind(stream.detach(), *settings))
