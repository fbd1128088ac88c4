"""How the `farside` command ends when something fails that is nobody's mistake.

Needs nothing but the standard library: it has to work when the rest cannot even be imported.
"""

import errno
import os
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from farside.escaping import printable

if TYPE_CHECKING:
    from farside.missions.run import FinishedRun

TRACEBACK = "FARSIDE_TRACEBACK"
"""Environment variable: if it is set and not empty, tracebacks are printed."""

INFRASTRUCTURE = 3
"""Exit status for a failure of the machine, or of Farside itself."""

INTERRUPTED = 130
"""Exit status after Ctrl-C."""

_OF_MACHINE = {
    errno.EAGAIN,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EIO,
    errno.EMFILE,
    errno.ENFILE,
    errno.ENOMEM,
    errno.ENOSPC,
}
_STANDARD_ERROR = 2
_TOO_LITTLE_MEMORY = (
    b"farside: expected more memory than the system gives to this process (`ulimit -v`)\n"
)
"""Made beforehand, as then nothing may be left to make it of."""

_SOURCE = Path(__file__).parents[2]


def status_of(run: "FinishedRun") -> int:
    """The exit status of a command that has run a mission."""
    from farside.logs.result import Outcome

    if run.interrupted:
        return INTERRUPTED
    return {Outcome.SUCCESS: 0, Outcome.FAILURE: 1, Outcome.ABORTED: INFRASTRUCTURE}[
        run.result.outcome
    ]


def traceback_wanted() -> bool:
    """Whether the user asked for tracebacks."""
    return bool(os.environ.get(TRACEBACK))


def of_machine(error: BaseException | None) -> bool:
    """Whether the machine lacks something, such as disk space, whatever the user asks for."""
    return isinstance(error, MemoryError) or (
        isinstance(error, OSError) and error.errno in _OF_MACHINE
    )


def in_words(error: OSError) -> str:
    """The reason of an error of the operating system, and the file where there is one."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename is not None else reason


def report(error: BaseException) -> int:
    """Tell a person of an error that nothing in Farside expected; returns the exit status."""
    if traceback_wanted():
        traceback.print_exception(error)
    if isinstance(error, MemoryError):
        error.__traceback__ = None  # lets go of all that was under way
        with suppress(OSError):
            os.write(_STANDARD_ERROR, _TOO_LITTLE_MEMORY)
        return INFRASTRUCTURE
    print(f"farside: {printable(_unexpected(error))}", file=sys.stderr)  # noqa: T201
    return INFRASTRUCTURE


def _unexpected(error: BaseException) -> str:
    found = traceback.format_exception_only(error)[-1].strip().replace("\n", " ")
    return (
        f"a fault of Farside itself, not of its input: {found}{_place(error)}. "
        f"Please report it with the traceback that {TRACEBACK}=1 shows"
    )


def _place(error: BaseException) -> str:
    """The innermost line of ours that the error passed."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(os.path.realpath(frame.filename))
        if path.is_relative_to(_SOURCE) and "site-packages" not in path.parts[len(_SOURCE.parts) :]:
            return f" ({path.relative_to(_SOURCE)}, line {frame.lineno})"
    return ""


def print_error(message: str) -> None:
    """Print a line to standard error, fit for a terminal."""
    for line in f"farside: {message}".split("\n"):
        print(printable(line), file=sys.stderr)  # noqa: T201
