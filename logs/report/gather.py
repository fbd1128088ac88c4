"""Gathers the views of a run: one pass over its log, whose messages go to whoever asks for them."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from farside.logs.file.reading import LogEntry, LogFile, decode
from farside.logs.report.model import Side, View
from farside.logs.report.parts.asked import Asked
from farside.logs.report.parts.events import Events
from farside.logs.report.parts.heard import HeardAtGround
from farside.logs.report.parts.lanes import Lanes
from farside.logs.report.parts.learning import Learning
from farside.logs.report.parts.link import DeliveredLink
from farside.logs.report.parts.orders import Orders
from farside.logs.report.parts.proposals import Proposals
from farside.logs.report.parts.track import Tracks
from farside.logs.report.parts.traffic import Traffic
from farside.logs.report.thinning import ms
from farside.node import Topic


class Gatherer(Protocol):
    """Makes a part of a view from the messages of some topics."""

    @property
    def topics(self) -> Sequence[Topic[Any]]:
        """Which ones."""
        ...

    def take(self, entry: LogEntry) -> None:
        """Take the next message of one of them, in log order."""
        ...

    def fill(self, view: View) -> None:
        """Add what was gathered."""
        ...


def views_of(log: LogFile) -> dict[str, View]:
    """The views of a run: `so`, what was so, and `ground`, what the ground knew.

    Of a log as the ground had it there is only the second. Memory grows with what a page shows,
    which is bounded, and not with the run.

    Raises:
        LogError: if a message cannot be decoded.
    """
    names = ["ground"] if log.is_as_ground else ["so", "ground"]
    sides = {name: Side(log.end_ns, name == "ground") for name in names}
    gatherers = {name: _gatherers(side, Asked.of(log)) for name, side in sides.items()}
    takers: dict[str, list[Callable[[LogEntry], None]]] = defaultdict(list)
    topics: set[Topic[Any]] = set()
    for name, side in sides.items():
        for gatherer in gatherers[name]:
            for topic in gatherer.topics:
                if side.may_read(topic):
                    topics.add(topic)
                    takers[topic.name].append(gatherer.take)
    for record in log.records(topics):
        entry = LogEntry(
            record.log_time_ns, record.publish_time_ns, record.topic, decode(record)
        )  # and not by `LogEntry.of`: here every microsecond counts
        for take in takers[record.topic]:
            take(entry)
    views = {name: View(ms(log.end_ns)) for name in names}
    for name, view in views.items():
        for gatherer in gatherers[name]:
            gatherer.fill(view)
    return views


def _gatherers(side: Side, asked: Asked) -> list[Gatherer]:
    both: list[Gatherer] = [
        Lanes(side),
        Proposals(side),
        Orders(side),
        Tracks(side),
        Learning(side),
        Events(),
        Traffic(side),
    ]
    return [*both, HeardAtGround(side)] if side.is_ground else [*both, DeliveredLink(side, asked)]
