"""The hand of a person at a page: what was pressed there becomes an order, or is refused in words."""

import time
from collections.abc import Callable
from enum import StrEnum

import msgspec

from farside.console.page.shown import Shown
from farside.console.seats import Seats
from farside.console.session import Session, Until
from farside.control import Mode
from farside.messages import Tokens

SETTLED_MS = 500.0
"""A button whose meaning changed within this wall time does nothing (project default)."""


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
        number: of the proposal, the command, what is held, or the alarm (0 for all).
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
        """Whether this page may order."""
        return self.page is not None and self._seats.holds(self.page)

    def order(self, press: Press) -> str:
        """Do what was pressed; what to tell the person, empty for nothing."""
        if not self.has_stick:
            quiet = press.what is What.LOOK
            return "" if quiet else "not done: another page has the stick; ask for it above"
        if press.shown_ms is not None and press.shown_ms < SETTLED_MS:
            return "not done: what this does has just changed; look, and press again"
        return self._station.do(_does(press))

    def ask(self) -> str:
        """Ask for the stick; what to tell the person."""
        if self.page is not None and self._seats.ask(self.page, time.monotonic()):
            return "this page has the stick"
        return "asked for the stick: whoever has it is to hand it over"

    def hand_over(self) -> str:
        """Give the stick to the page that asks; what to tell the person."""
        given = self.page is not None and self._seats.hand_over(self.page)
        return "the stick is handed over" if given else "not handed over: no page asks for the stick"

    def keep(self) -> str:
        """Say no to the page that asks; what to tell the person."""
        kept = self.page is not None and self._seats.keep(self.page)
        return "the stick stays here" if kept else ""


def _does(press: Press) -> Callable[[Session], str]:
    return lambda session: _do(session, press) or ""


def _do(session: Session, press: Press) -> str | None:
    match press.what:
        case What.CHOOSE:
            return session.choose(press.word, insist=press.insist)
        case What.APPROVE if press.number:
            return session.approve(press.number)
        case What.VETO if press.number:
            return session.veto(press.number)
        case What.APPROVE | What.VETO:
            return "not ordered: no proposal waits for an answer"
        case What.TAKE_BACK if press.number:
            return session.take_back(press.number)
        case What.TAKE_BACK:
            return "not ordered: nothing on its way can be taken back"
        case What.DISCARD:
            return session.discard(press.number)
        case What.GOAL:
            return session.set_goal(press.word, press.amount)
        case What.WITHDRAW:
            return session.withdraw_goal(press.tokens)
        case What.MODE:
            return session.set_mode(Mode(press.word))
        case What.ACKNOWLEDGE:
            return session.acknowledge(press.number or None)
        case _:
            return _look(session, press)


def _look(session: Session, press: Press) -> str | None:
    """Time, and what is looked at."""
    match press.what:
        case What.PAUSE:
            return session.play() if press.word == "play" else session.pause()
        case What.SPEED:
            return session.set_speed(press.amount or 1.0)
        case What.SLOWER:
            return session.slower()
        case What.FASTER:
            return session.faster()
        case What.ARRIVAL:
            return session.warp(Until.ARRIVAL)
        case What.CONTACT:
            return session.warp(Until.CONTACT)
        case What.HEAT:
            return session.show_heat(press.word == "shown")
        case What.LOOK:
            return session.look_at(press.word or None)
        case _:
            return session.read()
