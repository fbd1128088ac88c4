"""The stick's place among the pages: one of all commands, and hands over explicitly."""

import time
from typing import Protocol

NAME = "the stick at the ground's computer"
"""What the stick is called among those who may command."""


class AmongSeats(Protocol):
    """What a stick needs of `farside.console.seats.Seats`, in which it takes part like a page.

    Attributes:
        asks: who asks for command; `None` if nobody does.
    """

    asks: str | None

    def open(self, page: str, now_s: float) -> None:
        """Take part."""
        ...

    def close(self, page: str, now_s: float) -> None:
        """Take part no longer."""
        ...

    def holds(self, page: str) -> bool:
        """Whether it commands."""
        ...

    def ask(self, page: str, now_s: float) -> bool:
        """Ask for command; whether it has it now."""
        ...

    def hand_over(self, page: str) -> bool:
        """Hand command over to whoever asks; whether it did."""
        ...


class StickSeat:
    """The seat of the stick. It takes part from its first order, or Start, until it is unplugged.

    A stick that only lies on the table must not keep command from the first page.

    Args:
        seats: who may command; `None` where nobody else can.
    """

    def __init__(self, seats: AmongSeats | None) -> None:
        self._seats = seats
        self._takes_part = False
        self._told: tuple[bool, str | None] = (False, None)

    def is_held(self) -> bool:
        """Whether the stick commands."""
        if self._seats is None:
            return True
        self._take_part(self._seats)
        return self._seats.holds(NAME)

    def take_or_give(self) -> str:
        """Start was pressed; what to tell the person."""
        seats = self._seats
        if seats is None:
            return "this stick commands; nobody else can"
        self._take_part(seats)
        if not seats.holds(NAME):
            is_given = seats.ask(NAME, time.monotonic())
            return "" if is_given else "asked the page that commands to hand over"
        return "" if seats.hand_over(NAME) else "not handed over: no page asks"

    def news(self) -> str:
        """What changed of it since the last call, for the person; mostly empty."""
        if self._seats is None or not self._takes_part:
            return ""
        holds, asks = self._seats.holds(NAME), self._seats.asks
        told, self._told = self._told, (holds, asks)
        if holds and asks is not None and told[1] != asks:
            return "a page asks to command; Start hands over"
        if holds != told[0]:
            return "this stick commands now" if holds else "a page commands now"
        return ""

    def leave(self) -> str:
        """The stick was unplugged, or is no longer used. Nothing to tell."""
        if self._seats is not None and self._takes_part:
            self._seats.close(NAME, time.monotonic())
        self._takes_part, self._told = False, (False, None)
        return ""

    def _take_part(self, seats: AmongSeats) -> None:
        if not self._takes_part:
            self._takes_part = True
            seats.open(NAME, time.monotonic())
