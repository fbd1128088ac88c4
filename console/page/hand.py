"""The hand of a person at a page: what was pressed becomes an order, or is refused in words."""

import time
from collections.abc import Callable
from enum import StrEnum

import msgspec

from farside.console.pacing import Until
from farside.console.page.shown import Shown
from farside.console.seats import Seats
from farside.console.session import Session
from farside.control import Mode
from farside.messages import Tokens
from farside.validation import shown

SETTLED_MS = 500.0
"""A button whose meaning changed within this wall time does nothing (project default)."""

JUST_CHANGED = "not done: what this does has just changed; look, and press again"
"""What the person is told then."""


class What(StrEnum):
    """What can be asked for from a page."""

    CHOOSE = "choose"
    APPROVE = "approve"
    VETO = "veto"
    TAKE_BACK = "take_back"
    DISCARD = "discard"
    GOAL = "goal"
    WITHDRAW = "withdraw"
    MODE = "mode"
    PAUSE = "pause"
    PLAY = "play"
    SPEED = "speed"
    SLOWER = "slower"
    FASTER = "faster"
    ARRIVAL = "arrival"
    CONTACT = "contact"
    HEAT = "heat"
    LOOK = "look"
    ACKNOWLEDGE = "acknowledge"
    READ = "read"


class Press(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """Something pressed on a page, and what the person saw when it was.

    Attributes:
        what: what is asked for.
        word: the action, the place or the mode; empty for no place.
        number: of the proposal, the command, or what is held.
        alarms: the alarms that were seen and are acknowledged.
        amount: the priority of a goal, or the speed.
        tokens: the goal to withdraw.
        shown_ms: for how long the page had shown the same meaning of what was pressed.
        insist: whether it is meant although much speaks against it.
    """

    what: What
    word: str = ""
    number: int = 0
    amount: float | None = None
    tokens: Tokens = ()
    alarms: tuple[int, ...] = ()
    shown_ms: float | None = None
    insist: bool = False


class Hand:
    """What one page may do.

    Args:
        station: what it orders at.
        seats: who has the stick.
        page: which page it is; `None` while it is not connected.
    """

    def __init__(self, station: Shown, seats: Seats) -> None:
        self._station, self._seats = station, seats
        self.page: str | None = None

    @property
    def has_stick(self) -> bool:
        """Whether this page commands."""
        return self.page is not None and self._seats.holds(self.page)

    def order(self, press: Press) -> str:
        """Do what was pressed; what to tell the person, empty for nothing."""
        if not self.has_stick:
            quiet = press.what is What.LOOK
            return "" if quiet else "not done: another page commands; ask for command at the top"
        if press.shown_ms is not None and press.shown_ms < SETTLED_MS:
            return JUST_CHANGED
        return self._station.do(_does(press))

    def ask(self) -> str:
        """Ask for the stick; what to tell the person."""
        if self.page is not None and self._seats.ask(self.page, time.monotonic()):
            return "this page commands now"
        return "asked for command: whoever has it is to hand it over"

    def hand_over(self) -> str:
        """Give the stick to the page that asks; what to tell the person."""
        given = self.page is not None and self._seats.hand_over(self.page)
        return "command is handed over" if given else "not handed over: nobody asks for command"


def _does(press: Press) -> Callable[[Session], str]:
    return lambda session: _DOES[press.what](session, press)


def _answer(session: Session, press: Press) -> str:
    if not press.number:
        return "not ordered: no proposal waits for an answer"
    answer = session.approve if press.what is What.APPROVE else session.veto
    return answer(press.number)


def _take_back(session: Session, press: Press) -> str:
    if not press.number:
        return "not taken back: nothing is on its way that can be"
    return session.take_back(press.number)


def _set_mode(session: Session, press: Press) -> str:
    if press.word not in set(Mode):
        return f"not ordered: expected {', '.join(Mode)}, found {shown(press.word)}"
    return session.set_mode(Mode(press.word))


def _pause(session: Session, press: Press) -> str:
    """Pause and go on are one switch of the session; two pages must not undo each other."""
    wants = press.what is What.PAUSE
    return session.pause() if session.pacing.paused != wants else ""


def _acknowledge(session: Session, press: Press) -> str:
    """Only what was seen: an alarm that comes at this very moment stays."""
    if not press.alarms:
        return "not acknowledged: no alarm stands"
    said = [session.acknowledge(alarm) for alarm in press.alarms]
    return said[0] if len(said) == 1 else f"{len(said)} acknowledged"


def _set_heat(session: Session, press: Press) -> str:
    session.show_heat(press.word == "shown")
    return ""


def _look(session: Session, press: Press) -> str:
    session.look_at(press.word or None)
    return ""


def _read(session: Session, _: Press) -> str:
    session.read()
    return ""


_DOES: dict[What, Callable[[Session, Press], str]] = {
    What.CHOOSE: lambda session, press: session.choose(press.word, insist=press.insist),
    What.APPROVE: _answer,
    What.VETO: _answer,
    What.TAKE_BACK: _take_back,
    What.DISCARD: lambda session, press: session.discard(press.number),
    What.GOAL: lambda session, press: session.set_goal(press.word, press.amount),
    What.WITHDRAW: lambda session, press: session.withdraw_goal(press.tokens),
    What.MODE: _set_mode,
    What.PAUSE: _pause,
    What.PLAY: _pause,
    What.SPEED: lambda session, press: session.set_speed(press.amount or 0.0),
    What.SLOWER: lambda session, _: session.slower(),
    What.FASTER: lambda session, _: session.faster(),
    What.ARRIVAL: lambda session, _: session.warp(Until.ARRIVAL),
    What.CONTACT: lambda session, _: session.warp(Until.CONTACT),
    What.HEAT: _set_heat,
    What.LOOK: _look,
    What.ACKNOWLEDGE: _acknowledge,
    What.READ: _read,
}
