"""Gathers a view of a run: one pass over its log, whose messages go to whoever asks for them."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.report.events import Events
from farside.logs.report.heard import HeardAtGround
from farside.logs.report.lanes import Lanes
from farside.logs.report.learning import Learning
from farside.logs.report.link import DeliveredLink
from farside.logs.report.model import View
from farside.logs.report.orders import Orders
from farside.logs.report.proposals import Proposals
from farside.logs.report.thinning import ms
from farside.logs.report.track import Tracks
from farside.logs.report.traffic import traffic
from farside.node import Topic


class Gatherer(Protocol):
    """Makes a part of a view from the messages of some topics.

    Attributes:
        topics: which ones.
    """

    topics: Sequence[Topic[Any]]

    def take(self, entry: LogEntry) -> None:
        """Take the next message of one of them, in log order."""
        ...

    def fill(self, view: View) -> None:
        """Add what was gathered."""
        ...


def view_of(log: LogFile) -> View:
    """The view of a run: of what was so, or of what the ground knew if that is all the log holds.

    Memory grows with what a page shows, which is bounded, and not with the run.

    Raises:
        LogError: if a message cannot be decoded.
    """
    view = View(ms(log.end_ns))
    gatherers: list[Gatherer] = [
        Lanes(log),
        Proposals(log),
        Orders(log),
        DeliveredLink(log),
        Tracks(log),
        HeardAtGround(log),
        Learning(log),
        Events(log),
    ]
    takers: dict[str, list[Callable[[LogEntry], None]]] = defaultdict(list)
    for gatherer in gatherers:
        for topic in gatherer.topics:
            takers[topic.name].append(gatherer.take)
    topics = {topic for gatherer in gatherers for topic in gatherer.topics}
    for record in log.records(topics):
        entry = LogEntry.of(record)
        for take in takers[entry.topic]:
            take(entry)
    for gatherer in gatherers:
        gatherer.fill(view)
    traffic(log, view)
    return view
