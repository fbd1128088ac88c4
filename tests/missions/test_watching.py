"""A run on the screen: held by whoever watches it, and the same as any other."""

import asyncio
import math
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console
from seats import Seat, seated

from farside.logs import LogFile
from farside.logs.result import Outcome
from farside.missions import load_mission, run_mission
from farside.missions.commands.display.progress import ProgressDisplay
from farside.missions.commands.display.watching import (
    LONGEST_WINDOW_NS,
    Gate,
    RunInThread,
    WatchApp,
)
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import to_ns

LOADED = load_mission("blackout", ["duration_s=40", "expect=[]"])


class Watched:
    """A short run in a thread, held by a gate."""

    def __init__(self, out: Path) -> None:
        self.interrupts = Interrupts()
        self.gate = Gate(ProgressDisplay(LOADED.mission, Console(quiet=True)), self.interrupts)
        self.run = RunInThread(lambda: self._run(out), self.gate)
        assert self.run.begun(self.interrupts)

    def _run(self, out: Path) -> FinishedRun:
        return run_mission(
            LOADED,
            in_process=True,
            out=out,
            watcher=self.gate,
            window_ns=LONGEST_WINDOW_NS,
            interrupts=self.interrupts,
        )

    def app(self, now: Callable[[], float]) -> WatchApp:
        """Its screen, at ×10."""
        return WatchApp(
            LogFile(self.gate.log), self.run, self.gate, self.interrupts, speed=10.0, now=now
        )

    async def reach(self, seconds: float) -> None:
        """Wait until the run has come so far."""
        while self.gate.now_ns < to_ns(seconds) and not self.run.over:
            await asyncio.sleep(0.005)


@pytest.fixture
def watched(tmp_path: Path) -> Watched:
    return Watched(tmp_path)


def test_a_watched_run_waits_for_who_watches_it_and_is_the_same(
    watched: Watched, tmp_path: Path
) -> None:
    async def does(seat: Seat[WatchApp]) -> None:
        assert "leave, the run goes on" in seat.text
        await watched.reach(3)
        await seat.wait(0.4)
        assert 2 <= seat.now_s <= 4  # the last record of the three windows, or a little more
        assert "mode guided" in seat.text
        await seat.press("space")
        held_ns = watched.gate.now_ns
        await seat.press("left", "home")
        await seat.wait(100)
        assert (seat.now_s, watched.gate.now_ns <= held_ns + to_ns(1)) == (0, True)
        await seat.press("+", "space", "end")
        for _ in range(100):
            await seat.wait(1)
            await watched.reach(min(39.9, seat.now_s + 5))
            if watched.run.over and seat.app.player.at_end:
                break
        await seat.wait(1)
        assert "the run is over: success" in seat.text
        assert ("■ end" in seat.text, "end the run" in seat.text) == (True, False)

    seated(watched.app, does, (100, 30))
    finished = watched.run.finish(watched.interrupts)

    plain = run_mission(LOADED, in_process=True, out=tmp_path / "plain")
    assert finished.digest == plain.digest
    assert finished.result.outcome is Outcome.SUCCESS


@pytest.mark.parametrize("speed", [0.01, 1.0])
def test_however_slowly_it_is_played_a_run_goes_on_once_all_of_it_was_seen(
    watched: Watched, speed: float
) -> None:
    async def does(seat: Seat[WatchApp]) -> None:
        seat.app.player.set_speed(speed)
        for _ in range(2000):  # the run is a thread: it comes when it comes
            await seat.wait(1 / speed)
            await asyncio.sleep(0.005)
            if seat.now_s > 5:
                break
        assert 5 < seat.now_s < 12

    seated(watched.app, does)
    watched.gate.open()
    watched.run.finish(watched.interrupts)


def test_who_leaves_lets_the_run_go_on(watched: Watched) -> None:
    async def does(seat: Seat[WatchApp]) -> None:
        await seat.press("space", "q")
        assert not seat.app.is_running

    seated(watched.app, does)
    assert not watched.run.over
    watched.gate.open()

    assert watched.run.finish(watched.interrupts).duration_s == pytest.approx(40, abs=1)


def test_ctrl_c_ends_the_run_then_leaves(watched: Watched) -> None:
    async def does(seat: Seat[WatchApp]) -> None:
        await seat.press("space", "ctrl+c")
        while not watched.run.over:
            await asyncio.sleep(0.005)
        await seat.wait(1)
        assert not seat.app.is_running

    seated(watched.app, does)
    finished = watched.run.finish(watched.interrupts)

    assert (finished.interrupted, finished.result.outcome) == (True, Outcome.ABORTED)
    assert LogFile(finished.log).complete
    assert finished.result.sim_seconds < 40


def test_a_second_ctrl_c_does_not_wait_for_the_run(
    watched: Watched, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    goes_on = threading.Event()
    monkeypatch.setattr(watched.gate, "watch", lambda *_: goes_on.wait(30))  # as if a process hung
    watched.gate.let(math.inf)

    async def does(seat: Seat[WatchApp]) -> None:
        await seat.press("ctrl+c", "ctrl+c")
        assert not seat.app.is_running

    seated(watched.app, does)
    monkeypatch.setattr(os, "_exit", sys.exit)

    with pytest.raises(SystemExit, match="130"):
        watched.run.finish(watched.interrupts)
    assert f"farside recover {watched.gate.log}" in capsys.readouterr().err
    goes_on.set()


def test_a_second_ctrl_c_does_not_wait_for_a_run_that_does_not_begin(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    goes_on, interrupts = threading.Event(), Interrupts()

    def run() -> FinishedRun:
        goes_on.wait(30)  # as if a process did not start
        raise OSError("no space left")

    gate = Gate(ProgressDisplay(LOADED.mission, Console(quiet=True)), interrupts)
    going = RunInThread(run, gate)
    interrupts.request()
    interrupts.request()
    monkeypatch.setattr(os, "_exit", sys.exit)

    assert not going.begun(interrupts)
    with pytest.raises(SystemExit, match="130"):
        going.finish(interrupts)
    goes_on.set()
    assert "cut off before anything was recorded" in capsys.readouterr().err


def test_what_a_run_raises_comes_out_where_it_is_waited_for() -> None:
    def run() -> FinishedRun:
        raise OSError("no space left")

    gate = Gate(ProgressDisplay(LOADED.mission, Console(quiet=True)), Interrupts())
    going = RunInThread(run, gate)

    assert not going.begun(Interrupts())
    with pytest.raises(OSError, match="no space left"):
        going.finish(Interrupts())


def test_without_a_terminal_there_is_nothing_to_watch_on(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, _, err = farside("run", "blackout", "--watch")

    assert (status, "expected a terminal alone, found none" in err) == (2, True)
