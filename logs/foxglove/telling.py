"""How states, numbers and events are told: as a record, if there is anything to tell."""

from collections.abc import Callable
from typing import Any

import msgspec
from foxglove.messages import Log, LogLevel

from farside.control import BatteryState, Failsafe, Verdict
from farside.frames import LinkOutage
from farside.logs.events import event_line
from farside.logs.file.reading import LogEntry
from farside.logs.foxglove.names import PICTURES, PictureTopic
from farside.logs.foxglove.poses import Drawn
from farside.logs.foxglove.protobuf import encoder
from farside.logs.foxglove.shapes import stamp
from farside.logs.picture import Picture
from farside.messages import CommandReached, Event
from farside.node import NS_PER_S, Record
from farside.topics import (
    ActionEnded,
    BatteryEntry,
    CommandEntry,
    EventLearned,
    FailsafeEntry,
    LifeEntry,
    ShadowEntry,
    Silence,
    StuckEntry,
)

PLOT_NS = 5 * NS_PER_S
"""How often numbers are told that change all the time (project default)."""

_ENCODERS: dict[type[msgspec.Struct], Callable[[Any], bytes]] = {
    picture.kind: encoder(picture.kind)
    for picture in PICTURES.values()
    if not isinstance(picture.kind, str)
}


def told(topic: PictureTopic, t_ns: int, message: msgspec.Struct) -> Drawn:
    """A state or numbers, from now on."""
    return (Record(topic.name, t_ns, t_ns, _ENCODERS[type(message)](message)),)


def told_event(topic: PictureTopic, name: str, picture: Picture | None, entry: LogEntry) -> Drawn:
    """What happened, if it is news.

    Args:
        topic: where it is told.
        name: who recorded it.
        picture: what was so before; `None` where every event is news.
        entry: the message.
    """
    if _says_nothing(entry.message):
        return ()
    line = event_line(entry) if picture is None else picture.apply(entry)
    if line is None:
        return ()
    t_ns = entry.log_time_ns
    level = LogLevel.Debug if line.routine else _level(entry.message)
    log = Log(timestamp=stamp(t_ns), level=level, message=line.text, name=name)
    return (Record(topic.name, t_ns, t_ns, log.encode()),)


def _says_nothing(message: msgspec.Struct) -> bool:
    """Whether a message never makes a line: it is asked first, as most messages are such."""
    match message:
        case ActionEnded(blocked=False) | CommandEntry(why=None):
            return True
        case EventLearned(event=Event(what=CommandReached(why=None))):
            return True
        case _:
            return False


def _level(message: msgspec.Struct) -> LogLevel:
    """How much an event asks to be seen: whatever is not as it should be is a warning."""
    match message:
        case (
            FailsafeEntry(state=Failsafe.HOLD | Failsafe.ALONE | Failsafe.SAFE)
            | BatteryEntry(state=BatteryState.LOW | BatteryState.FLAT)
            | StuckEntry(stuck=True)
            | LinkOutage(down=True)
            | CommandEntry()
            | LifeEntry(verdict=Verdict.OVERDUE | Verdict.LATE)
            | Silence(silent=True)
            | ShadowEntry(in_step=False)
        ):
            return LogLevel.Warning
        case _:
            return LogLevel.Info
