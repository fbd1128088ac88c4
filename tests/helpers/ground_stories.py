"""Stories as the ground has them: entries of its log and views, with times in seconds."""

import msgspec

from farside.ground.view.view import FailsafeOutlook, GroundView, Way
from farside.logs import LogEntry
from farside.messages import Event, Happening
from farside.node import NEVER_NS, Journal, Record, to_ns
from farside.topics import GROUND_EVENT, TOPICS, EventLearned


def told(t_s: float, so_s: float, what: Happening) -> LogEntry:
    """The ground learns at `t_s` what happened on board at `so_s`."""
    event = EventLearned(Event(1, to_ns(so_s), what))
    return LogEntry(to_ns(t_s), to_ns(so_s), GROUND_EVENT.name, event)


def noted(t_s: float, *messages: msgspec.Struct) -> list[Record]:
    """What the ground notes at `t_s`: each message on the first topic of its that carries such."""
    journal = Journal()
    for message in messages:
        topic = next(
            topic
            for topic in TOPICS.values()
            if topic.kind is type(message) and topic.name.startswith("/ground/")
        )
        journal.note(topic, message, log_time_ns=to_ns(t_s))
    return journal.take()


def way(light_s: float = 1.28, *, is_open: bool = True, changes_s: float | None = None) -> Way:
    """A direction of the link."""
    changes_ns = None if changes_s is None else to_ns(changes_s)
    return Way(to_ns(light_s), is_open, changes_ns, 0.0, 0)


def seen(
    t_s: float, up: Way | None = None, down: Way | None = None, silent_since_s: float | None = None
) -> GroundView:
    """What the ground can know at `t_s`; both ways are open unless given."""
    return GroundView(
        to_ns(t_s),
        up or way(),
        down or way(),
        heard_ns=to_ns(t_s),
        due_ns=NEVER_NS,
        failsafe=FailsafeOutlook(None, 10.0, 30.0),
        if_nothing="",
        silent_since_ns=None if silent_since_s is None else to_ns(silent_since_s),
    )
