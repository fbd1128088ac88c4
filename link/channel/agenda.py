"""Records of one direction that are already decided but not yet due."""

import heapq
from bisect import bisect_left
from operator import attrgetter

import msgspec

from farside.frames import FrameFate, FrameHop, LinkOutage
from farside.node import Direction

_time = attrgetter("time_ns")


class PendingRecord(msgspec.Struct, frozen=True, order=True, gc=False):
    """A message, when it is to be recorded, and what orders it among others of that time.

    Of the records of one frame at one time the `copy` is different; of hops it is negative.
    """

    time_ns: int
    direction: Direction
    sequence: int
    copy: int
    message: FrameFate | FrameHop | LinkOutage


class Agenda:
    """The pending records of one direction, by time."""

    def __init__(self) -> None:
        # Sorted batches as (time of the next record, tie-breaker, records, index of the next one).
        self._batches: list[tuple[int, int, list[PendingRecord], int]] = []
        self._added = 0

    def add(self, records: list[PendingRecord]) -> None:
        """Keep `records` until they are due. The list belongs to the agenda from then on."""
        if records:
            records.sort()
            self._added += 1
            heapq.heappush(self._batches, (records[0].time_ns, self._added, records, 0))

    def drop_outages(self) -> None:
        """Forget the outages that are not yet due."""
        batches, self._batches = self._batches, []
        for _, added, records, begin in batches:
            left = [one for one in records[begin:] if not isinstance(one.message, LinkOutage)]
            if left:
                heapq.heappush(self._batches, (left[0].time_ns, added, left, 0))

    def due(self, until_ns: int) -> list[PendingRecord]:
        """Take the records due before `until_ns`, in order within each batch alone."""
        due: list[PendingRecord] = []
        batches = self._batches
        while batches and batches[0][0] < until_ns:
            _, added, records, begin = heapq.heappop(batches)
            end = bisect_left(records, until_ns, lo=begin, key=_time)
            due += records[begin:end]
            if end < len(records):
                heapq.heappush(batches, (records[end].time_ns, added, records, end))
        return due
