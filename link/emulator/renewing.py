"""Looks ahead on a wall clock: in a thread of its own, so that no message waits for it."""

from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Any

from farside.link.emulator.horizon import Ahead, look_ahead
from farside.link.emulator.model import Emulator
from farside.link.profile.resolve import LightEnd
from farside.node import to_ns


class Renewal:
    """Keeps an emulator's tables ahead of its clock, and tells where light times end.

    Args:
        emulator: the link.
        notify: called with a message when light times are going to end, and when they have.
    """

    def __init__(self, emulator: Emulator[Any], notify: Callable[[str], None]) -> None:
        self._emulator, self._notify = emulator, notify
        self._coming: Future[Ahead] | None = None
        self._foretold: LightEnd | None = None
        self._ended = False
        self._foretell()

    def step(self, now_ns: int) -> None:
        """Do what is due; takes microseconds as a rule.

        Raises:
            LinkConfigError: if a file that was there is there no longer.
        """
        ahead = self._emulator.ahead
        if self._coming is not None:
            if self._coming.done():
                self._emulator.renew(self._coming.result())
                self._coming = None
        elif now_ns >= ahead.renew_ns:
            self._coming = _in_background(lambda: look_ahead(ahead.profile, now_ns))
        end = ahead.light_end
        if end is not self._foretold and end != self._foretold:
            self._foretell()
        if end is not None and not self._ended and now_ns >= to_ns(end.at_s):
            self._ended = True
            self._notify(f"the ephemeris has ended, {end.date}: light times stay as they are")

    def _foretell(self) -> None:
        self._foretold, self._ended = self._emulator.ahead.light_end, False
        if self._foretold is not None:
            self._notify(
                f"light times are known until {self._foretold.date}; from then on they stay"
            )


def _in_background(compute: Callable[[], Ahead]) -> Future[Ahead]:
    future: Future[Ahead] = Future()

    def run() -> None:
        try:
            future.set_result(compute())
        except Exception as error:  # noqa: BLE001 - raised where the result is asked for
            future.set_exception(error)

    Thread(target=run, name="looking ahead", daemon=True).start()
    return future
