"""Playing a log that may still be written: where to start, and the records as they come."""

from collections.abc import Callable, Collection, Iterator
from typing import Any

from farside.logs.file.reading import LogFile
from farside.node import Record, Topic, to_ns, to_s

LOOK_AGAIN_S = 0.5
"""Wall time between two looks at a log that is still being written (project default)."""


def start_of(log: LogFile, start_s: float | None, *, follow: bool) -> int:
    """Where to start to play a log, in nanoseconds.

    Args:
        log: the log.
        start_s: simulated time; by default the beginning or, to follow it, what was written last.
        follow: whether it is followed.

    Raises:
        ValueError: if `start_s` is not within the run.
    """
    if start_s is None:
        return log.end_ns if follow else 0
    if not 0 <= start_s <= to_s(log.end_ns):
        raise ValueError(
            f"expected a start within the run, 0 to {to_s(log.end_ns)} s, found {start_s} s"
        )
    return to_ns(start_s)


def followed(
    log: LogFile,
    topics: Collection[Topic[Any]] | None,
    sleep: Callable[[float], None],
    *,
    start_ns: int = 0,
) -> Iterator[Record]:
    """The records of some topics in log order, until the log is whole.

    Args:
        log: the log; it is brought up to date on the way.
        topics: which ones; all if `None`.
        sleep: waits for a number of wall seconds.
        start_ns: least log time.

    Raises:
        LogError: as `LogFile.records`.
    """
    while True:
        end_ns, whole = log.there_until_ns, log.complete
        yield from log.records(topics, start_ns=start_ns, end_ns=end_ns)
        if whole:
            return
        start_ns = max(start_ns, end_ns + 1)
        sleep(LOOK_AGAIN_S)
        log.refresh()
