"""What is played to a viewer: a log, or a run that is still going on."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

from farside.logs.file.reading import LogFile
from farside.logs.foxglove.pictures import Pictures
from farside.node import NEVER_NS, Record, Topic


class LogFeed:
    """All that a log holds, pictures included; a `Feed`.

    Args:
        log: whole, or as the ground had it.

    Attributes:
        end_ns: its end.
    """

    def __init__(self, log: LogFile) -> None:
        self.end_ns = log.end_ns
        self._log = log

    @property
    def there_until_ns(self) -> int:
        """See `LogFile.there_until_ns`."""
        return self._log.there_until_ns

    def records(
        self,
        topics: Collection[Topic[Any]] | None = None,
        *,
        start_ns: int = 0,
        end_ns: int = NEVER_NS,
    ) -> Iterator[Record]:
        """See `LogFile.records`."""
        return self._log.records(topics, start_ns=start_ns, end_ns=end_ns, pictures=True)

    def latest_each(self, time_ns: int, names: Iterable[str] | None = None) -> list[Record]:
        """See `LogFile.latest_each`."""
        return self._log.latest_each(time_ns, names)


class RunFeed:
    """What a run in progress has recorded so far, pictures included; a `Feed`.

    The records of the last window are at hand. What lies before them is read from the log, when a
    viewer asks for it.

    Attributes:
        path: the log, flushed up to `end_ns` whenever that moves; set it before the first window.
        end_ns: simulated time that the run has reached.
    """

    def __init__(self) -> None:
        self.path = Path()
        self.end_ns = 0
        self._window: Sequence[Record] = ()
        self._window_begin_ns = 0
        self._pictures = Pictures()
        self._finished = False

    @property
    def there_until_ns(self) -> int:
        """See `Source`. What happens where a window ends is of the next one."""
        return self.end_ns if self._finished else self.end_ns - 1

    def extend(self, now_ns: int, records: Sequence[Record]) -> None:
        """The run has reached `now_ns`, and these are all its records since the time before."""
        self._window_begin_ns = self.end_ns
        self._window = self._pictures.beside(records)
        self.end_ns = now_ns
        self.__dict__.pop("_log", None)

    def finish(self) -> None:
        """The run is over, and its log closed.

        Raises:
            LogError: if it cannot be read.
        """
        self._window, self._finished = (), True
        self.__dict__.pop("_log", None)
        self.end_ns = self._log.end_ns

    def records(
        self,
        topics: Collection[Topic[Any]] | None = None,
        *,
        start_ns: int = 0,
        end_ns: int = NEVER_NS,
    ) -> Iterator[Record]:
        """See `LogFile.records`."""
        if self._finished:
            return self._log.records(topics, start_ns=start_ns, end_ns=end_ns)
        names = None if topics is None else {topic.name for topic in topics}
        window = (
            record
            for record in self._window
            if start_ns <= record.log_time_ns <= end_ns and (names is None or record.topic in names)
        )
        if start_ns >= self._window_begin_ns:
            return window
        before_ns = min(end_ns, self._window_begin_ns - 1)
        return chain(self._log.records(topics, start_ns=start_ns, end_ns=before_ns), window)

    def latest_each(self, time_ns: int, names: Iterable[str] | None = None) -> list[Record]:
        """See `LogFile.latest_each`."""
        return self._log.latest_each(time_ns, names) if self.end_ns else []

    @cached_property
    def _log(self) -> LogFeed:
        """The log as it is now."""
        return LogFeed(LogFile(self.path))
