"""The conductor: leads a crew through a run window by window, and writes the log."""

import math
import time
from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import NamedTuple, Protocol

from farside.logs.recording import Recorder
from farside.missions.crew.crew import Crew
from farside.missions.interrupts import Interrupts
from farside.missions.schema import MissionFile
from farside.node import Record, to_ns, to_s

_PACED_WINDOW_WALL_S = 0.1
_LONGEST_SLEEP_S = 0.1  # a signal does not end a sleep
_log_time = attrgetter("log_time_ns")


class Watcher(Protocol):
    """Is shown a run while it runs."""

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """The run is at `now_s`; these records were made since the last call."""
        ...


class WallClock(NamedTuple):
    """Wall time for pacing, replaced in tests."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


_WALL_CLOCK = WallClock()


class Conductor:
    """Runs a mission from its start to its end.

    Args:
        mission: the mission.
        crew: who plays the three roles.
        recorder: the log.
        watcher: is shown every window.
        interrupts: end the run after the window that is on; the second one within it.
        pace: simulated seconds per wall second, infinite for as fast as possible. The log does
            not depend on it.
        window_ns: length of a window at most, where it should be shorter than the link allows.
        clock: wall time.

    Attributes:
        now_ns: how far the run is.
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
            KeyboardInterrupt: if a second interrupt came within a window, of which nothing is
                recorded then.
            CrewError: if the rover's process ends before. What was recorded is in the log.
        """
        end_ns = to_ns(self._mission.duration_s)
        began_s = self._clock.now()
        while self.now_ns < end_ns and not self._interrupts.requested:
            until_ns = min(self.now_ns + self._window_ns, end_ns)
            # Every node gives its records in order; a stable sort keeps the order of nodes, and
            # of a node's own records, where times are the same.
            with self._interrupts.breakable(at=2):
                made = self._crew.advance(until_ns)
            records = sorted(made, key=_log_time)
            self._recorder.write(records)
            self._recorder.flush()
            self.now_ns = until_ns
            self._watcher.watch(to_s(until_ns), records)
            self._wait(began_s + to_s(until_ns) / self._pace)

    def _wait(self, until_s: float) -> None:
        while (ahead_s := until_s - self._clock.now()) > 0 and not self._interrupts.requested:
            self._clock.sleep(min(ahead_s, _LONGEST_SLEEP_S))


def _window_ns(mission: MissionFile, pace: float, at_most_ns: int | None) -> int:
    wanted_ns = mission.window_ns
    if at_most_ns is not None:
        wanted_ns = min(wanted_ns, at_most_ns)
    if math.isfinite(pace):
        wanted_ns = min(wanted_ns, to_ns(pace * _PACED_WINDOW_WALL_S))
    return max(1, wanted_ns // mission.tick_ns) * mission.tick_ns
