"""Contact plans of HDTN: a JSON object with an array of contacts.

Source: HDTN's router and `cgr::cp_load` (1.3), which read it by boost's property trees.
"""

import json
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple, TypeVar

from farside.link.profile.plans.book import Book
from farside.link.profile.plans.contacts import (
    UNLIMITED_BIT_S,
    Contact,
    ContactPlanError,
    PairProblem,
    Plan,
    Range,
    plan_of,
)
from farside.validation import one_line, shown

_LOOKS_LIKE_ION = re.compile(r"^[ \t]*a[ \t]+(?:contact|range)\s", re.MULTILINE)
_JSON_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*+"|[{}\[\]\n]|NaN|Infinity')
_DECIMAL = re.compile(r"-?[0-9]{1,18}(?:\.[0-9]{0,18})?")

_MAX = 10**18
"""The largest number allowed in a plan."""

_DATES_FROM_S, _DATES_UNTIL_S = 1e9, 250e9
"""Between these, times are dates in POSIX seconds: no plan begins 30 years after its start."""

_Entry = TypeVar("_Entry", Contact, Range)

_MOST_DIGITS = 20
_KEYS_SHOWN = 10
_ENTRY_DEPTH = 3

_MEGABIT = 1_000_000

_KEYS = {
    "source": "a node number",
    "dest": "a node number",
    "startTime": "a time in seconds",
    "endTime": "a time in seconds",
    "rateBitsPerSec": "a rate in bits per second",
    "rate": "a rate in megabits per second",
    "owlt": "a light time in seconds",
}
_WITH_FRACTIONS = frozenset({"startTime", "endTime", "owlt"})
"""HDTN itself takes whole seconds only."""

_BEFORE_0 = frozenset({"startTime", "endTime"})
"""What may be below 0: a contact may have begun before the plan's second 0."""


def parse_hdtn(text: str, name: str) -> Plan:
    """Read a plan of HDTN, a JSON object with an array `contacts`.

    Rates are in bits per second (`rateBitsPerSec`) or megabits per second (`rate`, HDTN's old key);
    0 is for unlimited. Every contact has its light time, 0 where it is not told. Times are seconds,
    or dates in POSIX seconds if all are 10⁹ at least, as for HDTN's option `use-unix-timestamp`:
    then time 0 is that of the earliest contact. Numbers may be strings. Keys that do not bear on
    when a link is up are ignored, and a contact told twice counts once.

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        ContactPlanError: if it is no such object, or there is no contact at all. Contacts that
            cannot be used are kept in the plan's `problems`.
    """
    contacts: Book[Contact] = Book()
    ranges: Book[Range] = Book()
    wrong: dict[int, str] = {}
    entries = _entries(text.removeprefix("\ufeff"), name)
    for number, entry in enumerate(entries):
        try:
            contact, owlt_s = _contact(entry)
            contacts.add(contact)
            ranges.add(Range(*contact[:4], owlt_s))
        except ContactPlanError as error:
            wrong[number] = f"contacts[{number}]: {error}"
    lines = _lines_of(text).entries if wrong else []
    problems = [
        PairProblem(*_pair(entries[number]), f"line {lines[number]}: {why}")
        for number, why in wrong.items()
    ]
    zero = min((one.begin_s for one in contacts), default=0.0)
    if not _DATES_FROM_S <= zero < _DATES_UNTIL_S:
        return plan_of(name, contacts, ranges, problems=problems)
    return plan_of(name, _since(zero, contacts), _since(zero, ranges), zero=zero, problems=problems)


def _since(zero: float, entries: Iterable[_Entry]) -> Iterator[_Entry]:
    for one in entries:
        yield one._replace(begin_s=one.begin_s - zero, end_s=one.end_s - zero)


class _Object(dict[str, object]):
    """An object of JSON; `twice` is a key to which it gives two values, or empty."""

    def __init__(self, pairs: list[tuple[str, object]]) -> None:
        super().__init__(pairs)
        self.twice = "" if len(self) == len(pairs) else _with_two_values(pairs)


def _with_two_values(pairs: list[tuple[str, object]]) -> str:
    values: dict[str, object] = {}
    return next((key for key, one in pairs if values.setdefault(key, one) != one), "")


class _ConstantError(ValueError):
    """JSON has no such number."""


def _entries(text: str, name: str) -> list[_Object]:
    """The objects in the array `contacts`, unchecked."""
    try:
        data = json.loads(
            text, parse_int=_int, parse_constant=_refuse_constant, object_pairs_hook=_Object
        )
    except json.JSONDecodeError as error:
        line, found = error.lineno, error.msg
        if _LOOKS_LIKE_ION.search(text):
            found = "the commands of an ION contact plan, whose name must not end in .json"
    except _ConstantError as error:
        line, found = _lines_of(text).constant, f"{error}, which is not a number of JSON"
    except RecursionError:
        line, found = _lines_of(text).deepest, "arrays and objects nested too deeply"
    else:
        return _objects(data, text, name)
    raise ContactPlanError(f"{name}, line {line}: expected JSON, found {found}")


def _int(digits: str) -> int | str:
    return int(digits) if len(digits) <= _MOST_DIGITS else digits


def _refuse_constant(word: str) -> float:
    raise _ConstantError(word)


def _objects(data: object, text: str, name: str) -> list[_Object]:
    match data:
        case _Object(twice="contacts"):
            found = "an object with two keys contacts"
        case {"contacts": list(entries)}:
            objects = [entry for entry in entries if isinstance(entry, _Object)]
            if len(objects) == len(entries):
                return objects
            found = "an array with other entries"
        case {"contacts": entries}:
            found = shown(entries)
        case dict():
            found = "no such key"
        case _:
            found = "no object"
    line = _lines_of(text).contacts
    raise ContactPlanError(
        f"{name}, line {line}: contacts: expected an array of objects, found {found}"
    )


class _Lines(NamedTuple):
    """The lines of a JSON text on which there is, from 1: 1 for what there is not.

    Attributes:
        entries: the beginning of each entry of the array `contacts`.
        contacts: the last key `contacts` of the outermost object.
        constant: the first NaN or infinity.
        deepest: the most deeply nested value.
    """

    entries: list[int]
    contacts: int
    constant: int
    deepest: int


def _lines_of(text: str) -> _Lines:
    line, depth, most, is_contacts = 1, 0, 0, False
    entries: list[int] = []
    contacts = constant = deepest = 1
    for mark in _JSON_TOKEN.findall(text):
        match mark:
            case "\n":
                line += 1
            case "{" | "[":
                depth += 1
                if depth > most:
                    most, deepest = depth, line
                if depth == _ENTRY_DEPTH and is_contacts and mark == "{":
                    entries.append(line)
            case "}" | "]":
                depth -= 1
            case "NaN" | "Infinity":
                constant = line if constant == 1 else constant
            case _ if depth == 1:
                is_contacts = json.loads(mark, strict=False) == "contacts"
                contacts = line if is_contacts else contacts
    return _Lines(entries, contacts, constant, deepest)


def _contact(entry: _Object) -> tuple[Contact, float]:
    if entry.twice in _KEYS:
        raise ContactPlanError(f"expected one value of {entry.twice}, found two")
    source, dest = _number(entry, "source"), _number(entry, "dest")
    begin_s, end_s = _number(entry, "startTime"), _number(entry, "endTime")
    rate_bit_s = _rate_bit_s(entry)
    owlt_s = _number(entry, "owlt") if _has(entry, "owlt") else 0
    if end_s <= begin_s:
        raise ContactPlanError(
            f"endTime: expected a time after startTime = {begin_s:.12g}, found {end_s:.12g}"
        )
    contact = Contact(float(begin_s), float(end_s), int(source), int(dest), rate_bit_s)
    return contact, float(owlt_s)


def _rate_bit_s(entry: _Object) -> int:
    if "rate" in entry and "rateBitsPerSec" not in entry:
        rate_bit_s = _MEGABIT * int(_number(entry, "rate"))
    elif _has(entry, "rateBitsPerSec"):
        rate_bit_s = int(_number(entry, "rateBitsPerSec"))
    else:
        raise _no_such(entry, "rateBitsPerSec")
    return rate_bit_s or UNLIMITED_BIT_S


def _has(entry: _Object, key: str) -> bool:
    """Whether there is a key.

    Raises:
        ContactPlanError: if there is only one with the same beginning, which HDTN does not read.
    """
    if key in entry:
        return True
    start = key[:4]
    if other := next((one for one in entry if one.casefold().startswith(start)), None):
        raise ContactPlanError(f"expected {_KEYS[key]} as {key}, found {one_line(other)}")
    return False


def _number(entry: _Object, key: str) -> int | float:
    """The number at a key, which may be a string; a whole one except for times."""
    if key not in entry:
        raise _no_such(entry, key)
    value = found = entry[key]
    if isinstance(value, str) and _DECIMAL.fullmatch(value.strip()):
        value = float(value) if "." in value else int(value)
    allowed = (int, float) if key in _WITH_FRACTIONS else (int,)
    least = -_MAX if key in _BEFORE_0 else 0
    if isinstance(value, bool) or not isinstance(value, allowed) or not least <= value <= _MAX:
        raise ContactPlanError(f"{key}: expected {_KEYS[key]}, found {shown(found)}")
    return value


def _no_such(entry: _Object, key: str) -> ContactPlanError:
    keys = [one_line(other) for other in list(entry)[:_KEYS_SHOWN]]
    if len(entry) > _KEYS_SHOWN:
        keys.append(f"{len(entry) - _KEYS_SHOWN} more")
    found = ", ".join(keys) or "none"
    return ContactPlanError(f"{key}: expected {_KEYS[key]}, found no such key, only {found}")


def _pair(entry: _Object) -> tuple[int | None, int | None]:
    """The nodes of an entry; None for what it does not say."""
    return _node_or_none(entry, "source"), _node_or_none(entry, "dest")


def _node_or_none(entry: _Object, key: str) -> int | None:
    try:
        return int(_number(entry, key))
    except ContactPlanError:
        return None
