"""The events as a person at the ground is shown them: newest first, each with its two times."""

from collections import deque

from farside.console.news import sentence, so_ns, tone_of
from farside.console.screen.screen import EventRow
from farside.logs.events import EventLine
from farside.logs.file.reading import LogEntry

EVENTS_KEPT = 200
"""As many as a person scrolls back through on the screen; the log has them all."""


class EventList:
    """Keeps the last events of the ground's log."""

    def __init__(self) -> None:
        self._rows: deque[EventRow] = deque(maxlen=EVENTS_KEPT)
        self._count = 0

    def take(self, entry: LogEntry, line: EventLine | None) -> None:
        """Take the next entry of the ground's log, in order, and the line that a picture has of it.

        Args:
            entry: the entry.
            line: what `farside.logs.Picture.apply` gave of it: `None` of what is no news.
        """
        if line is None:
            return
        self._count += 1
        self._rows.appendleft(
            EventRow(
                self._count,
                so_ns(entry),
                entry.log_time_ns,
                sentence(entry),
                tone_of(entry.message),
                line.routine,
            )
        )

    def rows(self) -> tuple[EventRow, ...]:
        """The newest first; their numbers count up from 1 and never change."""
        return tuple(self._rows)
