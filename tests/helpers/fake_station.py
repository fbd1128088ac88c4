"""A station without a run behind it: a rover walks through blackout's yard; everything is shown.

For trying out what draws a screen. Orders are noted and answered, and change nothing but what a
person would see at once: the proposal answered, the goal set, the alarm acknowledged, the pace.
"""

import threading
from collections.abc import Callable

from fake_screen import YARD, screen_of
from fake_session import FakeSession

from farside.console.screen.screen import Chart, Screen
from farside.console.session import Session
from farside.node import to_ns


class FakeStation:
    """A station that is moved on by hand, or by `pace` from a thread of its own.

    Attributes:
        session: what its orders reach.
        version: grows with every change.
        chart: blackout's yard.
    """

    chart = Chart(YARD, 1.0)

    def __init__(self) -> None:
        self.session = FakeSession()
        self.version = 1
        self._lock = threading.Condition()

    @property
    def is_hurried(self) -> bool:
        return self.session.pacing.is_hurried

    def do(self, what: Callable[[Session], str]) -> str:
        with self._lock:
            said = what(self.session)
            self.version += 1
            self._lock.notify_all()
        return said

    def wait_for(self, *asked: str) -> None:
        """Wait until the last that was asked for is this."""
        with self._lock:
            self._lock.wait_for(lambda: self.session.asked[-len(asked) :] == list(asked), 5.0)
            assert self.session.asked[-len(asked) :] == list(asked), self.session.asked

    def reset(self) -> None:
        """Begin anew."""
        with self._lock:
            self.session = FakeSession()
            self.version += 1

    def advance(self, seconds: float) -> None:
        """Let simulated time pass."""
        with self._lock:
            self.session.now_ns += to_ns(seconds)
            self.version += 1

    def propose(self, number: int) -> None:
        """Put another proposal in the place of the one that stands."""
        with self._lock:
            self.session.number = number
            self.version += 1

    def screen(self) -> Screen:
        with self._lock:
            return screen_of(self.session)
