"""What the rover writes down, and what of it the operator must learn of."""

import msgspec

from farside.messages import Event, Happening
from farside.node import Record
from farside.topics import Journal


class Logbook:
    """Records for the log, and numbered events for the ground.

    `now_ns` is the time of everything written; the node moves it.
    """

    def __init__(self) -> None:
        self.now_ns = 0
        self._journal = Journal()
        self._events: list[Event] = []
        self._last = 0

    def note(self, entry: msgspec.Struct) -> None:
        """Record `entry`."""
        self._journal.note(entry, self.now_ns)

    def note_at(self, entry: msgspec.Struct, time_ns: int) -> None:
        """Record `entry`, known at `time_ns`."""
        self._journal.note(entry, time_ns)

    def tell(self, what: Happening) -> None:
        """Make an event of something that the operator must learn of, however late."""
        self._last += 1
        self._events.append(Event(self._last, self.now_ns, what))

    def take_events(self) -> list[Event]:
        """The events since the last call."""
        taken, self._events = self._events, []
        return taken

    def take_records(self) -> list[Record]:
        """The records since the last call."""
        return self._journal.take()
