"""What the rover writes down, and what of it the operator must learn of."""

import msgspec

from farside.link.messages import Event, Happening
from farside.link.node import Record
from farside.link.records import Journal

_EVENTS_AT_ONCE = 6


class Logbook:
    """Records for the log, and numbered events repeated until the ground acknowledges them.

    `now_ns` is the time of everything written; the node moves it.
    """

    def __init__(self) -> None:
        self.now_ns = 0
        self._journal = Journal()
        self._unacked: list[Event] = []
        self._last = 0

    def note(self, entry: msgspec.Struct) -> None:
        """Record `entry`."""
        self._journal.note(entry, self.now_ns)

    def tell(self, what: Happening) -> None:
        """Make an event of something that the operator must learn of, however late."""
        self._last += 1
        self._unacked.append(Event(self._last, self.now_ns, what))

    def acknowledge(self, number: int) -> None:
        """The ground knows all events up to `number`."""
        self._unacked = [event for event in self._unacked if event.number > number]

    @property
    def to_tell(self) -> tuple[Event, ...]:
        """The oldest events that the ground may not know, as many as one telemetry frame takes."""
        return tuple(self._unacked[:_EVENTS_AT_ONCE])

    def take_records(self) -> list[Record]:
        """The records since the last call."""
        return self._journal.take()
