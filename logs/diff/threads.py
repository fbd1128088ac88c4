"""Two logs side by side: where each thread of what happened parts, in one pass over both."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any, NamedTuple

from farside.logs.file.reading import LogFile, Named
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


class _Name(NamedTuple):
    """The topic of a record, whether this Farside knows it or not."""

    name: str


class Apart(NamedTuple):
    """The records in which two logs part; `None` where one has no more.

    Where one log has a record at that time and the other does not, it is the next one of the other:
    of the same thread or, of the whole, of the same topic.
    """

    first: Record | None
    second: Record | None

    @property
    def at_ns(self) -> int:
        """When they part."""
        return self._earlier.log_time_ns

    @property
    def topic(self) -> str:
        """The topic of the record that is there then."""
        return self._earlier.topic

    @property
    def _earlier(self) -> Record:
        return min((record for record in self if record is not None), key=_log_time_ns)


class Partings(NamedTuple):
    """Where two logs part.

    Attributes:
        first: the first record in which they differ; `None` if they are equal.
        equal: how many records before it are equal.
        threads: where each of `THREADS` parts, the earliest first; those that never do are left
            out.
    """

    first: Apart | None
    equal: int
    threads: tuple[tuple[str, Apart], ...]


def partings(first: LogFile, second: LogFile) -> Partings:
    """Where two logs part, thread by thread. Of either, only one moment is in memory at a time.

    Raises:
        LogError: if a log is damaged.
    """
    equal, whole = 0, None
    found: dict[str, Apart] = {}
    going_on = dict(THREADS)
    for now_ns, ours, theirs in _moments(first, second):
        if whole is None:
            same = _equal(ours, theirs)
            equal += same
            whole = _apart(ours[same:], theirs[same:])
            if whole is not None:
                whole = _filled(whole, first, second, [_Name(whole.topic)], now_ns)
        if ours == theirs:
            continue
        for name, topics in list(going_on.items()):
            names = {topic.name for topic in topics}
            own = [record for record in ours if record.topic in names]
            other = [record for record in theirs if record.topic in names]
            same = _equal(own, other)
            apart = _apart(own[same:], other[same:])
            if apart is not None:
                found[name] = _filled(apart, first, second, topics, now_ns)
                del going_on[name]
        if not going_on:
            break
    # A stable sort: at the same time, in the order in which one thing leads to another.
    threads = [(name, found[name]) for name in THREADS if name in found]
    threads.sort(key=lambda thread: thread[1].at_ns)
    return Partings(whole, equal, tuple(threads))


def _moments(first: LogFile, second: LogFile) -> Iterator[tuple[int, list[Record], list[Record]]]:
    """The records of both logs at each log time at which either has any."""
    rows = groupby(first.records(), _log_time_ns), groupby(second.records(), _log_time_ns)
    coming = [next(row, None) for row in rows]
    while any(coming):
        now_ns = min(moment[0] for moment in coming if moment is not None)
        here: list[list[Record]] = [[], []]
        for side, (row, moment) in enumerate(zip(rows, tuple(coming), strict=True)):
            if moment is not None and moment[0] == now_ns:
                here[side] = list(moment[1])
                coming[side] = next(row, None)
        yield now_ns, *here


def _equal(ours: Sequence[Record], theirs: Sequence[Record]) -> int:
    """How many records are equal before the first that differ."""
    pairs = zip(ours, theirs, strict=False)
    return next(
        (count for count, (one, other) in enumerate(pairs) if one != other),
        min(len(ours), len(theirs)),
    )


def _apart(ours: Sequence[Record], theirs: Sequence[Record]) -> Apart | None:
    """The first records in which two rows differ that begin with different ones."""
    one, other = next(iter(ours), None), next(iter(theirs), None)
    if one is None and other is None:
        return None
    # What the other side has as well, only later, is not what differs.
    if one is not None and other is not None:
        if one in theirs and other not in ours:
            one = None
        elif other in ours and one not in theirs:
            other = None
    return Apart(one, other)


def _filled(
    apart: Apart, first: LogFile, second: LogFile, topics: Sequence[Named], now_ns: int
) -> Apart:
    """With what comes next where one log has nothing then."""
    return Apart(
        apart.first or _next(first, topics, now_ns),
        apart.second or _next(second, topics, now_ns),
    )


def _next(log: LogFile, topics: Sequence[Named], now_ns: int) -> Record | None:
    return next(log.records(topics, start_ns=now_ns + 1), None)
