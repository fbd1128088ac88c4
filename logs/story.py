"""A run in words: one line for each entry that somebody who follows a run wants to read."""

from typing import NamedTuple

import msgspec

from farside.messages import (
    Approve,
    BatteryChanged,
    BatteryState,
    CommandRefused,
    Drive,
    Failsafe,
    FailsafeChanged,
    GoalReached,
    Happening,
    ModeChanged,
    Order,
    Override,
    SetGoal,
    SetMode,
    StuckChanged,
    Tokens,
    WithdrawGoal,
)
from farside.node import Direction, Role, to_s
from farside.topics import (
    ActionEnded,
    BatteryEntry,
    CommandSent,
    CommandTaken,
    EventLearned,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    LinkOutage,
    ModeEntry,
    OutageReason,
    Silence,
    StuckEntry,
)
from farside.validation import one_line

_LINE_LENGTH = 400


class StoryLine(NamedTuple):
    """One event of the story; see `tell` for what its text holds.

    Attributes:
        t_ns: when it became known.
        who: whose part of the run it belongs to.
        text: what happened.
        routine: whether it is one of many alike, such as a step of a tour.
    """

    t_ns: int
    who: Role
    text: str
    routine: bool = False


def clock(t_ns: int) -> str:
    """Simulated time in hours, minutes and whole tenths of a second, such as `0:12:34.5`."""
    minutes, tenths = divmod(t_ns // 100_000_000, 600)
    return f"{minutes // 60}:{minutes % 60:02}:{tenths // 10:02}.{tenths % 10}"


def name(sign: Tokens) -> str:
    """A Sign as people read it: its Tokens with a plus between them, fit for a terminal."""
    return one_line(" + ".join(sign), _LINE_LENGTH)


def tell(t_ns: int, entry: msgspec.Struct) -> StoryLine | None:
    """The line for an entry logged at `t_ns`; `None` for what is measurement or repetition.

    Its text is fit for a terminal, whatever the log holds, and cut after `_LINE_LENGTH` characters.
    """
    line = _told(t_ns, entry)
    return line and line._replace(text=one_line(line.text, _LINE_LENGTH))


def _told(t_ns: int, entry: msgspec.Struct) -> StoryLine | None:
    match entry:
        case ModeEntry(mode=mode, why=why):
            return StoryLine(t_ns, Role.ROVER, f"mode {mode}: {why}")
        case FailsafeEntry(state=state, silence_s=silence_s):
            return StoryLine(t_ns, Role.ROVER, _failsafe(state, silence_s))
        case GoalEntry():
            return StoryLine(t_ns, Role.ROVER, _goal(entry))
        case CommandTaken(number=number, order=order, refused=str(why)):
            text = f"refuses command {number} ({_order(order)}): {why}"
            return StoryLine(t_ns, Role.ROVER, text)
        case _:
            return _tell_of_condition(t_ns, entry) or _tell_of_link_or_ground(t_ns, entry)


def _tell_of_condition(t_ns: int, entry: msgspec.Struct) -> StoryLine | None:
    match entry:
        case ActionEnded(blocked=True):
            text = f"{entry.action} was blocked, after {entry.duration_s:.1f} s"
            return StoryLine(t_ns, Role.ROVER, text, routine=True)
        case BatteryEntry(state=battery, charge=charge):
            return StoryLine(t_ns, Role.ROVER, _battery(battery, charge))
        case StuckEntry(stuck=stuck, moves=moves) if stuck or t_ns > 0:
            return StoryLine(t_ns, Role.ROVER, _stuck(stuck=stuck, moves=moves))
        case _:
            return None


_OUTAGES = {
    OutageReason.BLACKOUT: "blackout",
    OutageReason.PASS: "gap between passes",
    OutageReason.CONTACT: "gap between contacts",
    OutageReason.CONJUNCTION: "solar conjunction",
    OutageReason.CONTROL: "outage by hand",
}


def _tell_of_link_or_ground(t_ns: int, entry: msgspec.Struct) -> StoryLine | None:
    match entry:
        case LinkOutage(direction=direction, down=down, reason=reason):
            way = "uplink" if direction is Direction.UP else "downlink"
            text = f"{way}: {_OUTAGES[reason]} {'begins' if down else 'ends'}"
            return StoryLine(t_ns, Role.LINK, text)
        case CommandSent(number=number, order=order):
            text = f"command {number}: {_order(order)}"
            return StoryLine(t_ns, Role.GROUND, text, routine=isinstance(order, Drive | Approve))
        case EventLearned(event=event):
            text = f"learns of {clock(event.time_ns)}: {_happening(event.what)}"
            return StoryLine(t_ns, Role.GROUND, text)
        case Silence(silent=silent):
            text = "hears nothing from the rover" if silent else "hears the rover"
            return StoryLine(t_ns, Role.GROUND, text)
        case _:
            return None


def _failsafe(state: Failsafe, silence_s: float) -> str:
    if state is Failsafe.NOMINAL:
        return f"failsafe {state}"
    return f"failsafe {state} after {silence_s:.1f} s of silence"


def _battery(state: BatteryState, charge: float) -> str:
    if state is BatteryState.FLAT:
        return "battery flat: the rover cannot move"
    return f"battery {state}, {charge:.0%}"


def _stuck(*, stuck: bool, moves: int) -> str:
    if stuck:
        return f"stuck: the last {moves} moves were blocked"
    return "moves again"


def _goal(entry: GoalEntry) -> str:
    text = f"goal {name(entry.tokens)} {entry.change}"
    if entry.change is GoalChange.SET:
        text += f" ({entry.source}, priority {entry.priority:.3g})"
    return text


def _order(order: Order) -> str:
    match order:
        case Drive(action=action):
            text = f"drive {action}"
        case Approve(proposal=proposal):
            text = f"approve proposal {proposal}"
        case Override(proposal=proposal, action=action):
            text = f"override proposal {proposal} with {action}"
        case SetMode(mode=mode):
            text = f"mode {mode}"
        case SetGoal(tokens=tokens, priority=priority):
            text = f"goal {name(tokens)}, priority {priority:.3g}"
        case WithdrawGoal(tokens=tokens):
            text = f"withdraw goal {name(tokens)}"
    return text


def _happening(what: Happening) -> str:
    match what:
        case ModeChanged(mode=mode, why=why):
            text = f"mode {mode}: {why}"
        case FailsafeChanged(state=state, silence_ns=silence_ns):
            text = _failsafe(state, to_s(silence_ns))
        case GoalReached(tokens=tokens):
            text = f"goal {name(tokens)} reached"
        case CommandRefused(number=number, why=why):
            text = f"command {number} refused: {why}"
        case BatteryChanged(state=battery, charge=charge):
            text = _battery(battery, charge)
        case StuckChanged(stuck=stuck, moves=moves):
            text = _stuck(stuck=stuck, moves=moves)
    return text
