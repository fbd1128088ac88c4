"""Contact plans of ION: commands for its program ionadmin. Source: the manual page ionrc(5)."""

import calendar
import re
from collections.abc import Sequence

from farside.link.profile.plans.contacts import (
    Book,
    Contact,
    ContactPlanError,
    Plan,
    Range,
    plan_of,
)
from farside.validation import one_line

_RELATIVE = re.compile(r"\+([0-9]{1,12}(?:\.[0-9]{1,9})?)")
_DATE = re.compile(r"([0-9]{4})/([0-9]{1,2})/([0-9]{1,2})-([0-9]{1,2}):([0-9]{1,2}):([0-9]{1,2})")
_WHOLE = re.compile(r"[0-9]{1,18}")
_DECIMAL = re.compile(r"[0-9]{1,18}(?:\.[0-9]{1,9})?")

_WITHOUT_EFFECT = frozenset("?hqevxsril1^")
"""Commands that neither plan a contact nor move the time."""

_MANAGED = frozenset(
    (
        *("alarm", "clockerr", "clocksync", "consumption", "home", "horizon", "inbound"),
        *("outbound", "outer", "production", "search", "usage", "utcdelta"),
    )
)
"""What the command `m` may manage; none of it bears on the plan."""


def parse_ion(text: str, name: str) -> Plan:
    """Read a plan of ION, a file of commands for its program ionadmin.

    Rates are in bytes per second. A range from a lower to a higher node number holds for both
    directions, unless one in the opposite direction overlaps it. Time 0 is that of `+0` before any
    `@`; in a plan with dates it is the first date. Commands that plan nothing are ignored, and so
    are contacts that only register a node or have no time (a start of -1, a stop of 0).

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        ContactPlanError: if a line is no such command, or contradicts another.
    """
    if text.lstrip()[:1] in {"{", "["}:
        raise ContactPlanError(
            f"{name}, line 1: expected the commands of an ION contact plan, found JSON; "
            f"a plan of HDTN has a name that ends in .json"
        )
    reader = _IonReader()
    for number, line in enumerate(text.split("\n"), start=1):
        try:
            reader.execute(line.partition("#")[0].split())
        except ContactPlanError as error:
            raise ContactPlanError(f"{name}, line {number}: {error}") from None
    reader.imply_ranges()
    return plan_of(reader.contacts, reader.ranges, name, reader.zero_date)


class _IonReader:
    """Executes the commands of a plan one by one, as ionadmin would."""

    def __init__(self) -> None:
        self.contacts: Book[Contact] = Book()
        self.ranges: Book[Range] = Book()
        self._reference_s = 0.0
        self.zero_date: int | None = None
        self._is_relative = False

    def execute(self, words: Sequence[str]) -> None:
        """Execute the command in the words of one line."""
        match words:
            case []:
                pass
            case ["@", *fields]:
                (time,) = _fields(fields, "@", "time")
                self._reference_s = self._time_s(time)
            case [("a" | "c" | "d") as verb, ("contact" | "range") as noun, *fields]:
                self._plan(verb, noun, fields)
            case ["m", what, *_] if what in _MANAGED:
                pass
            case [command, *_] if command in _WITHOUT_EFFECT:
                pass
            case _:
                raise ContactPlanError(
                    "expected a command of ION such as `a contact`, `a range` or `@`, "
                    f"found {one_line(' '.join(words[:2]))}"
                )

    def imply_ranges(self) -> None:
        """Add the implied ranges from higher to lower node numbers."""
        for one in list(self.ranges):
            back = one._replace(source=one.dest, dest=one.source)
            if one.source < one.dest and not self.ranges.overlapping(back):
                self.ranges.add(back)

    def _plan(self, verb: str, noun: str, fields: Sequence[str]) -> None:
        match verb, noun:
            case "a", "contact":
                self._add_contact(fields)
            case "a", "range":
                self._add_range(fields)
            case "c", "contact":
                self._change_contact(fields)
            case "d", _:
                self._delete(noun, fields)
            case _:
                raise ContactPlanError(f"expected `a {noun}` or `d {noun}`, found {verb} {noun}")

    def _add_contact(self, fields: Sequence[str]) -> None:
        names = ("start", "stop", "from", "to", "rate")
        start, stop, source, dest, rate, *rest = _fields(fields, "a contact", *names, confidence=1)
        _check_confidence(rest)
        nodes = _node(source), _node(dest)
        if start != "-1" and stop != "0":
            self.contacts.add(Contact(*self._span_s(start, stop), *nodes, _rate_bit_s(rate)))

    def _add_range(self, fields: Sequence[str]) -> None:
        names = ("start", "stop", "from", "to", "owlt")
        start, stop, source, dest, owlt = _fields(fields, "a range", *names)
        owlt_s = _decimal(owlt, "a light time in seconds")
        self.ranges.add(Range(*self._span_s(start, stop), _node(source), _node(dest), owlt_s))

    def _change_contact(self, fields: Sequence[str]) -> None:
        names = ("start", "from", "to", "rate")
        start, source, dest, rate, *rest = _fields(fields, "c contact", *names, confidence=1)
        _check_confidence(rest)
        (contact,) = self.contacts.take(_node(source), _node(dest), self._time_s(start))
        self.contacts.add(contact._replace(rate_bit_s=_rate_bit_s(rate)))

    def _delete(self, noun: str, fields: Sequence[str]) -> None:
        start, source, dest = _fields(fields, f"d {noun}", "start", "from", "to")
        if start in {"-1", "0"}:  # a contact that was ignored
            return
        begin_s = None if start == "*" else self._time_s(start)
        book = self.contacts if noun == "contact" else self.ranges
        book.take(_node(source), _node(dest), begin_s)

    def _span_s(self, start: str, stop: str) -> tuple[float, float]:
        begin_s, end_s = self._time_s(start), self._time_s(stop)
        if end_s <= begin_s:
            raise ContactPlanError(f"expected a stop after the start {start}, found {stop}")
        return begin_s, end_s

    def _time_s(self, word: str) -> float:
        if match := _RELATIVE.fullmatch(word):
            self._is_relative = self.zero_date is None
            return self._reference_s + float(match[1])
        date = _date(word)
        if self._is_relative:
            raise ContactPlanError(
                f"expected a time such as +60, as before, found the date {word}; "
                f"to use both, start the plan with an `@` and a date"
            )
        if self.zero_date is None:
            self.zero_date = date
        return float(date - self.zero_date)


def _date(word: str) -> int:
    """Seconds from 1970 to a date in ION's format, in UTC and without leap seconds."""
    if match := _DATE.fullmatch(word):
        year, month, day, hour, minute, second = map(int, match.groups())
        is_time = hour < 24 and minute < 60 and second < 60
        is_month = year >= 1970 and 1 <= month <= 12
        if is_time and is_month and 1 <= day <= calendar.monthrange(year, month)[1]:
            return calendar.timegm((year, month, day, hour, minute, second))
    hint = f"; did you mean +{word}?" if _DECIMAL.fullmatch(word) else ""
    raise ContactPlanError(
        f"expected a time in seconds such as +60, or a date as yyyy/mm/dd-hh:mm:ss, "
        f"found {one_line(word)}{hint}"
    )


def _fields(fields: Sequence[str], command: str, *names: str, confidence: int = 0) -> Sequence[str]:
    """`fields`, if there are as many as `names`, and up to `confidence` more."""
    if len(names) <= len(fields) <= len(names) + confidence:
        return fields
    form = " ".join((command, *names, *["[confidence]"] * confidence))
    raise ContactPlanError(f"expected `{form}`, found {len(fields)} words after `{command}`")


def _check_confidence(rest: Sequence[str]) -> None:
    """Check a confidence; contacts count whatever it is, for outages are up to the mission."""
    if rest and not 0 < _decimal(rest[0], "a confidence") <= 1:
        raise ContactPlanError(f"expected a confidence above 0, 1 at most, found {rest[0]}")


def _node(word: str) -> int:
    if not _WHOLE.fullmatch(word):
        raise ContactPlanError(f"expected a node number, found {one_line(word)}")
    return int(word)


def _decimal(word: str, what: str) -> float:
    if not _DECIMAL.fullmatch(word):
        raise ContactPlanError(f"expected {what}, found {one_line(word)}")
    return float(word)


def _rate_bit_s(word: str) -> int:
    if not _WHOLE.fullmatch(word) or int(word) == 0:
        raise ContactPlanError(
            f"expected a whole number of bytes per second above 0, found {one_line(word)}"
        )
    return 8 * int(word)
