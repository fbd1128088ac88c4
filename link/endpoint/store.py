"""Store and forward: what is made while the link is out waits, and arrives as what it is: old."""

import heapq
from bisect import bisect_left, insort
from typing import NamedTuple

ITEM_BYTE = 32
"""What an item takes in the store beside its payload (project default)."""


class Stored(NamedTuple):
    """An item of the store: the higher its priority, the more important."""

    priority: int
    made_ns: int
    payload: bytes

    @property
    def size_byte(self) -> int:
        """What it takes of the store's capacity."""
        return len(self.payload) + ITEM_BYTE


class Store:
    """Keeps what cannot be sent, within bounds, until the link returns.

    The most important goes out first, and of equals the oldest. When the store is full the least
    important goes first, and of equals the oldest. Items made at the same time keep their order.

    Args:
        capacity_byte: of all items, each with `ITEM_BYTE` on top of its payload.

    Attributes:
        held_byte: what is taken of it.
        dropped: how many items had to go.
    """

    def __init__(self, capacity_byte: int) -> None:
        self._capacity_byte = capacity_byte
        self.held_byte = 0
        self.dropped = 0
        self._count = 0
        # Both ends of the order begin with the oldest of a priority: a heap for each serves both.
        self._of_priority: dict[int, list[tuple[int, int, Stored]]] = {}
        self._priorities: list[int] = []

    def __len__(self) -> int:
        return sum(len(heap) for heap in self._of_priority.values())

    def add(self, payload: bytes, made_ns: int, priority: int = 0) -> list[Stored]:
        """Keep an item. Gives those that had to go for it, to be reported.

        The item itself is among them if all others are more important or newer.
        """
        item = Stored(priority, made_ns, payload)
        if item.size_byte > self._capacity_byte:
            self.dropped += 1
            return [item]
        self._push(item)
        gone = []
        while self.held_byte > self._capacity_byte:
            gone.append(self._pop(self._priorities[0]))
        self.dropped += len(gone)
        return gone

    def take(self, budget_byte: float) -> list[Stored]:
        """The next items whose payloads fit into `budget_byte` together, in order.

        The budget is what live traffic leaves of the link. One that does not fit is not overtaken
        by smaller ones: what is left of the budget should be kept for the next call.
        """
        taken = []
        while self._priorities:
            priority = self._priorities[-1]
            budget_byte -= len(self._of_priority[priority][0][2].payload)
            if budget_byte < 0:
                break
            taken.append(self._pop(priority))
        return taken

    def _push(self, item: Stored) -> None:
        heap = self._of_priority.get(item.priority)
        if heap is None:
            heap = self._of_priority[item.priority] = []
            insort(self._priorities, item.priority)
        heapq.heappush(heap, (item.made_ns, self._count, item))
        self._count += 1
        self.held_byte += item.size_byte

    def _pop(self, priority: int) -> Stored:
        heap = self._of_priority[priority]
        item = heapq.heappop(heap)[2]
        if not heap:
            del self._of_priority[priority]
            del self._priorities[bisect_left(self._priorities, priority)]
        self.held_byte -= item.size_byte
        return item
