"""`farside run --watch`: the replay's screen on a run that goes on as far as it is played."""

import math
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar, Protocol

from textual.binding import BindingType

from farside.acts import Act
from farside.ground.view.view import Focus, GroundView
from farside.logs import LogError, LogFile
from farside.logs.terminal.app import ReplayApp
from farside.logs.terminal.transport import Key
from farside.missions.commands.display.patience import patience
from farside.missions.commands.display.progress import ProgressDisplay
from farside.missions.commands.failures import print_error
from farside.missions.conductor import Watcher
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import Record, Role, to_ns

LONGEST_WINDOW_NS = to_ns(1)
"""Windows are no longer while a run is watched, so that it is seen to go on."""

_AHEAD_S = 0.3
"""Wall time for which a run may be ahead of the screen, so that no update waits for it."""

_LOOK_S = 0.1
_INTERRUPTED = 130


class Gate(Watcher):
    """Holds a run back, so that it gets no further than it is let; what it records is the same.

    The run calls it in a thread of its own.

    Args:
        beside: another watcher, who sees the same once the gate is open.
        interrupts: a run that is to end is not held.

    Attributes:
        log: the log that is written; `None` until something is.
        now_ns: simulated time that the run has reached.
        said: what it waits for, in words.
    """

    def __init__(self, beside: Watcher, interrupts: Interrupts) -> None:
        self.log: Path | None = None
        self.now_ns = 0
        self.said = ""
        self._path: Path | None = None
        self._beside, self._interrupts = beside, interrupts
        self._until_ns: float = 0
        self._open = False
        self._moved = threading.Condition()

    def let(self, until_ns: float) -> None:
        """Let the run go on up to a simulated time, in nanoseconds; no further than the window."""
        with self._moved:
            self._until_ns = until_ns
            self._moved.notify_all()

    def open(self) -> None:
        """Let the run go on to its end, before the eyes of the other watcher."""
        self._open = True
        self.let(math.inf)

    def opened(self, log: Path) -> None:
        """See `Watcher.opened`."""
        self._path = log
        self._beside.opened(log)

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:
        """See `Watcher.seeing`."""
        self._beside.seeing(look)

    def window_ns(self, now_ns: int) -> int | None:
        """See `Watcher.window_ns`."""
        return self._beside.window_ns(now_ns)

    def orders(self, now_s: float) -> Sequence[Act]:
        """See `Watcher.orders`."""
        return self._beside.orders(now_s)

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`."""
        self.now_ns, self.log, self.said = to_ns(now_s), self._path, ""
        self._beside.watch(now_s, records)
        with self._moved:
            while self.now_ns >= self._until_ns and not self._interrupts.requested:
                self._moved.wait(_LOOK_S)

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `Watcher.wait`."""
        self.said = f"waiting for {', '.join(roles)}, {waited_s:.0f} s"
        if self._open:
            self._beside.wait(roles, waited_s)


class Holder(Protocol):
    """What holds a run back.

    Attributes:
        log: the log that is written; `None` until something is.
        said: what it waits for, in words.
    """

    log: Path | None
    said: str


class RunInThread:
    """A run in a thread of its own, so that the terminal has the main one.

    Args:
        run: runs the mission, under the eyes of what holds it.
        gate: what holds it.
    """

    def __init__(self, run: Callable[[], FinishedRun], gate: Holder) -> None:
        self._run, self._gate = run, gate
        self._finished: FinishedRun | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._do, name="run")
        self._thread.start()

    def _do(self) -> None:
        try:
            self._finished = self._run()
        except BaseException as error:  # noqa: BLE001 - raised again in the main thread
            self._error = error

    @property
    def over(self) -> bool:
        """Whether it has ended, however it did."""
        return not self._thread.is_alive()

    @property
    def standing(self) -> str:
        """How it goes, in a few words; empty while it goes as it should."""
        if not self.over:
            return self._gate.said
        if self._finished is None:
            return "the run failed"
        return f"the run is over: {self._finished.result.outcome}"

    def begun(self, interrupts: Interrupts) -> bool:
        """Wait for something to be recorded, or for the run to end; whether there is a log.

        A second interrupt ends the waiting.
        """
        while not self.over and self._gate.log is None and not interrupts.repeated:
            self._thread.join(_LOOK_S)
        return self._gate.log is not None

    def finish(self, interrupts: Interrupts) -> FinishedRun:
        """Wait for its end; a second interrupt ends the process instead.

        Raises:
            Exception: whatever the run raised.
        """
        while not self.over:
            self._thread.join(_LOOK_S)
            if interrupts.repeated and not self.over:
                log = self._gate.log
                print_error(
                    "the run is cut off before anything was recorded"
                    if log is None
                    else f"the run is cut off; for a whole log: farside recover {log}"
                )
                os._exit(_INTERRUPTED)  # no thread can be ended from another
        if self._error is not None:
            raise self._error
        assert self._finished is not None  # noqa: S101 - it has ended, and nothing was raised
        return self._finished


class WatchApp(ReplayApp):
    """The replay's screen on a run in progress: pause, speed and direction hold the run, too.

    Args:
        log: the log that is written.
        run: the run.
        gate: what holds it.
        interrupts: how it is ended.
        speed: simulated seconds per wall second, to begin with.
        now: wall time in seconds, from any origin.
    """

    BINDINGS: ClassVar[list[BindingType]] = [("ctrl+c", "end_run")]

    def __init__(
        self,
        log: LogFile,
        run: RunInThread,
        gate: Gate,
        interrupts: Interrupts,
        *,
        speed: float,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._going, self._gate, self._interrupts = run, gate, interrupts
        super().__init__(log, speed=speed, refresh=self._look, now=now)

    @property
    def keys(self) -> list[Key]:
        """See `ReplayApp.keys`."""
        if self._going.over:
            return super().keys
        return [*super().keys[:-1], ("q", "leave, the run goes on"), ("^C", "end the run")]

    def tick(self) -> None:
        """See `ReplayApp.tick`."""
        super().tick()
        player = self.player
        until_ns: float = player.now_ns
        if player.playing and not player.backwards:
            until_ns += player.speed * to_ns(_AHEAD_S)
            if player.at_end:
                # All that was recorded is seen, if not up to the window's end: nothing has the
                # time of that.
                until_ns = max(until_ns, self._gate.now_ns + 1)
        self._gate.let(until_ns)

    def _look(self) -> str:
        if self._gate.now_ns > self._source.end_ns or (
            self._going.over and not self._source.complete
        ):
            self._source.refresh()
        if self._going.over and self._interrupts.requested:
            self.exit()
        return self._going.standing

    def action_end_run(self) -> None:
        """End the run after the window in progress, then leave; the second time, leave at once."""
        self._interrupts.request()
        if self._interrupts.repeated:
            self.exit()
        self.moved("the run ends")


def watched(
    run: Callable[[Watcher], FinishedRun],
    display: ProgressDisplay,
    interrupts: Interrupts,
    *,
    speed: float,
) -> FinishedRun:
    """Run a mission on the screen; once that is left, behind a progress bar.

    Args:
        run: runs it under the eyes of a watcher.
        display: the progress bar.
        interrupts: those that end the run.
        speed: simulated seconds per wall second, to begin with.

    Raises:
        Exception: whatever `run` raised.
    """
    gate = Gate(display, interrupts)
    going = RunInThread(lambda: run(gate), gate)
    try:
        with patience("starting the run"):
            begun = going.begun(interrupts)
        if begun and gate.log is not None:
            WatchApp(LogFile(gate.log), going, gate, interrupts, speed=speed).show()
    except LogError as error:
        print_error(f"{error}; the run goes on")
    finally:
        gate.open()
    with display:
        return going.finish(interrupts)
