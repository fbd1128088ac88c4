"""The words of ionadmin's commands: sections, numbers and times. Source: ION's own readers."""

import calendar
import re
from collections.abc import Iterator, Sequence

from farside.link.profile.plans.contacts import ContactPlanError
from farside.validation import one_line

_MARKER = re.compile(r"\s*##\s*(begin|end)\s+([a-z0-9]+admin)\b")
_DATE = re.compile(
    r"([0-9]{1,4})/([0-9]{1,2})/([0-9]{1,2})-([0-9]{1,2}):([0-9]{1,2}):([0-9]{1,2})"
    r"(?:\.([0-9]*))?Z?"
)
_HEX = re.compile(r"0[xX][0-9a-fA-F]{1,15}")
_WHOLE = re.compile(r"[0-9]{1,18}")
_DECIMAL = re.compile(r"\+?(?=\.?[0-9])([0-9]{0,18})(?:\.([0-9]*))?")

_FIRST_YEAR, _LAST_YEAR = 1970, 9998  # ION's own dates end in 2038

NANO = 1_000_000_000

LAST_DATE_S = 2**31 - 1
"""ION's last date; a contact that begins then only registers its node."""

Line = tuple[int, str]


def sections(text: str) -> Iterator[Sequence[Line]]:
    """The numbered lines of every run of ionadmin that a file asks for.

    A file for ION's start script holds sections for several programs, each between lines such as
    `## begin ionadmin` and `## end ionadmin`, which a tag may follow; what is in none of ionadmin's
    is for others. A file without such lines is ionadmin's as a whole.

    Raises:
        ContactPlanError: if there are sections, but none of ionadmin's.
    """
    lines = list(enumerate(text.split("\n"), start=1))
    marks = [(number, mark[1], mark[2]) for number, line in lines if (mark := _MARKER.match(line))]
    begins = [(number, program) for number, word, program in marks if word == "begin"]
    if not begins:
        yield lines
        return
    if all(program != "ionadmin" for _, program in begins):
        number, program = begins[0]
        raise ContactPlanError(
            f"line {number}: expected a section `## begin ionadmin`, found one of {program} first, "
            f"and none of ionadmin"
        )
    ends = [number for number, _, _ in marks[1:]] + [len(lines) + 1]
    for (number, word, program), end in zip(marks, ends, strict=True):
        if (word, program) == ("begin", "ionadmin"):
            yield lines[number : end - 1]


def node(word: str) -> int:
    """A node number, which is above 0."""
    number = _whole(word)
    if number is None or number == 0:
        raise ContactPlanError(f"expected a node number above 0, found {one_line(word)}")
    return number


def decimal_nano(word: str, what: str) -> int:
    """A number in billionths of its unit, `what` in errors. ionadmin cuts fractions off."""
    match = _DECIMAL.fullmatch(word)
    number = _whole(match[1] or "0") if match else _whole(word)
    if number is None:
        raise ContactPlanError(f"expected {what}, found {one_line(word)}")
    return number * NANO + _fraction_nano((match and match[2]) or "")


def date_nano(word: str) -> int:
    """Nanoseconds from 1970 to a date in ION's format, in UTC and without leap seconds."""
    if match := _DATE.fullmatch(word):
        year, month, day, hour, minute, second = map(int, match.groups()[:6])
        is_time = (hour < 24 and minute < 60 and second <= 60) or (hour, minute, second) == (
            24,
            0,
            0,
        )
        is_month = _FIRST_YEAR <= year <= _LAST_YEAR and 1 <= month <= 12
        if is_time and is_month and 1 <= day <= calendar.monthrange(year, month)[1]:
            date_s = calendar.timegm((year, month, day, hour, minute, second))
            return date_s * NANO + _fraction_nano(match[7] or "")
    hint = f"; did you mean +{one_line(word)}?" if _DECIMAL.fullmatch(word) else ""
    raise ContactPlanError(
        f"expected a time in seconds such as +60, or a date as yyyy/mm/dd-hh:mm:ss, "
        f"found {one_line(word)}{hint}"
    )


def _whole(word: str) -> int | None:
    """A whole number as the C library reads it; None for any other word.

    Raises:
        ContactPlanError: if ionadmin reads its digits as octal, which few people mean.
    """
    digits = word.removeprefix("+")
    if _HEX.fullmatch(digits):
        return int(digits, 16)
    if not _WHOLE.fullmatch(digits):
        return None
    number = int(digits)
    if digits[0] == "0" and number > 7:  # above the last octal digit
        raise ContactPlanError(
            f"expected a number without zeros before it, found {digits}, which ionadmin reads as "
            f"octal"
        )
    return number


def _fraction_nano(digits: str) -> int:
    return int(digits[:9].ljust(9, "0"))
