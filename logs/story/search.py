"""Looking for records of a log by what they say, near a time, without reading the whole of it."""

from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import Any, Generic, NamedTuple, TypeVar, cast

import msgspec

from farside.logs.file.reading import LogEntry, LogFile, decode
from farside.node import NEVER_NS, NS_PER_S, Record, Topic

T = TypeVar("T", bound=msgspec.Struct)
M_co = TypeVar("M_co", bound=msgspec.Struct, covariant=True)

_WINDOW_NS = 30 * NS_PER_S
_WINDOWS_KEPT = 256  # of one topic each; of a busy link some hundred records (project default)
_GAPS_KEPT = 4096  # a number each


class Found(NamedTuple, Generic[M_co]):
    """A record with its message.

    Attributes:
        t_ns: when it became known where it was recorded.
        so_ns: when it was so.
        topic: name of its topic.
        message: what it says.
    """

    t_ns: int
    so_ns: int
    topic: str
    message: M_co

    @classmethod
    def of(cls, record: Record) -> "Found[msgspec.Struct]":
        """A record, decoded.

        Raises:
            LogError: if it cannot be.
        """
        return Found(record.log_time_ns, record.publish_time_ns, record.topic, decode(record))

    @property
    def entry(self) -> LogEntry:
        """The same for those who read entries."""
        return LogEntry(self.t_ns, self.so_ns, self.topic, self.message)


class Search:
    """Finds records of a log. What was read last is kept, so that near questions cost little.

    Args:
        log: the log, whole or as the ground had it.

    Attributes:
        log: the log.
    """

    def __init__(self, log: LogFile) -> None:
        self.log = log
        self._gaps: OrderedDict[tuple[str, int], int | None] = OrderedDict()
        self._windows: OrderedDict[tuple[str, int], tuple[Found[Any], ...]] = OrderedDict()

    def at(
        self, topic: Topic[T], t_ns: int, where: Callable[[T], bool] | None = None
    ) -> list[Found[T]]:
        """The records of a topic at exactly this log time, in order.

        Raises:
            LogError: as all here, if one of the records read cannot be decoded.
        """
        window = self._window(topic, t_ns // _WINDOW_NS)
        return [
            found
            for found in window
            if found.t_ns == t_ns and (where is None or where(found.message))
        ]

    def last(
        self, topic: Topic[T], t_ns: int, where: Callable[[T], bool] | None = None
    ) -> Found[T] | None:
        """The last record at `t_ns` or before of which `where` is true; `None` without one."""
        window: int | None = min(t_ns, self.log.end_ns) // _WINDOW_NS
        while window is not None:
            for found in reversed(self._window(topic, window)):
                if found.t_ns <= t_ns and (where is None or where(found.message)):
                    return found
            window = self._before(topic, window)
        return None

    def first(
        self,
        topic: Topic[T],
        where: Callable[[T], bool] | None = None,
        *,
        start_ns: int = 0,
        end_ns: int = NEVER_NS,
    ) -> Found[T] | None:
        """The first record in a time of which `where` is true; `None` without one."""
        found = self.each(topic, start_ns=start_ns, end_ns=end_ns)
        return next((one for one in found if where is None or where(one.message)), None)

    def each(
        self, topic: Topic[T], *, start_ns: int = 0, end_ns: int = NEVER_NS
    ) -> Iterator[Found[T]]:
        """The records of a topic in a time, in order, one by one."""
        for record in self.log.records([topic], start_ns=start_ns, end_ns=end_ns):
            yield cast("Found[T]", Found.of(record))

    def _before(self, topic: Topic[T], number: int) -> int | None:
        """The number of the newest window before one that has any record of a topic."""
        key = topic.name, number
        if key not in self._gaps:
            latest = self.log.latest(topic, number * _WINDOW_NS - 1)
            self._gaps[key] = None if latest is None else latest.log_time_ns // _WINDOW_NS
            if len(self._gaps) > _GAPS_KEPT:
                self._gaps.popitem(last=False)
        return self._gaps[key]

    def _window(self, topic: Topic[T], number: int) -> tuple[Found[T], ...]:
        key = topic.name, number
        if key in self._windows:
            self._windows.move_to_end(key)
            return self._windows[key]
        start_ns = number * _WINDOW_NS
        window = tuple(self.each(topic, start_ns=start_ns, end_ns=start_ns + _WINDOW_NS - 1))
        self._windows[key] = window
        if len(self._windows) > _WINDOWS_KEPT:
            self._windows.popitem(last=False)
        return window
