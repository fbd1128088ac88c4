"""Two runs compared: their missions, where they part and why, and what came of it."""

from collections.abc import Sequence

import msgspec

from farside.logs.diff.outcomes import (
    MissionKey,
    Row,
    mission_differences,
    outcome_differences,
)
from farside.logs.diff.parting import Parting, Seen
from farside.logs.diff.threads import Partings, partings
from farside.logs.file.reading import LogFile
from farside.logs.story.causes import causes
from farside.node import Record, to_s

_EFFECTS = ("what was done", "the mode", "goals")
"""The threads that matter to whoever asks why two runs parted."""

_MOST_SHARED = 2
"""The most links of a chain that are told of what was so in both runs (project default)."""


class Thread(msgspec.Struct, frozen=True):
    """One of `farside.logs.diff.threads.THREADS`, and where it parts."""

    name: str
    parting: Parting


class Link(msgspec.Struct, frozen=True):
    """A record in a chain of causes.

    Attributes:
        t_s: when it was so.
        topic: its topic.
        text: what it says.
        shared: whether it was so in both runs, as all is before they part.
    """

    t_s: float
    topic: str
    text: str
    shared: bool


class Effect(msgspec.Struct, frozen=True):
    """The first thing that a rover did, or took up, otherwise, and how either run came to it.

    Attributes:
        name: the thread that it is of.
        parting: where that parts.
        first, second: in either run, in order of time: what parted before, what led to the record,
            and the record itself.
    """

    name: str
    parting: Parting
    first: tuple[Link, ...]
    second: tuple[Link, ...]


class Difference(msgspec.Struct, frozen=True):
    """How two runs differ.

    Attributes:
        first, second: the logs.
        equal: whether every record is equal.
        records: how many are, before the first that is not.
        missions: the keys in which their missions differ.
        parting: the first record that differs; `None` if none does.
        effect: what it led to, and how; `None` if the rover did and took up the same to the end.
        threads: where each thread of what happened parts, the earliest first.
        outcomes: in what they differ by what they came to.
    """

    first: str
    second: str
    equal: bool
    records: int
    missions: tuple[MissionKey, ...]
    parting: Parting | None
    effect: Effect | None
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
        parting=None if found.first is None else Parting.of(*found.first),
        effect=_effect(first, second, found),
        threads=tuple(Thread(name, Parting.of(*apart)) for name, apart in found.threads),
        outcomes=() if found.first is None else tuple(outcome_differences(first, second)),
    )


def _effect(first: LogFile, second: LogFile, found: Partings) -> Effect | None:
    for name, apart in found.threads:
        if name in _EFFECTS:
            before = [one for _, one in found.threads if one.at_ns <= apart.at_ns]
            chains = (
                _chain(log, apart[side], [one[side] for one in before], found)
                for side, log in enumerate((first, second))
            )
            return Effect(name, Parting.of(*apart), *chains)
    return None


def _chain(
    log: LogFile, record: Record | None, before: Sequence[Record | None], found: Partings
) -> tuple[Link, ...]:
    """How a run came from where it parted to a record: what led to that, and what parted before.

    Of what led to it in both runs alike, only the last is told.
    """
    if record is None or found.first is None:
        return ()
    parted_ns = found.first.at_ns
    chain = [
        Link(to_s(cause.t_ns), cause.topic, cause.sentence, cause.t_ns < parted_ns)
        for cause in causes(log, record)
    ]
    told = {(link.topic, link.t_s) for link in chain}
    for one in (*before, record):
        if one is not None and one.log_time_ns <= record.log_time_ns:
            seen = Seen.of(one)
            if seen.is_told and (seen.topic, seen.t_s) not in told:
                chain.append(Link(seen.t_s, seen.topic, seen.text, shared=False))
                told.add((seen.topic, seen.t_s))
    chain.sort(key=lambda link: link.t_s)
    shared = [link for link in chain if link.shared]
    apart = [link for link in chain if not link.shared]
    return (*shared[-_MOST_SHARED:], *apart)
