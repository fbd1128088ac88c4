"""Checks of what a role publishes on its own keys, by whoever receives it.

A role may publish anything there. What does not belong into the window is an error of that role,
and must neither stop nor change any other.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import msgspec

from farside.node import NEVER_NS, Direction, Frame, Record, Role, to_s
from farside.topics import TOPICS

_OWN_TOPICS = {
    Role.ROVER: ("/truth/", "/rover/"),
    Role.LINK: ("/link/",),
    Role.GROUND: ("/ground/",),
}
_FROM = {Role.ROVER: Direction.DOWN, Role.GROUND: Direction.UP}
_UNREADABLE = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)
_SHOWN_LENGTH = 60

_Message = TypeVar("_Message")


class ConductError(Exception):
    """A role published what it must not; the message is a predicate, such as "sent nonsense"."""


def decoded(decode: Callable[[bytes], _Message], payload: bytes) -> _Message:
    """The message in `payload`.

    Raises:
        ConductError: if `decode` finds none.
    """
    try:
        return decode(payload)
    except _UNREADABLE as error:
        raise ConductError(f"sent a message that cannot be decoded ({error})") from error


def check_window(found: int, expected: int, *, twice: bool) -> None:
    """Check that a message belongs to the expected window, and is the first one.

    Raises:
        ConductError: if it does not, or if it came `twice`.
    """
    if found != expected:
        raise ConductError(f"sent a message of window {found} in window {expected}")
    if twice:
        raise ConductError(f"sent the message of window {expected} twice")


def check_number(found: int, expected: int) -> None:
    """Check that an answer is the one to the question that was asked last.

    Raises:
        ConductError: if it is not.
    """
    if found != expected:
        raise ConductError(f"sent an answer to question {found}, and was asked {expected}")


def check_frames(
    frames: Sequence[Frame],
    sender: Role,
    receiver: Role,
    start_ns: int,
    end_ns: int,
    *,
    before_ns: int,
) -> None:
    """Check the frames for `receiver` in the window from `start_ns` to, not including, `end_ns`.

    Rover and ground send frames within the window. What the link delivers was sent in the window
    before, and arrives after it was sent: on a link without delay within that one still.

    Args:
        frames: the frames.
        sender: who sent them.
        receiver: who received them.
        start_ns: start of the window.
        end_ns: its end.
        before_ns: start of the window before.

    Raises:
        ConductError: if a frame has the wrong direction or a time outside these limits.
    """
    direction = _FROM[sender] if receiver is Role.LINK else _FROM[receiver].opposite
    earliest_ns, latest_ns = before_ns, NEVER_NS
    if receiver is Role.LINK:
        earliest_ns, latest_ns = start_ns, end_ns - 1
    for frame in frames:
        if frame.direction is not direction:
            raise ConductError(f"sent the {receiver} a frame in direction {frame.direction}")
        if not earliest_ns <= frame.time_ns <= latest_ns:
            raise ConductError(f"sent a frame with a {_time(frame.time_ns, earliest_ns, end_ns)}")


def check_records(records: Sequence[Record], role: Role, start_ns: int, end_ns: int) -> None:
    """Check the records of `role` for the window from `start_ns` to, not including, `end_ns`.

    Raises:
        ConductError: if a record is not on one of the role's topics, not of the topic's type, or
            has a time outside the window.
    """
    for record in records:
        topic = TOPICS.get(record.topic)
        if topic is None or not topic.name.startswith(_OWN_TOPICS[role]):
            name = record.topic[:_SHOWN_LENGTH]
            raise ConductError(f"recorded on {name!r}, which is not one of its topics")
        if not start_ns <= record.log_time_ns < end_ns:
            found = _time(record.log_time_ns, start_ns, end_ns)
            raise ConductError(f"recorded on {topic.name} with a {found}")
        if not 0 <= record.publish_time_ns <= NEVER_NS:
            raise ConductError(
                f"recorded on {topic.name} with a publish time of {record.publish_time_ns} ns"
            )
        decoded(topic.decode, record.payload)


def _time(found_ns: int, start_ns: int, end_ns: int) -> str:
    window = f"the window from {to_s(start_ns):g} to {to_s(end_ns):g} s"
    return f"time of {to_s(found_ns):g} s, outside {window}"
