"""Two runs compared: their missions, where they part and why, and what came of it."""

import msgspec

from farside.logs.diff.outcomes import (
    MissionKey,
    Row,
    mission_differences,
    outcome_differences,
)
from farside.logs.diff.parting import Parting
from farside.logs.diff.threads import partings
from farside.logs.file.reading import LogFile


class Thread(msgspec.Struct, frozen=True):
    """One of `farside.logs.diff.threads.THREADS`, and where it parts."""

    name: str
    parting: Parting


class Difference(msgspec.Struct, frozen=True):
    """How two runs differ.

    Attributes:
        first, second: the logs.
        equal: whether every record is equal.
        records: how many are, before the first that is not.
        missions: the keys in which their missions differ.
        parting: the first record that differs; `None` if none does.
        causes_first, causes_second: what led to that record in either run, the latest last.
        threads: where each thread of what happened parts, the earliest first.
        outcomes: in what they differ by what they came to.
    """

    first: str
    second: str
    equal: bool
    records: int
    missions: tuple[MissionKey, ...]
    parting: Parting | None
    causes_first: tuple[str, ...]
    causes_second: tuple[str, ...]
    threads: tuple[Thread, ...]
    outcomes: tuple[Row, ...]


def compare(first: LogFile, second: LogFile) -> Difference:
    """Compare two runs; of either log, only one moment is in memory at a time.

    Raises:
        LogError: if a log is damaged, or holds what this Farside cannot read.
    """
    found = partings(first, second)
    return Difference(
        first=str(first.path),
        second=str(second.path),
        equal=found.first is None,
        records=found.equal,
        missions=tuple(mission_differences(first, second)),
        parting=found.first,
        causes_first=(),
        causes_second=(),
        threads=tuple(Thread(name, parting) for name, parting in found.threads),
        outcomes=() if found.first is None else tuple(outcome_differences(first, second)),
    )
