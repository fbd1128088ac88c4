"""The station: a session that the thread of a run, those of pages and a terminal's share."""

import threading
import time
from collections.abc import Callable, Sequence

from farside.acts import Act
from farside.console.pacing import LONGEST_WINDOW_NS
from farside.console.screen.screen import Chart, Screen
from farside.console.session import Session
from farside.ground.view.view import Focus, GroundView
from farside.node import Record

LOOK_S = 0.1
"""Wall time between two looks: as often as a screen is drawn (project default)."""

_HELD_S = 0.02


class Station:
    """A session behind a lock. Every method may be called from any thread.

    Args:
        session: the session, which nobody else may touch.
        end: ends the run after the window in progress.
        now: wall time in seconds, from any origin.

    Attributes:
        version: grows with everything that may change the screen.
    """

    def __init__(
        self,
        session: Session,
        *,
        end: Callable[[], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.version = 0
        self._session, self._end, self._now = session, end, now
        self._moved = threading.Condition()
        self._look: Callable[[Focus], GroundView | None] | None = None
        self._looked: tuple[float, int, Focus] = (-LOOK_S, -1, Focus())
        self._shown: tuple[int, Screen] | None = None
        self._passed_s = now()
        self._is_left = False

    # --- for who is at the station -------------------------------------------------------------

    def do(self, what: Callable[[Session], str]) -> str:
        """Have something done with the session; what it says of it."""
        with self._moved:
            said = what(self._session)
            self._changed()
        return said

    def screen(self) -> Screen:
        """What is shown now; the same object until the version grows."""
        with self._moved:
            if self._shown is None or self._shown[0] != self.version:
                self._shown = self.version, self._session.screen()
            return self._shown[1]

    @property
    def chart(self) -> Chart | None:
        """The map as the ground has it; `None` before the first window."""
        return self._session.chart

    @property
    def is_hurried(self) -> bool:
        """Whether time passes so fast that nobody reads along: a screen may be drawn less often."""
        return self._session.pacing.is_hurried

    def end(self) -> None:
        """End the run after the window in progress; its log is whole."""
        self._end()

    def leave(self) -> None:
        """Nobody is here any more: the run goes on as fast as it can, and nothing holds it."""
        with self._moved:
            self._is_left = True
            self._changed()

    def _changed(self) -> None:
        self.version += 1
        self._moved.notify_all()

    # --- for the run, whose thread waits here --------------------------------------------------

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:
        """The run begins, and can be looked at by this from within `watch`."""
        self._look = look

    def orders(self) -> Sequence[Act]:
        """What was ordered for the window that begins."""
        with self._moved:
            return self._session.orders()

    def window_ns(self, now_ns: int) -> int:
        """The longest window that is wanted from now on."""
        with self._moved:
            pacing = self._session.pacing
            return LONGEST_WINDOW_NS if self._is_left else pacing.window_ns(now_ns)

    def watch(self, now_ns: int, records: Sequence[Record], *, ending: Callable[[], bool]) -> None:
        """A window is over. Returns when the next one may begin, or the run is to end.

        Args:
            now_ns: simulated time that the run has reached.
            records: those of the window.
            ending: whether the run is to end.
        """
        with self._moved:
            self._session.take(now_ns, records)
            self._changed()
        while True:
            wall_s = self._now()
            with self._moved:
                pacing, focus = self._session.pacing, self._session.focus
                pacing.pass_wall(wall_s - self._passed_s, now_ns)
                self._passed_s = wall_s
                goes_on = ending() or self._is_left or pacing.allows(now_ns)
            self._see(now_ns, wall_s, focus, held=not goes_on)
            if goes_on:
                return
            with self._moved:
                self._moved.wait(_HELD_S)

    def _see(self, now_ns: int, wall_s: float, focus: Focus, *, held: bool) -> None:
        """Look, unless what was seen last is as new as need be. The lock is free meanwhile."""
        last_s, last_ns, last_focus = self._looked
        due = wall_s - last_s >= LOOK_S
        is_news = (last_ns, last_focus) != (now_ns, focus)
        if self._look is None or not is_news or not (due or held):
            return
        self._looked = wall_s, now_ns, focus
        view = self._look(focus)
        with self._moved:
            self._session.see(view)
            self._changed()

    def wait(self, standing: str) -> None:
        """The run waits for something, in words."""
        with self._moved:
            self._session.wait(standing)
            self._changed()

    def finish(self, outcome: str) -> None:
        """The run is over."""
        with self._moved:
            self._session.finish(outcome)
            self._changed()
