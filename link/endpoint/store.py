"""Store and forward: what is made while the link is out waits until it is back."""

import heapq
from bisect import bisect_left, insort
from typing import NamedTuple

ITEM_BYTE = 32
"""What an item takes in the store on top of its payload (project default)."""


class Stored(NamedTuple):
    """An item of the store: the higher its priority, the more important."""

    priority: int
    made_ns: int
    payload: bytes

    @property
    def size_byte(self) -> int:
        """How much of the capacity it takes."""
        return len(self.payload) + ITEM_BYTE


class Store:
    """A bounded store of what cannot be sent until the link returns.

    Items are sent by priority, then oldest first. When the store is full, the lowest priority is
    dropped, oldest first. Items made at the same time keep their order.

    Args:
        capacity_byte: of all items, each with `ITEM_BYTE` on top of its payload.

    Attributes:
        held_byte: how much of the capacity is taken.
        dropped: how many items have been dropped.
    """

    def __init__(self, capacity_byte: int) -> None:
        self._capacity_byte = capacity_byte
        self.held_byte = 0
        self.dropped = 0
        self._count = 0
        # Sending and dropping both start with the oldest of a priority, so a heap each serves both.
        self._of_priority: dict[int, list[tuple[int, int, Stored]]] = {}
        self._priorities: list[int] = []

    def __len__(self) -> int:
        return sum(len(heap) for heap in self._of_priority.values())

    def add(self, payload: bytes, made_ns: int, priority: int = 0) -> list[Stored]:
        """Store an item; returns the items dropped to make room.

        The item itself is among them if all others are more important or newer.
        """
        item = Stored(priority, made_ns, payload)
        if item.size_byte > self._capacity_byte:
            self.dropped += 1
            return [item]
        self._push(item)
        dropped = []
        while self.held_byte > self._capacity_byte:
            dropped.append(self._pop(self._priorities[0]))
        self.dropped += len(dropped)
        return dropped

    @property
    def next(self) -> bytes:
        """The payload of the next item to send.

        Raises:
            IndexError: if the store is empty.
        """
        return self._of_priority[self._priorities[-1]][0][2].payload

    def pop(self) -> bytes:
        """Remove the next item to send; returns its payload.

        Raises:
            IndexError: if the store is empty.
        """
        return self._pop(self._priorities[-1]).payload

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
