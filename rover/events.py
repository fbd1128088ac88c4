"""What the operator must learn of: numbered events, told however late."""

from farside.messages import Event, Happening
from farside.node import Journal


class EventQueue:
    """Events that are still to be handed to the link.

    Args:
        journal: of the rover's node; its present is when an event happened.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._events: list[Event] = []
        self._last = 0

    def tell(self, what: Happening) -> None:
        """Make an event of something that happened now."""
        self._last += 1
        self._events.append(Event(self._last, self._journal.now_ns, what))

    def take(self) -> list[Event]:
        """The events since the last call."""
        taken, self._events = self._events, []
        return taken
