"""Distribution tables in the format of tc-netem: `normal.dist`, `pareto.dist`, or one's own.

Whole numbers of 16 bits, apart by white space: each a deviation from the mean, times 8192, and
each as likely as any other. What follows a `#` is a comment. As in tc, `0x10` and `010` are 16 and
8; what tc passes over or wraps around without a word is refused here.
"""

import re

from farside.validation import one_line

MOST_ENTRIES = 16_384
"""The most entries of a table that tc and the kernel take (iproute2's `tc/q_netem.c`)."""

_NUMBER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]{1,8}|[0-9]{1,11})")


class DistributionError(ValueError):
    """The text is no distribution table. Says on which line and why."""


def parse_distribution(text: str, name: str) -> tuple[int, ...]:
    """The entries of a distribution table, in the order of the file.

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        DistributionError: if there is anything else in it, no entry, or more than 16,384.
    """
    entries: list[int] = []
    for number, line in enumerate(text.split("\n"), start=1):
        for word in line.split("#", 1)[0].split():
            entry = _whole(word)
            if entry is None or not -(1 << 15) <= entry < 1 << 15:
                raise DistributionError(
                    f"{name}, line {number}: expected whole numbers of -32768 to 32767, "
                    f"found {one_line(word)}"
                )
            entries.append(entry)
        if len(entries) > MOST_ENTRIES:
            raise DistributionError(
                f"{name}, line {number}: expected {MOST_ENTRIES} entries at most, found more"
            )
    if not entries:
        raise DistributionError(f"{name}: expected whole numbers, found none")
    return tuple(entries)


def _whole(word: str) -> int | None:
    """A number as C's strtol reads it with base 0."""
    if not _NUMBER.fullmatch(word):
        return None
    digits = word.lstrip("+-")
    base = 16 if digits[:2] in {"0x", "0X"} else 8 if digits[0] == "0" else 10
    try:
        value = int(digits, base)
    except ValueError:  # an 8 or 9 after a leading 0
        return None
    return -value if word[0] == "-" else value
