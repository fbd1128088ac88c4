"""What an entry of the ground's log says to a person: a sentence, when it was so, what it asks for.

The sentences are those of the log's own events: the mission's words are the screen's words.
"""

import re
from typing import NamedTuple

import msgspec

from farside.console.screen.screen import Tone
from farside.control import BatteryState, Cause, CommandStage, Failsafe, ModeCause, Verdict
from farside.logs.events import event_line, happening_text
from farside.logs.file.reading import LogEntry
from farside.messages import (
    BatteryChanged,
    CommandReached,
    CommandsMissing,
    FailsafeChanged,
    Happening,
    ModeChanged,
    StuckChanged,
)
from farside.rover.failsafe.table import TABLE
from farside.topics import EventLearned, LifeEntry, ShadowEntry, Silence
from farside.validation import one_line

_LONGEST = 400  # characters, as of a line of the log

_ASKING = {rule.why for rule in TABLE if Cause.UNCONFIRMED in rule.when}
_ENDED_BADLY = {
    CommandStage.FAILED,
    CommandStage.REFUSED,
    CommandStage.EXPIRED,
    CommandStage.SUPERSEDED,
}
_NUMBER = re.compile(r"\d+(\.\d+)?")


class Trouble(NamedTuple):
    """What an alarm is about.

    Attributes:
        kind: what makes two of them the same one, such as `("failsafe", "hold")`.
        tone: how bad it is while it is so.
    """

    kind: tuple[str, ...]
    tone: Tone


OVERDUE = Trouble(("overdue",), Tone.WRONG)
SHADOW = Trouble(("shadow",), Tone.CAUTION)
SIGNAL = Trouble(("signal",), Tone.WRONG)
SILENCE = Trouble(("silence",), Tone.WRONG)
_MISSING = Trouble(("missing",), Tone.WRONG)
_MODE = Trouble(("mode",), Tone.CAUTION)
_STUCK = Trouble(("stuck",), Tone.WRONG)
_BATTERY = {
    BatteryState.LOW: Trouble(("battery", "low"), Tone.CAUTION),
    BatteryState.FLAT: Trouble(("battery", "flat"), Tone.WRONG),
}


def sentence(entry: LogEntry) -> str:
    """What an entry says, in the words of the log, on one line; empty where it says nothing.

    Of an event without the time when it was so: that stands beside it.
    """
    if isinstance(entry.message, EventLearned):
        return one_line(happening_text(entry.message.event.what), _LONGEST)
    line = event_line(entry)
    return "" if line is None else line.text


def so_ns(entry: LogEntry) -> int:
    """When it was so, as far as the entry says it; else when it was learned."""
    match entry.message:
        case EventLearned(event=event):
            return event.time_ns
        case LifeEntry(so_ns=int(known_ns)):
            return known_ns
        case _:
            return entry.publish_time_ns


def tone_of(message: msgspec.Struct) -> Tone:
    """What a message asks of a person as it comes."""
    trouble = trouble_of(message)
    return Tone.PLAIN if trouble is None else trouble.tone


def trouble_of(message: msgspec.Struct) -> Trouble | None:
    """The trouble that a message tells of; `None` of any other.

    Whether it is an alarm may depend on what came before, see `farside.console.alarms`.
    """
    match message:
        case ShadowEntry(in_step=False):
            return SHADOW
        case Silence(silent=True):
            return SILENCE
        case LifeEntry(verdict=Verdict.OVERDUE):
            return OVERDUE
        case EventLearned(event=event):
            return _on_board(event.what)
        case _:
            return None


def _on_board(what: Happening) -> Trouble | None:
    match what:
        case FailsafeChanged(state=state, why=why) if state is not Failsafe.NOMINAL:
            tone = Tone.WORD if why in _ASKING else Tone.WRONG
            trouble = Trouble(("failsafe", state), tone)
        case ModeChanged(why=ModeCause.LINK_LOST):
            trouble = _MODE
        case CommandReached(stage=stage, why=why) if stage in _ENDED_BADLY:
            # Reasons that differ in their numbers only are one: of a place, or of a command.
            trouble = Trouble(("command", stage, _NUMBER.sub("#", why or "")), Tone.CAUTION)
        case CommandsMissing(missing=True):
            trouble = _MISSING
        case BatteryChanged(state=battery) if battery in _BATTERY:
            trouble = _BATTERY[battery]
        case StuckChanged(stuck=True):
            trouble = _STUCK
        case _:
            return None
    return trouble


def ends(message: msgspec.Struct, kind: tuple[str, ...]) -> bool:
    """Whether a message says by itself that a trouble of this kind is over.

    Of a kind whose end is not told, such as a refused command, nothing does.
    """
    match message:
        case Silence(silent=False):
            return kind == SILENCE.kind
        case EventLearned(event=event):
            return _ends_on_board(event.what, kind)
        case _:
            return False


def _ends_on_board(what: Happening, kind: tuple[str, ...]) -> bool:
    match what:
        case FailsafeChanged(state=state):
            return kind[0] == "failsafe" and kind[1] != state
        case ModeChanged(why=why) if why is not ModeCause.LINK_LOST:
            return kind == _MODE.kind
        case CommandsMissing(missing=False):
            return kind == _MISSING.kind
        case BatteryChanged(state=battery) if battery not in _BATTERY:
            return kind[0] == "battery"
        case StuckChanged(stuck=False):
            return kind == _STUCK.kind
        case _:
            return False
