"""Traces of delivery opportunities in mahimahi's format.

Each line is a whole number of milliseconds from the start, at which 1500 bytes may pass.
"""

import re

from farside.validation import one_line

_WHOLE = re.compile(r"[0-9]{1,15}")


class TraceError(ValueError):
    """The text is no trace. Says on which line and why."""


def parse_trace(text: str, name: str) -> tuple[int, ...]:
    """The times of a trace in milliseconds, in order; a repeated time is several opportunities.

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        TraceError: if a line is no whole number or less than the one before, or if none is above 0,
            since a trace that repeats must have a length.
    """
    times_ms: list[int] = []
    for number, line in enumerate(text.removesuffix("\n").split("\n"), start=1):
        word = line.strip()
        if not _WHOLE.fullmatch(word):
            found = one_line(word) or "an empty line"
            raise TraceError(
                f"{name}, line {number}: expected a whole number of milliseconds, found {found}"
            )
        times_ms.append(int(word))
        if len(times_ms) > 1 and times_ms[-1] < times_ms[-2]:
            raise TraceError(
                f"{name}, line {number}: expected {times_ms[-2]} ms or later, as times do not "
                f"fall, found {times_ms[-1]}"
            )
    if times_ms[-1] == 0:
        raise TraceError(f"{name}: expected a last time above 0 ms, found 0")
    return tuple(times_ms)
