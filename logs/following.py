"""The records of a log that is still being written, as they come."""

from collections.abc import Callable, Collection, Iterator
from typing import Any

from farside.logs.file.reading import LogFile
from farside.node import Record, Topic

LOOK_AGAIN_S = 0.5
"""Wall time between two looks at a log that is still being written (project default)."""


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
        end_ns, whole = log.end_ns, log.complete
        yield from log.records(topics, start_ns=start_ns, end_ns=end_ns)
        if whole:
            return
        start_ns = max(start_ns, end_ns + 1)
        sleep(LOOK_AGAIN_S)
        log.refresh()
