"""The conductor: advances a crew window by window, records the log and keeps the pace."""

import math
import time
from collections.abc import Callable, Sequence
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, Protocol

from farside.acts import Act
from farside.ground.config import QUEUED
from farside.ground.view.view import Focus, GroundView
from farside.logs.recording import Recorder
from farside.missions.crew.crew import Crew
from farside.missions.interrupts import Interrupts
from farside.missions.schema import MissionFile
from farside.node import Record, Role, to_ns, to_s
from farside.validation import shown

_PACED_WINDOW_WALL_S = 0.1
_LONGEST_SLEEP_S = 0.1  # a signal does not end a sleep
_log_time_ns = attrgetter("log_time_ns")


class Watcher(Protocol):
    """Observer of a run in progress, who may give orders where the mission's operator is `queued`.

    A class that derives from it need define no more than `watch` and `wait`, and gives no orders.
    The run waits while `watch` does, for as long as that takes: so a watcher may pace it, or hold
    it.
    """

    def opened(self, log: Path) -> None:  # noqa: ARG002 - for those that define it
        """Called before the first window, with the log that is written."""
        return  # without a body it would be abstract

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:  # noqa: ARG002
        """Called once before the first window, with what to look at the ground with.

        It is to be called from within `watch` only, as often as one likes: it says what a person at
        the ground can know at that moment, and `None` where the ground is lost. Looking changes
        nothing.

        Args:
            look: see `farside.missions.crew.crew.Crew.look`.
        """
        return

    def window_ns(self, now_ns: int) -> int | None:  # noqa: ARG002
        """Called before each window: the longest that it may be, so that it is seen to go on.

        The log does not depend on it. Less than a tick is one tick.

        Args:
            now_ns: simulated time at which the window begins.

        Returns:
            simulated nanoseconds; `None` for no limit.
        """
        return None

    def orders(self, now_s: float) -> Sequence[Act]:  # noqa: ARG002 - for those that define it
        """Called before each window: what is ordered on its first tick, in order.

        Args:
            now_s: simulated time at which the window begins.
        """
        return ()

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """Called after each window.

        Args:
            now_s: simulated time that the run has reached.
            records: the records of the window, in log order.
        """
        ...

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """Called when processes do not answer for long, and again while they do not.

        Args:
            roles: the roles that the run waits for.
            waited_s: for how long so far, in wall-clock seconds.
        """
        ...


class WallClock(NamedTuple):
    """Wall time in seconds for pacing: a monotonic clock and a sleep. Tests replace them."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


_WALL_CLOCK = WallClock()


class Conductor:
    """Runs a mission from start to end.

    Args:
        mission: the mission.
        crew: the three nodes, at time 0.
        recorder: writes the log.
        watcher: observes every window.
        interrupts: end the run after the window in progress, the second one within it.
        pace: most simulated seconds per wall second; infinite for as fast as possible. The log
            does not depend on it.
        window_ns: longest window, if shorter than the link allows.
        clock: wall time.

    Attributes:
        now_ns: simulated time reached.
    """

    def __init__(
        self,
        mission: MissionFile,
        crew: Crew,
        recorder: Recorder,
        watcher: Watcher,
        interrupts: Interrupts,
        *,
        pace: float = math.inf,
        window_ns: int | None = None,
        clock: WallClock = _WALL_CLOCK,
    ) -> None:
        self._mission = mission
        self._crew = crew
        self._recorder = recorder
        self._watcher = watcher
        self._interrupts = interrupts
        self._pace = pace
        self._window_ns = _window_ns(mission, pace, window_ns)
        self._clock = clock
        self.now_ns = 0

    def run(self) -> None:
        """Run to the end of the mission, or until an interrupt is requested.

        Raises:
            KeyboardInterrupt: on a second interrupt within a window, of which nothing is recorded.
            CrewError: if the rover's process ends first. The log holds the windows before.
            ValueError: if the watcher gives orders, and the mission's operator is not `queued`.
        """
        end_ns = to_ns(self._mission.duration_s)
        self._watcher.seeing(self._crew.look)
        started_s = self._clock.now()
        while self.now_ns < end_ns and not self._interrupts.requested:
            until_ns = min(self.now_ns + self._next_window_ns(), end_ns)
            with self._interrupts.breakable(at=2):
                records = self._crew.advance(until_ns, self._orders())
            # Each node returns its records in order of time. A stable sort keeps, at equal times,
            # the order of the nodes and of a node's own records.
            records.sort(key=_log_time_ns)
            self._recorder.write(records)
            self._recorder.flush()
            self.now_ns = until_ns
            self._watcher.watch(to_s(until_ns), records)
            self._wait(started_s + to_s(until_ns) / self._pace)

    def _next_window_ns(self) -> int:
        """How long the next window is: in whole ticks, one at least."""
        asked_ns = self._watcher.window_ns(self.now_ns)
        if asked_ns is None or asked_ns >= self._window_ns:
            return self._window_ns
        tick_ns = self._mission.tick_ns
        return max(1, asked_ns // tick_ns) * tick_ns

    def _orders(self) -> Sequence[Act]:
        acts = self._watcher.orders(to_s(self.now_ns))
        operator = self._mission.ground.operator
        if acts and operator != QUEUED:
            raise ValueError(
                f"expected no orders from outside, as ground.operator is {shown(operator)}, "
                f"found {shown(acts[0])}: only {shown(QUEUED)} takes them"
            )
        return acts

    def _wait(self, until_s: float) -> None:
        while (ahead_s := until_s - self._clock.now()) > 0 and not self._interrupts.requested:
            self._clock.sleep(min(ahead_s, _LONGEST_SLEEP_S))


def _window_ns(mission: MissionFile, pace: float, longest_ns: int | None) -> int:
    length_ns = mission.window_ns
    if longest_ns is not None:
        length_ns = min(length_ns, longest_ns)
    paced_s = pace * _PACED_WINDOW_WALL_S
    if paced_s < to_s(length_ns):
        length_ns = to_ns(paced_s)
    return max(1, length_ns // mission.tick_ns) * mission.tick_ns
