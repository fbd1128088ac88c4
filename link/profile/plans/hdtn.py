"""Contact plans of HDTN: a JSON object with an array of contacts."""

import json
import re
from collections.abc import Iterator
from itertools import pairwise

from farside.link.profile.plans.contacts import (
    Book,
    Contact,
    ContactPlanError,
    Plan,
    Range,
    plan_of,
)
from farside.validation import one_line, shown

_LOOKS_LIKE_ION = re.compile(r"^\s*a\s+(?:contact|range)\s", re.MULTILINE)
_JSON_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\]\n]')

_MAX = 10**18
"""The largest number allowed in a plan."""

_KEYS = {
    "source": "a node number",
    "dest": "a node number",
    "startTime": "a time in seconds",
    "endTime": "a time in seconds",
    "rateBitsPerSec": "a rate in bits per second",
    "owlt": "a light time in seconds",
}


def parse_hdtn(text: str, name: str) -> Plan:
    """Read a plan of HDTN, a JSON object with an array `contacts`.

    Rates are in bits per second, and every contact has its light time. Keys that do not bear on
    when a link is up are ignored.

    Args:
        text: the file.
        name: what to call it in errors.

    Raises:
        ContactPlanError: if it is no such object, or a contact overlaps another.
    """
    contacts: Book[Contact] = Book()
    ranges: Book[Range] = Book()
    entries = _entries(text, name)
    for line, (number, entry) in zip(_entry_lines(text), enumerate(entries), strict=True):
        try:
            contact, owlt_s = _contact(entry)
            contacts.add(contact)
            ranges.add(Range(*contact[:4], owlt_s))
        except ContactPlanError as error:
            raise ContactPlanError(f"{name}, line {line}: contacts[{number}]: {error}") from None
    return plan_of(contacts, ranges, name)


def _entries(text: str, name: str) -> list[dict[str, object]]:
    """The objects in the array `contacts`, unchecked."""
    try:
        data = json.loads(
            text, parse_constant=_refuse_constant, object_pairs_hook=_with_each_key_once
        )
    except json.JSONDecodeError as error:
        found = error.msg
        if _LOOKS_LIKE_ION.search(text):
            found = "the commands of an ION contact plan, whose name must not end in .json"
        message = f"{name}, line {error.lineno}: expected JSON, found {found}"
        raise ContactPlanError(message) from error
    except (ValueError, RecursionError) as error:
        raise ContactPlanError(f"{name}: expected JSON, found {error}") from error
    match data:
        case {"contacts": list(entries)} if all(isinstance(entry, dict) for entry in entries):
            return entries
        case {"contacts": list(entries)}:
            found = "an array with other entries"
        case {"contacts": entries}:
            found = shown(entries)
        case dict():
            found = "no such key"
        case _:
            found = "no object"
    raise ContactPlanError(f"{name}: contacts: expected an array of objects, found {found}")


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word}, which is not a number of JSON")


def _with_each_key_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    entry = dict(pairs)
    if len(entry) < len(pairs):
        keys = sorted(key for key, _ in pairs)
        twice = next(key for key, following in pairwise(keys) if key == following)
        raise ValueError(f"an object with two keys {one_line(twice)}")
    return entry


def _entry_lines(text: str) -> Iterator[int]:
    """The line on which each entry of the array `contacts` begins, in valid JSON."""
    line, depth, is_contacts = 1, 0, False
    for mark in _JSON_TOKEN.findall(text):
        if mark == "\n":
            line += 1
        elif mark in "{[":
            depth += 1
            if depth == 3 and is_contacts and mark == "{":
                yield line
        elif mark in "}]":
            depth -= 1
        elif depth == 1:
            is_contacts = json.loads(mark) == "contacts"


def _contact(entry: dict[str, object]) -> tuple[Contact, float]:
    for key in entry:
        if key.casefold().startswith("rate") and key != "rateBitsPerSec":
            hint = ", HDTN's old key for megabits per second" if key == "rate" else ""
            raise ContactPlanError(
                f"expected the rate as rateBitsPerSec, in bits per second, found {key}{hint}"
            )
    for key, what in _KEYS.items():
        if key not in entry:
            keys = ", ".join(map(one_line, entry)) or "none"
            raise ContactPlanError(f"{key}: expected {what}, found no such key, only {keys}")
    source, dest, rate_bit_s = (_whole(entry, key) for key in ("source", "dest", "rateBitsPerSec"))
    begin_s, end_s, owlt_s = (_number(entry, key) for key in ("startTime", "endTime", "owlt"))
    if rate_bit_s == 0:
        hint = "which HDTN takes for unlimited: give the rate that the link has"
        raise ContactPlanError(f"rateBitsPerSec: expected bits per second above 0, found 0, {hint}")
    if end_s <= begin_s:
        raise ContactPlanError(
            f"endTime: expected a time after startTime = {begin_s:.12g}, found {end_s:.12g}"
        )
    return Contact(begin_s, end_s, source, dest, rate_bit_s), owlt_s


def _number(entry: dict[str, object], key: str) -> float:
    value = entry[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= _MAX:
        raise ContactPlanError(f"{key}: expected {_KEYS[key]}, found {shown(value)}")
    return float(value)


def _whole(entry: dict[str, object], key: str) -> int:
    value = entry[key]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _MAX:
        raise ContactPlanError(f"{key}: expected {_KEYS[key]}, found {shown(value)}")
    return value
