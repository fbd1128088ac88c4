"""The first record in which two rows of them differ, and what in it."""

from collections.abc import Iterator
from typing import Any

import msgspec

from farside.logs.file.parts import LogError
from farside.logs.file.reading import LogEntry
from farside.logs.story.sentences import sentence
from farside.node import Record, to_s
from farside.validation import one_line

_LENGTH = 120

Plain = dict[str, Any] | list[Any] | str | float | bool | None
"""A value of JSON."""


class Seen(msgspec.Struct, frozen=True):
    """A record, to be shown.

    Attributes:
        topic: its topic.
        t_s: when it became known there, in simulated seconds.
        so_s: when it was so.
        message: the message in JSON; of a picture, how many bytes it has and their beginning.
        text: what it says, in the words of `farside story`; or the beginning of its JSON.
        is_told: whether there are words for it.
    """

    topic: str
    t_s: float
    so_s: float
    message: Any
    text: str
    is_told: bool

    @classmethod
    def of(cls, record: Record) -> "Seen":
        """What a record says."""
        message, text = _message(record.payload), _text(record)
        shown = text or one_line(f"{record.topic} {msgspec.json.encode(message).decode()}", _LENGTH)
        times_s = to_s(record.log_time_ns), to_s(record.publish_time_ns)
        return cls(record.topic, *times_s, message, shown, text is not None)


class Parting(msgspec.Struct, frozen=True):
    """Two rows of records differ for the first time.

    Attributes:
        t_s: since when, in simulated seconds: the log time of the earlier of both records.
        topic: the topic of that one.
        first: the record of the first row; `None` where it has no more.
        second: the record of the second row; `None` where it has no more.
    """

    t_s: float
    topic: str
    first: Seen | None
    second: Seen | None

    @classmethod
    def of(cls, first: Record | None, second: Record | None) -> "Parting":
        """The parting at two records that differ; one of them may be missing."""
        sides = [None if record is None else Seen.of(record) for record in (first, second)]
        earlier = min((seen for seen in sides if seen is not None), key=lambda seen: seen.t_s)
        return cls(earlier.t_s, earlier.topic, *sides)

    @property
    def is_one_record(self) -> bool:
        """Whether both sides are the same thing, told otherwise: same topic, same time."""
        first, second = self.first, self.second
        if first is None or second is None:
            return False
        return (first.topic, first.t_s) == (second.topic, second.t_s)

    def fields(self) -> Iterator[tuple[str, object, object]]:
        """What differs within: the dotted key, and the value on either side."""
        if self.first is not None and self.second is not None:
            yield from different(self.first.message, self.second.message)
            if self.first.so_s != self.second.so_s:
                yield "so_s", self.first.so_s, self.second.so_s


class _Missing:
    def __repr__(self) -> str:
        return "nothing"


MISSING = _Missing()
"""In place of a value that is not there."""


def different(first: Any, second: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """What differs between two values of JSON: the dotted key, and the value on either side.

    Arrays of one length are compared entry by entry; others count as a whole.
    """
    match first, second:
        case dict(), dict():
            for name in {**first, **second}:
                below = f"{key}.{name}" if key else str(name)
                yield from different(first.get(name, MISSING), second.get(name, MISSING), below)
        case list(), list() if len(first) == len(second):
            for index, (one, other) in enumerate(zip(first, second, strict=True)):
                yield from different(one, other, f"{key}.{index}" if key else str(index))
        case _ if first != second:
            yield key, first, second


def _text(record: Record) -> str | None:
    try:
        text = sentence(LogEntry.of(record))
    except LogError:
        return None
    return None if text == f"{record.topic} is recorded" else text


def _message(payload: bytes) -> Plain:
    try:
        message: Plain = msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return f"{len(payload)} bytes, {payload[:16].hex(' ')} …"
    return message
