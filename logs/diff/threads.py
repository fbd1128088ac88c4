"""Two logs side by side: where each thread of what happened parts, in one pass over both."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any, NamedTuple

from farside.logs.diff.parting import Parting
from farside.logs.file.reading import LogFile
from farside.node import Record, Topic
from farside.topics import (
    GROUND_BELIEF,
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_ORDER,
    GROUND_PROPOSAL,
    GROUND_SILENCE,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_ESTIMATE,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_PROPOSAL,
    ROVER_STUCK,
    TRUTH_BUMP,
    TRUTH_POSE,
    TRUTH_YARD,
)

_log_time_ns = attrgetter("log_time_ns")

THREADS: dict[str, tuple[Topic[Any], ...]] = {
    "the yard": (TRUTH_YARD,),
    "outages of the link": (LINK_OUTAGE,),
    "the fate of frames": (LINK_FRAME,),
    "the operator's orders": (GROUND_ORDER,),
    "commands sent": (GROUND_COMMAND,),
    "commands on board": (ROVER_COMMAND,),
    "the failsafe": (ROVER_FAILSAFE,),
    "the mode": (ROVER_MODE,),
    "goals": (ROVER_GOAL,),
    "proposals": (ROVER_PROPOSAL,),
    "what was decided": (ROVER_DECISION,),
    "what was done": (ROVER_ACTION_STARTED, ROVER_ACTION_ENDED),
    "what was learned": (ROVER_CYCLE,),
    "where the rover was": (TRUTH_POSE, TRUTH_BUMP, ROVER_STUCK),
    "where it believed to be": (ROVER_ESTIMATE,),
    "the battery's state": (ROVER_BATTERY,),
    "what the ground heard": (GROUND_TELEMETRY, GROUND_EVENT, GROUND_PROPOSAL),
    "what the ground believed": (GROUND_BELIEF, GROUND_SILENCE),
}
"""What can part by itself, in the order in which one thing leads to another at the same time."""


class Partings(NamedTuple):
    """Where two logs part.

    Attributes:
        first: the first record in which they differ; `None` if they are equal.
        equal: how many records before it are equal.
        threads: where each of `THREADS` parts, the earliest first; those that never do are left
            out.
    """

    first: Parting | None
    equal: int
    threads: tuple[tuple[str, Parting], ...]


def partings(first: LogFile, second: LogFile) -> Partings:
    """Where two logs part, thread by thread. Of either, only one moment is in memory at a time.

    Raises:
        LogError: if a log is damaged.
    """
    equal, whole = 0, None
    found: dict[str, Parting] = {}
    open_threads = {name: {topic.name for topic in topics} for name, topics in THREADS.items()}
    for ours, theirs in _moments(first, second):
        if whole is None:
            same = _equal(ours, theirs)
            equal += same
            whole = _at(ours, theirs, same)
        if ours == theirs:
            continue
        for name, topics in list(open_threads.items()):
            own = [record for record in ours if record.topic in topics]
            other = [record for record in theirs if record.topic in topics]
            apart = _at(own, other, _equal(own, other))
            if apart is not None:
                found[name] = apart
                del open_threads[name]
        if not open_threads:
            break
    threads = sorted(found.items(), key=lambda thread: (thread[1].t_s, _ORDER.index(thread[0])))
    return Partings(whole, equal, tuple(threads))


_ORDER = list(THREADS)


def _moments(first: LogFile, second: LogFile) -> Iterator[tuple[list[Record], list[Record]]]:
    """The records of both logs at each log time at which either has any."""
    rows = groupby(first.records(), _log_time_ns), groupby(second.records(), _log_time_ns)
    (ours, theirs) = (next(row, None) for row in rows)
    while ours is not None or theirs is not None:
        times = [moment[0] for moment in (ours, theirs) if moment is not None]
        now_ns = min(times)
        here: list[Record] = []
        there: list[Record] = []
        if ours is not None and ours[0] == now_ns:
            here = list(ours[1])
            ours = next(rows[0], None)
        if theirs is not None and theirs[0] == now_ns:
            there = list(theirs[1])
            theirs = next(rows[1], None)
        yield here, there


def _equal(ours: Sequence[Record], theirs: Sequence[Record]) -> int:
    """How many records are equal before the first that differ."""
    count = 0
    for one, other in zip(ours, theirs, strict=False):
        if one != other:
            break
        count += 1
    return count


def _at(ours: Sequence[Record], theirs: Sequence[Record], same: int) -> Parting | None:
    one = ours[same] if same < len(ours) else None
    other = theirs[same] if same < len(theirs) else None
    return None if one is None and other is None else Parting.of(one, other)
