"""Measured delays: a time and a one-way delay per line, apart by a comma or white space.

The first line may be a header that names both columns, with their units: `t_ms, delay_us`,
`time (s), owd (ms)`. Without a header, or where it names no unit, they are in seconds. What follows
a `#` is a comment, and empty lines are passed over.
"""

import math
import re
from collections.abc import Iterator

from farside.link.profile.config import DelayPoint
from farside.validation import one_line

_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_GREATEST_S = 1e9
_UNIT = re.compile(r"(?:[_\s]|[\[(])\s*([a-zµ]+)\s*[\])]?\Z")
_TWO_WAY = re.compile(r"(?<![a-z])(?:rtt|ping|round[ _-]?trip)", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_LONGEST_HEADER = 200


class DelayFileError(ValueError):
    """The text is no measurement of delays. Says on which line and why."""


def parse_delays(text: str, name: str) -> tuple[DelayPoint, ...]:
    """The points of a measured delay, in order of time.

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        DelayFileError: if a line is not two numbers of 0 to 1e9 s, times do not grow, a header
            names another unit or a round trip, or there is no point.
    """
    scales, points = (1.0, 1.0), list[DelayPoint]()
    for index, (number, line) in enumerate(_lines(text)):
        where = f"{name}, line {number}"
        if not index and not _NUMBER.match(line):
            scales = _header(line, where)
            continue
        t_s, delay_s = _two_numbers(line, scales, where)
        if points and t_s <= points[-1].t_s:
            raise DelayFileError(
                f"{where}: expected a time after {points[-1].t_s:g} s, as times grow, "
                f"found {t_s:g} s"
            )
        points.append(DelayPoint(t_s=t_s, delay_s=delay_s))
    if not points:
        raise DelayFileError(f"{name}: expected a time and a delay per line, found none")
    return tuple(points)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.split("\n"), start=1):
        if words := line.split("#", 1)[0].strip():
            yield number, words


def _two_numbers(line: str, scales: tuple[float, float], where: str) -> tuple[float, float]:
    words = _columns(line)
    if len(words) != 2 or not all(map(_NUMBER.fullmatch, words)):
        raise DelayFileError(f"{where}: expected a time and a delay, found {one_line(line)}")
    t_s, delay_s = (float(word) * scale for word, scale in zip(words, scales, strict=True))
    for what, value in (("time", t_s), ("delay", delay_s)):
        if not (math.isfinite(value) and 0 <= value <= _GREATEST_S):
            raise DelayFileError(
                f"{where}: expected a {what} of 0 to {_GREATEST_S:g} s, found {value:g} s"
            )
    return t_s, delay_s


def _header(line: str, where: str) -> tuple[float, float]:
    """What the numbers of either column are multiplied by to be seconds."""
    names = [line] if len(line) > _LONGEST_HEADER else _names(line)
    if len(names) != 2:
        raise DelayFileError(
            f"{where}: expected a time and a delay, or the names of two columns, "
            f"found {one_line(line)}"
        )
    if _TWO_WAY.search(names[1]):
        raise DelayFileError(
            f"{where}: expected delays of one way, found the column {one_line(names[1].strip())}; "
            "halve them, and name the column delay_s or delay_ms"
        )
    first, second = (_scale(name.strip().lower(), where) for name in names)
    return first, second


def _names(line: str) -> list[str]:
    # White space before a unit in brackets parts no columns.
    return line.split(",") if "," in line else re.split(r"\s+(?![\[(])", line)


def _scale(name: str, where: str) -> float:
    unit = _UNIT.search(name)
    bracketed = unit is not None and name[unit.start()] in "[("
    if unit is None or (unit[1] not in _UNITS and not bracketed and not _looks_like_unit(unit[1])):
        return 1.0
    if unit[1] not in _UNITS:
        raise DelayFileError(
            f"{where}: expected a unit among {', '.join(_UNITS)}, found {one_line(name)}"
        )
    return _UNITS[unit[1]]


def _looks_like_unit(word: str) -> bool:
    return word in {"m", "min", "minutes", "h", "hours", "d", "days", "millis", "micros", "nanos"}


def _columns(line: str) -> list[str]:
    return [word.strip() for word in line.split(",")] if "," in line else line.split()
