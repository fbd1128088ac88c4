"""Contact plans of ION: commands for its program ionadmin.

Sources: the manual pages ionrc(5) and ionadmin(1), and what ionadmin does (ION 4.1).
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

from farside.link.profile.plans.book import Book
from farside.link.profile.plans.contacts import (
    Contact,
    ContactPlanError,
    PairProblem,
    Plan,
    Range,
    plan_of,
)
from farside.link.profile.plans.ion_words import (
    LAST_DATE_S,
    NANO,
    date_nano,
    decimal_nano,
    node,
    sections,
)
from farside.validation import one_line

_WITHOUT_EFFECT = frozenset("?hevxsri1^!")
"""Commands that neither plan a contact, nor move the time, nor end ionadmin."""

_LAST = frozenset("qt")
"""Commands after which ionadmin ends."""

_MANAGED = frozenset(
    (
        *("alarm", "clockerr", "clocksync", "consum", "consumption", "home", "horizon", "in"),
        *("inbound", "out", "outbound", "outer", "prod", "production", "search", "usage"),
        "utcdelta",
    )
)
"""What the command `m` may manage; none of it bears on the plan."""

_VERBS = {"a": ("contact", "range"), "c": ("contact",), "d": ("contact", "range")}

_TIMES = {"a": 2, "c": 1, "d": 1}
"""How many times stand between `a contact` and the like and the two nodes."""

_FEWEST = {"a": 5, "c": 4, "d": 3}
"""The fewest words after `a contact` and the like."""


def parse_ion(text: str, name: str) -> Plan:
    """Read a plan of ION, a file of commands for its program ionadmin.

    Rates are in bytes per second. A range from a lower to a higher node number holds for both
    directions, unless one in the opposite direction overlaps it. Time 0 is that of `+0` before any
    `@`; in a plan with dates it is the first date. Commands that plan nothing are passed over, and
    so are contacts without times: those that only register a node (a start of -1) and hypothetical
    ones (a start or stop of 0). What is told twice counts once.

    Args:
        text: the file; in one for ION's start script, the sections of ionadmin are read.
        name: what to call it in errors.

    Raises:
        ContactPlanError: if a line is no command of ionadmin, or there is no contact at all. Lines
            about contacts and ranges that cannot be used are kept in the plan's `problems`.
    """
    text = text.removeprefix("\ufeff")
    if text.lstrip()[:1] in {"{", "["}:
        raise ContactPlanError(
            f"{name}, line 1: expected the commands of an ION contact plan, found JSON; "
            f"a plan of HDTN has a name that ends in .json"
        )
    reader = _IonReader()
    try:
        runs = list(sections(text))
    except ContactPlanError as error:
        raise ContactPlanError(f"{name}, {error}") from None
    for run in runs:
        reader.begin()
        for number, line in run:
            words = line.partition("#")[0].split()
            if words and words[0] in _LAST:
                break
            try:
                reader.execute(words, number)
            except ContactPlanError as error:
                raise ContactPlanError(f"{name}, line {number}: {error}") from None
    reader.imply_ranges()
    return plan_of(
        name,
        reader.contacts,
        reader.ranges,
        zero=reader.zero,
        problems=reader.problems,
        untimed=reader.untimed,
    )


_FOR_EVER = "-1"
"""As a stop of a contact: until ION's last date."""

_LIKE_A_TIME = re.compile(r"[+*]|-1|0$|.*/")


class _Time(NamedTuple):
    """A time in nanoseconds: from 1970 for a date, else from the start of ionadmin."""

    nano: int
    is_date: bool


class _IonReader:
    """Executes the commands of a plan one by one, as ionadmin would."""

    def __init__(self) -> None:
        self.contacts: Book[Contact] = Book()
        self.ranges: Book[Range] = Book()
        self.problems: list[PairProblem] = []
        self.untimed: list[PairProblem] = []
        self._is_dated: bool | None = None  # None until a time is told
        self._zero_nano = 0
        self.begin()

    def begin(self) -> None:
        """Begin a run of ionadmin: relative times count from its start."""
        self._reference = _Time(0, is_date=False)

    @property
    def zero(self) -> float | None:
        """The first date of the plan in POSIX seconds, if it has dates."""
        return self._zero_nano / NANO if self._is_dated else None

    def execute(self, words: Sequence[str], number: int) -> None:
        """Execute the command in the words of one line, whose number is given.

        Raises:
            ContactPlanError: if ionadmin knows no such command.
        """
        match words:
            case []:
                pass
            case ["@", "0"]:
                self.begin()
            case ["@", *fields]:
                (time,) = _fields(fields, "@", "time")
                self._refer_to(self._time(time))
            case [verb, noun, *fields] if noun in _VERBS.get(verb[0], ()):
                try:
                    self._plan(verb[0], noun, fields, number)
                except ContactPlanError as error:
                    pair = _pair(verb[0], fields)
                    self.problems.append(PairProblem(*pair, f"line {number}: {error}"))
            case ["m", what, *_] if what in _MANAGED:
                pass
            case ["b" | "l", "contact" | "range"] | ["l"]:
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

    def _plan(self, verb: str, noun: str, fields: Sequence[str], number: int) -> None:
        match verb, noun:
            case "a", "contact":
                self._add_contact(fields, number)
            case "a", _:
                self._add_range(fields)
            case "c", _:
                self._change_contact(fields)
            case _:
                self._delete(noun, fields)

    def _add_contact(self, fields: Sequence[str], number: int) -> None:
        names = ("start", "stop", "from", "to", "rate")
        start, stop, source, dest, rate, *rest = _fields(fields, "a contact", *names, confidence=1)
        _check_confidence(rest)
        nodes = node(source), node(dest)
        if _is_untimed(start, stop):
            text = (
                f"line {number}: expected a contact with times such as +0 and +60, found "
                f"{one_line(start)} and {one_line(stop)}, which tell ION that it has none"
            )
            self.untimed.append(PairProblem(*nodes, text))
            return
        self.contacts.add(Contact(*self._span_s(start, stop), *nodes, _rate_bit_s(rate)))

    def _add_range(self, fields: Sequence[str]) -> None:
        names = ("start", "stop", "from", "to", "owlt")
        start, stop, source, dest, owlt = _fields(fields, "a range", *names)
        owlt_s = decimal_nano(owlt, "a light time in seconds") / NANO
        self.ranges.add(Range(*self._span_s(start, stop), node(source), node(dest), owlt_s))

    def _change_contact(self, fields: Sequence[str]) -> None:
        names = ("start", "from", "to", "rate")
        start, source, dest, rate, *rest = _fields(fields, "c contact", *names, confidence=1)
        _check_confidence(rest)
        rate_bit_s = _rate_bit_s(rate)
        contact = self.contacts.take(node(source), node(dest), self._time_s(start))
        self.contacts.add(contact._replace(rate_bit_s=rate_bit_s))

    def _delete(self, noun: str, fields: Sequence[str]) -> None:
        start, source, dest = _fields(fields, f"d {noun}", "start", "from", "to")
        book = self.contacts if noun == "contact" else self.ranges
        if start.startswith("*"):
            book.clear(node(source), node(dest))
        elif start not in {"-1", "0"}:  # a contact that was passed over
            book.take(node(source), node(dest), self._time_s(start))

    def _span_s(self, start: str, stop: str) -> tuple[float, float]:
        begin_s = self._time_s(start)
        end_s = self._time_s(stop) if stop != _FOR_EVER else LAST_DATE_S - self._zero_nano / NANO
        if end_s <= begin_s:
            raise ContactPlanError(
                f"expected a stop after the start {one_line(start)}, found {one_line(stop)}"
            )
        return begin_s, end_s

    def _refer_to(self, time: _Time) -> None:
        self._reference = time
        if time.is_date and self._is_dated is None:
            self._is_dated, self._zero_nano = True, time.nano

    def _time_s(self, word: str) -> float:
        """Seconds from the plan's second 0 to the time in `word`."""
        time = self._time(word)
        if self._is_dated is None:
            self._is_dated, self._zero_nano = time.is_date, time.nano if time.is_date else 0
        if time.is_date is not self._is_dated:
            before, now = (
                ("a date", "a time") if self._is_dated else ("a time such as +60", "a date")
            )
            raise ContactPlanError(
                f"expected {before}, as before, found {now}, {one_line(word)}; "
                f"to use both, start the plan with an `@` and a date"
            )
        return (time.nano - self._zero_nano) / NANO

    def _time(self, word: str) -> _Time:
        if not word.startswith("+"):
            return _Time(date_nano(word), is_date=True)
        sign = -1 if word.startswith("+-") else 1
        what = "a time in seconds such as +60"
        offset_nano = sign * decimal_nano(word[1:].removeprefix("-"), what)
        return self._reference._replace(nano=self._reference.nano + offset_nano)


def _is_untimed(start: str, stop: str) -> bool:
    """Whether a contact only registers a node, or is hypothetical: nobody knows when it will be."""
    if start == "-1" or "0" in {start, stop}:
        return True
    return not start.startswith("+") and date_nano(start) // NANO in {0, LAST_DATE_S}


def _pair(verb: str, fields: Sequence[str]) -> tuple[int | None, int | None]:
    """The two nodes that a line is about; None for what it does not say."""
    times = _TIMES[verb]
    if len(fields) < _FEWEST[verb] and not all(map(_LIKE_A_TIME.match, fields[:times])):
        return None, None
    first, second = (*fields[times:], "", "")[:2]
    return _node_or_none(first), _node_or_none(second)


def _node_or_none(word: str) -> int | None:
    try:
        return node(word)
    except ContactPlanError:
        return None


def _fields(fields: Sequence[str], command: str, *names: str, confidence: int = 0) -> Sequence[str]:
    """`fields`, if there are as many as `names`, and up to `confidence` more."""
    if len(names) <= len(fields) <= len(names) + confidence:
        return fields
    form = " ".join((command, *names, *["[confidence]"] * confidence))
    raise ContactPlanError(f"expected `{form}`, found {len(fields)} words after `{command}`")


def _check_confidence(rest: Sequence[str]) -> None:
    """Check a confidence; contacts count whatever it is, for outages are up to the mission."""
    if rest and decimal_nano(rest[0], "a confidence") > NANO:
        raise ContactPlanError(f"expected a confidence of 0 to 1, found {one_line(rest[0])}")


def _rate_bit_s(word: str) -> int:
    what = "a number of bytes per second above 0"
    rate_bit_s = round(8 * decimal_nano(word, what) / NANO)
    if rate_bit_s == 0:
        raise ContactPlanError(f"expected {what}, found {one_line(word)}")
    return rate_bit_s
