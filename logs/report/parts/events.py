"""The events of a run, in the sentences of every other view, and how much each asks for."""

from typing import Any

from farside.control import BatteryState, Failsafe, Verdict
from farside.frames import LinkOutage
from farside.logs.events import EVENT_TOPICS, EventLine
from farside.logs.file.reading import LogEntry
from farside.logs.known import COMMAND_TOPICS
from farside.logs.picture import Picture
from farside.logs.report.model import EventRow, View
from farside.logs.report.thinning import Rows, ms
from farside.messages import (
    BatteryChanged,
    CommandForced,
    CommandReached,
    CommandsMissing,
    FailsafeChanged,
    GoalAside,
    StuckChanged,
    Telemetry,
)
from farside.node import Topic
from farside.topics import (
    BatteryEntry,
    CommandEntry,
    EventLearned,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    HeldEntry,
    HeldFate,
    LifeEntry,
    OperatorEntry,
    Review,
    ShadowEntry,
    Silence,
    StuckEntry,
)

_ROUTINE, _WARNING, _ALARM = "routine", "warning", "alarm"
_MOST = 2500


class Events:
    """A row for each event; where there are too many, routine ones are thinned first."""

    topics: tuple[Topic[Any], ...] = tuple(dict.fromkeys((*EVENT_TOPICS, *COMMAND_TOPICS)))

    def __init__(self) -> None:
        self._picture = Picture()
        self._routine: Rows[tuple[int, EventRow]] = Rows(_MOST)
        self._others: Rows[tuple[int, EventRow]] = Rows(_MOST)
        self._number = 0

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        if isinstance(entry.message, Telemetry):  # no event, and there is much of it
            self._picture.commands.apply(entry.message, entry.log_time_ns)
            return
        line = self._picture.apply(entry)
        if line is None:
            return
        level = level_of(entry, line)
        rows = self._routine if level == _ROUTINE else self._others
        row = EventRow(ms(line.t_ns), str(line.role), line.text, level)
        rows.add((self._number, row), must=level == _ALARM)
        self._number += 1

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        view.events = [row for _, row in sorted(self._routine.rows + self._others.rows, key=_first)]
        for what, rows in (("Routine events", self._routine), ("Events", self._others)):
            if rows.every > 1:
                kept = " and every alarm" if rows is self._others else ""
                view.notes.append(f"{what}: 1 of {rows.every} is listed{kept}")


def _first(row: tuple[int, EventRow]) -> int:
    return row[0]


def level_of(entry: LogEntry, line: EventLine) -> str:
    """How much an event asks for attention: `alarm`, `warning`, `routine`, or nothing special."""
    message = entry.message
    if isinstance(message, EventLearned):
        level = _of_condition(message.event.what)
    else:
        level = _of_condition(message) or _of_link_or_ground(message)
    return level or (_ROUTINE if line.routine else "")


def _of_condition(message: object) -> str:
    """Of the rover's condition and its commands, whether so or told to the ground."""
    match message:
        case FailsafeEntry(state=state) | FailsafeChanged(state=state):
            return {Failsafe.SAFE: _ALARM, Failsafe.NOMINAL: ""}.get(state, _WARNING)
        case BatteryEntry(state=battery) | BatteryChanged(state=battery):
            return {BatteryState.FLAT: _ALARM, BatteryState.LOW: _WARNING}.get(battery, "")
        case StuckEntry(stuck=True) | StuckChanged(stuck=True):
            return _ALARM
        case (
            CommandEntry(why=str())
            | CommandReached(why=str())
            | CommandForced()
            | CommandsMissing(missing=True)
            | GoalEntry(change=GoalChange.SUSPENDED)
            | GoalAside(why=str())
        ):
            return _WARNING
        case _:
            return ""


def _of_link_or_ground(message: object) -> str:
    match message:
        case LinkOutage(down=True, reason=reason):
            return "" if reason.is_foreseen else _WARNING
        case LifeEntry(verdict=Verdict.OVERDUE | Verdict.LATE):
            return _WARNING
        case HeldEntry(fate=HeldFate.GIVEN_UP) | OperatorEntry() | Review():
            return _WARNING
        case Silence(silent=True) | ShadowEntry(in_step=False):
            return _WARNING
        case _:
            return ""
