"""What every query reads: the log by topic, all of it or the latest at a time."""

from collections.abc import Iterator
from typing import Any, TypeVar, cast

import msgspec

from farside.logs.file.reading import LogFile, decode
from farside.node import Topic, to_ns, to_s
from farside.topics import TOPICS
from farside.validation import did_you_mean, shown

T = TypeVar("T", bound=msgspec.Struct)


class TopicView:
    """The messages of a run by topic. All times are simulated seconds.

    Args:
        log: the log.
    """

    def __init__(self, log: LogFile) -> None:
        self._log = log
        self._asked_s: float | None = None

    @property
    def file(self) -> LogFile:
        """The log itself, for what no query answers."""
        return self._log

    @property
    def is_as_ground(self) -> bool:
        """Whether this is the run as the ground had it; see `LogFile.as_ground`."""
        return self._log.is_as_ground

    @property
    def asked_s(self) -> float | None:
        """The time that was last asked about, in any query at a time; `None` before the first."""
        return self._asked_s

    @property
    def duration_s(self) -> float:
        """Log time of the last record, 0 if there is none; as ground, the time as of which."""
        return to_s(self._log.end_ns)

    def entries(self, topic: Topic[T]) -> tuple[tuple[float, T], ...]:
        """All messages of a topic in log order, each with its log time.

        Raises:
            LogError: if a message cannot be decoded.
            ValueError: if no log has such a topic: the message names the nearest one. As ground,
                if the ground does not know it.
        """
        return tuple(self.each(topic))

    def each(self, topic: Topic[T]) -> Iterator[tuple[float, T]]:
        """`entries` one by one, for topics that may be larger than memory."""
        if topic.name not in TOPICS:
            hint = did_you_mean(topic.name, TOPICS)
            raise ValueError(f"expected a topic of the log, found {shown(topic.name)}{hint}")
        for t_s, message in self.together(topic):
            yield t_s, cast("T", message)

    def together(self, *topics: Topic[Any]) -> Iterator[tuple[float, msgspec.Struct]]:
        """The messages of several topics in log order, one by one, each with its log time.

        Raises:
            LogError: if a message cannot be decoded.
            ValueError: as ground, if the ground does not know one of the topics.
        """
        self._check_known(*topics)
        for record in self._log.records(topics):
            yield to_s(record.log_time_ns), decode(record)

    def _check_known(self, *topics: Topic[Any]) -> None:
        if not self.is_as_ground:
            return
        for topic in topics:
            if not topic.name.startswith("/ground/"):
                raise ValueError(
                    f"not known at the ground: {topic.name}; "
                    "what it believed of the rover: believed_at(t_s)"
                )

    def _check_time(self, t_s: float) -> None:
        if not 0 <= t_s <= self.duration_s:
            raise ValueError(
                f"expected a time within the run, 0 to {self.duration_s} s, found {t_s} s"
            )

    def _asked(self, topic: Topic[T], t_s: float) -> T:
        """The latest message of a topic at a time that was asked about."""
        latest = self._latest(topic, t_s)
        self._asked_s = t_s
        return latest

    def _latest(self, topic: Topic[T], t_s: float) -> T:
        self._check_known(topic)
        self._check_time(t_s)
        record = self._log.latest(topic, to_ns(t_s))
        if record is None:
            raise ValueError(f"expected a {topic.name} message at {t_s} s or before, found none")
        return cast("T", decode(record))

    def _last(self, topic: Topic[T]) -> tuple[float, T] | None:
        """The last message of a topic, with its log time in seconds; `None` if there is none."""
        self._check_known(topic)
        record = self._log.latest(topic, self._log.end_ns)
        return None if record is None else (to_s(record.log_time_ns), cast("T", decode(record)))
