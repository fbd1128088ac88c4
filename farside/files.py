"""Text files that people write, read with limits: missions, link profiles, plans and traces."""

import codecs
import os
import re
import stat
import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, BinaryIO

from farside.validation import one_line

MAX_FILE_BYTE = 4 * 1024 * 1024
"""The longest file that is read (project default)."""

MAX_KEY_PARTS = 32
"""The most parts of a dotted key, such as three in `link.up.loss` (project default)."""

_MOST_WORDS = 200

_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(
    rf"""(?<![\w."'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_KEY_PARTS},}}+[ \t]*+[=\]]"""
)


def read_text(
    path: Path | Traversable, *, most_byte: int = MAX_FILE_BYTE, is_old: bool = False
) -> str:
    """The text of a regular file, without the byte order mark that some editors put first.

    Args:
        path: of the file.
        most_byte: how long it may be.
        is_old: whether it may be in Latin-1 as well, where it is not in UTF-8.

    Raises:
        OSError: if it cannot be read.
        ValueError: if it is no regular file, is longer than `most_byte`, or is not in UTF-8.
            The message says what was expected and what was found.
    """
    with open_regular(path) if isinstance(path, Path) else path.open("rb") as file:
        content = file.read(most_byte + 1) or b""
    if len(content) > most_byte:
        raise ValueError(f"expected a file of at most {most_byte} bytes, found a longer one")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if is_old and not content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return content.decode("latin-1")
        line = content.count(b"\n", 0, error.start) + 1
        raise ValueError(
            f"expected text in UTF-8, found byte 0x{content[error.start]:02x} in line {line}"
        ) from error


def open_regular(path: Path) -> BinaryIO:
    """A regular file opened for reading, never waiting for what some of /proc and /sys may bring.

    Raises:
        OSError: if it cannot be opened.
        ValueError: if it is no regular file.
    """
    if "\0" in str(path):
        raise ValueError("expected a path, found one with a null character")
    if not stat.S_ISREG(mode := path.stat().st_mode):
        raise ValueError(f"expected a regular file, found {_kind(mode)}")
    return os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb")


def parse_toml(text: str) -> dict[str, Any]:
    """The table in a TOML document.

    Raises:
        ValueError: if it is not TOML, is nested too deeply, or has a key of more than
            `MAX_KEY_PARTS` parts: the time to read a key grows with the square of its parts.
    """
    if (key := _LONG_KEY.search(text)) is not None:
        line = text.count("\n", 0, key.start()) + 1
        raise ValueError(f"a key of more than {MAX_KEY_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("values nested too deeply") from error
    except tomllib.TOMLDecodeError as error:
        # It may tell of a key of any length.
        words, at, where = str(error).partition(" (at ")
        raise ValueError(one_line(words, _MOST_WORDS) + at + where) from error


def _kind(mode: int) -> str:
    kinds = {
        stat.S_ISDIR: "a folder",
        stat.S_ISFIFO: "a pipe",
        stat.S_ISCHR: "a device",
        stat.S_ISBLK: "a device",
        stat.S_ISSOCK: "a socket",
    }
    return next((kind for is_kind, kind in kinds.items() if is_kind(mode)), "none")
