"""A run with a person at its ground station: what `farside console` does."""

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import Protocol

from farside.acts import Act
from farside.console.seats import Seats
from farside.console.station import Station
from farside.escaping import printable
from farside.ground.view.view import Focus, GroundView
from farside.missions.commands.display.patience import patience
from farside.missions.commands.display.watching import RunInThread
from farside.missions.conductor import Watcher
from farside.missions.crew.crew import InfrastructureError
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import Record, Role, to_ns

_LOOK_S = 0.1


class RunMission(Protocol):
    """Runs the mission under the eyes of a watcher."""

    def __call__(self, *, watcher: Watcher) -> FinishedRun:
        """The run, once it is over."""
        ...


class AtStation(Watcher):
    """Brings a run to a station, which paces it, orders, and holds it.

    Args:
        station: the station.
        interrupts: a run that is to end is not held.

    Attributes:
        log: the log that is written; `None` until something is.
        said: what the run waits for, in words.
    """

    def __init__(self, station: Station, interrupts: Interrupts) -> None:
        self.log: Path | None = None
        self.said = ""
        self._path: Path | None = None
        self._station, self._interrupts = station, interrupts

    def opened(self, log: Path) -> None:
        """See `Watcher.opened`."""
        self._path = log

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:
        """See `Watcher.seeing`."""
        self._station.seeing(look)

    def window_ns(self, now_ns: int) -> int:
        """See `Watcher.window_ns`."""
        return self._station.window_ns(now_ns)

    def orders(self, now_s: float) -> Sequence[Act]:  # noqa: ARG002 - what was ordered is for now
        """See `Watcher.orders`."""
        return self._station.orders()

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`. Returns when the person lets the run go on."""
        self.log, self.said = self._path, ""
        self._station.watch(to_ns(now_s), records, ending=lambda: self._interrupts.requested)

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `Watcher.wait`."""
        self.said = f"waiting for {', '.join(roles)}, {waited_s:.0f} s"
        self._station.wait(self.said)


def _run(run: RunMission, station: Station, watcher: Watcher) -> FinishedRun:
    try:
        finished = run(watcher=watcher)
    except BaseException as error:
        station.finish(f"The run failed: {error}")
        raise
    result = finished.result
    missed = [judgement.name for judgement in result.expectations if not judgement.met]
    text = f"The run is over: {result.outcome}."
    for lost in finished.lost_processes:
        text += f" Lost: {lost}."
    if missed:
        text += f" Not met: {', '.join(missed)}."
    station.finish(f"{text} Its log is {result.log}.")
    return finished


def text_run(
    run: RunMission, station: Station, interrupts: Interrupts, *, stick: bool
) -> FinishedRun:
    """Run a mission with the person at this terminal, until both are done.

    Args:
        run: runs the mission.
        station: what the terminal shows.
        interrupts: those that end the run.
        stick: whether a stick of this host takes part.

    Raises:
        Exception: whatever `run` raised.
    """
    from farside.console.text.app import ConsoleApp

    watcher = AtStation(station, interrupts)
    going = RunInThread(lambda: _run(run, station, watcher), watcher)
    try:
        with patience("starting the run"):
            begun = going.begun(interrupts)
        if begun:
            app = ConsoleApp(station)
            with _stick(station, None, app.tell, wanted=stick):
                app.show()
    finally:
        station.leave()
    return going.finish(interrupts)


def page_run(
    run: RunMission,
    station: Station,
    interrupts: Interrupts,
    *,
    host: str,
    port: int,
    stick: bool,
    over: Callable[[FinishedRun], None],
) -> FinishedRun:
    """Run a mission with the person at a page, which stays until Ctrl-C.

    Args:
        run: runs the mission.
        station: what the page shows.
        interrupts: those that end the run, and then the page.
        host: the address where the page listens.
        port: its port; 0 for any that is free.
        stick: whether a stick of this host takes part.
        over: called when the run is over, while the page is still there.

    Raises:
        InfrastructureError: if the page cannot be served there.
        Exception: whatever `run` raised.
    """
    from farside.console.page.serving import PageError, serving

    with ExitStack() as stack:
        try:
            page = stack.enter_context(serving(station, host=host, port=port))
        except PageError as error:
            raise InfrastructureError(f"{error}: choose another with --listen or --port") from error
        for line in page.lines:
            _say(line)
        stack.enter_context(_stick(station, page.seats, _say, wanted=stick))
        finished = _run(run, station, AtStation(station, interrupts))
        over(finished)
        if not interrupts.requested:
            _say("The page stays until Ctrl-C.")
        while not interrupts.requested:  # a signal is heard in this thread, and ends no sleep
            time.sleep(_LOOK_S)
    return finished


def _stick(
    station: Station, seats: Seats | None, say: Callable[[str], None], *, wanted: bool
) -> AbstractContextManager[object]:
    """The stick of this host, while the context lasts; nothing where none is wanted."""
    if not wanted:
        return nullcontext()
    from farside.console.stick.device import HostStick

    return HostStick(station, seats, say=say)


def _say(line: str) -> None:
    print(printable(line), file=sys.stderr, flush=True)  # noqa: T201
