"""What will come to be known of one direction of the channel, and when."""

import heapq
from bisect import bisect_left
from operator import attrgetter

import msgspec

from farside.node import Direction
from farside.topics import FrameFate, LinkOutage

_time = attrgetter("time_ns")


class Entry(msgspec.Struct, frozen=True, order=True, gc=False):
    """When something comes to be known, what orders it among others of that time, and what."""

    time_ns: int
    direction: Direction
    sequence: int
    copy: int
    what: FrameFate | LinkOutage


class Agenda:
    """What will come to be known of one direction, and when."""

    def __init__(self) -> None:
        # Each part in order, and how far it has been read: first the one with the next entry.
        self._parts: list[tuple[int, int, list[Entry], int]] = []
        self._added = 0

    def add(self, entries: list[Entry]) -> None:
        """Keep `entries` until their times; the list is the agenda's from now on."""
        if entries:
            entries.sort()
            self._added += 1
            heapq.heappush(self._parts, (entries[0].time_ns, self._added, entries, 0))

    def due(self, until_ns: int) -> list[Entry]:
        """What comes to be known before `until_ns`."""
        due: list[Entry] = []
        parts = self._parts
        while parts and parts[0][0] < until_ns:
            _, added, entries, begin = heapq.heappop(parts)
            end = bisect_left(entries, until_ns, lo=begin, key=_time)
            due += entries[begin:end]
            if end < len(entries):
                heapq.heappush(parts, (entries[end].time_ns, added, entries, end))
        return due
