"""Handmade records and log entries, for tests that start from the messages of a run."""

from collections.abc import Iterable

import msgspec

from farside.logs import LogEntry
from farside.node import Journal, Record, Topic, to_ns
from farside.topics import TOPICS


def topic_of(message: msgspec.Struct) -> Topic[msgspec.Struct]:
    """The first topic that carries messages of this type."""
    return next(topic for topic in TOPICS.values() if topic.kind is type(message))


def logged(t_ns: int, message: msgspec.Struct) -> LogEntry:
    """A message as an entry read from a log."""
    return LogEntry(t_ns, t_ns, topic_of(message).name, message)


def records_of(messages: Iterable[tuple[float, msgspec.Struct]]) -> list[Record]:
    """Records of messages, each with its log time in seconds."""
    journal = Journal()
    for t_s, message in messages:
        journal.note(topic_of(message), message, log_time_ns=to_ns(t_s))
    return journal.take()
