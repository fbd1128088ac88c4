"""Recorded cycles as JSON Lines: the input of `farside dem learn`."""

import sys
from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import msgspec

from farside.validation import one_line

STDIN = "-"
"""The name of standard input for `read_stream`."""


class StreamError(Exception):
    """The input is not a stream of cycles. The text says where, what was expected and found."""


class RecordedCycle(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One line of a stream.

    Attributes:
        tokens: what was sensed.
        action: the action then performed, `None` if there was none.
    """

    tokens: tuple[str, ...]
    action: str | None


MAX_LINE_BYTE = 1024 * 1024
"""The longest line of a stream (project default)."""

_DECODER = msgspec.json.Decoder(RecordedCycle)


def read_stream(source: str) -> list[RecordedCycle]:
    """All cycles of the file `source`, or of standard input for `-`. Blank lines are skipped.

    Raises:
        StreamError: if the file cannot be read, or a line is not a cycle, or is longer than
            `MAX_LINE_BYTE`.
    """
    if source == STDIN:
        return _cycles("standard input", sys.stdin.buffer)
    try:
        with Path(source).open("rb") as lines:
            return _cycles(source, lines)
    except OSError as error:
        raise StreamError(
            f"{source}: expected a file of cycles, found: {error.strerror}"
        ) from error


def _cycles(name: str, file: BinaryIO) -> list[RecordedCycle]:
    lines = iter(lambda: file.readline(MAX_LINE_BYTE + 1), b"")
    return [
        _cycle(line, f"{name}: line {number}")
        for number, line in enumerate((line.removeprefix(BOM_UTF8) for line in lines), start=1)
        if line.strip()
    ]


def _cycle(line: bytes, where: str) -> RecordedCycle:
    if len(line) > MAX_LINE_BYTE:
        raise StreamError(
            f"{where}: expected at most {MAX_LINE_BYTE} bytes in a line, found a longer one"
        )
    try:
        return _DECODER.decode(line)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        found = one_line(line.decode(errors="backslashreplace").strip())
        raise StreamError(
            f'{where}: expected a cycle such as {{"tokens": ["at:0,0"], "action": "N"}}, with '
            f"null for no action, found {found} ({error})"
        ) from error
