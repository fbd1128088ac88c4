"""`make bench`: what the console's page costs, and how soon a hand on a stick feels a cue.

The page is what `farside console` serves, with `blackout` in four processes behind it and its
script for a person; the browser is headless Chromium on the same machine. Speeds are medians of
runs that take turns, so that a machine whose speed drifts drifts for all of them.

At the stick of this host, SDL's own virtual pad is moved and tells when it is made to rumble; on
the page, a pad of the page's own Gamepad API. Everything between is what a person runs. The rover
is 20 minutes of light time away.
"""

import os
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

from browsing import chromium
from console_page import Visitor, visiting
from playwright.sync_api import Browser
from rich.console import Console
from rich.progress import track
from rich.table import Table
from virtual_stick import StationStub, VirtualStick, options, screen_of

from farside.console.page.serving import serving
from farside.console.screen.screen import Chart, Screen
from farside.console.session import Session
from farside.console.station import Station
from farside.console.stick.device import HostStick
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.interrupts import Interrupts
from farside.node import to_ns

MOVEMENTS = 200
LIMIT_MS = 50.0
ROUNDS = 7
PACE = 60.0
PACED_S = 19.0
FULL_SPEED = 1000.0


# --- a run, in a process of its own --------------------------------------------------------------


def run(pace: float) -> None:
    """Serve the page of a run that begins once standard input says so; say its speed at the end."""
    loaded = load_mission("blackout")
    session = Session("blackout", to_ns(loaded.mission.duration_s), speed=pace)
    session.pacing.slow = _not_slower  # type: ignore[method-assign]
    station = Station(session, end=lambda: None)
    with tempfile.TemporaryDirectory() as out, serving(station) as page:
        _tell(page.address)
        sys.stdin.readline()
        watcher = AtStation(station, Interrupts())
        _tell(run_mission(loaded, out=Path(out), watcher=watcher).result.speedup)


def _not_slower(why: str, *, above: float = 1.0) -> None:
    """Where a person would be asked to decide, time goes on as it did."""


def _tell(what: object) -> None:
    sys.stdout.write(f"{what}\n")
    sys.stdout.flush()


class Speeds(NamedTuple):
    """Simulated seconds per wall second, and frames that the page drew per wall second."""

    run: float
    page_hz: float


def speeds(pace: float, browser: Browser | None) -> Speeds:
    """Those of a run whose page this browser has open, or none."""
    command = [sys.executable, __file__, "run", str(pace)]
    with subprocess.Popen(  # noqa: S603
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        with nullcontext() if browser is None else visiting(browser, address) as visitor:
            process.stdin.write("begin\n")
            process.stdin.flush()
            page_hz = 0.0 if visitor is None else frames_hz(visitor, PACED_S if pace == PACE else 2)
            return Speeds(float(process.stdout.readline()), page_hz)


def frames_hz(visitor: Visitor, seconds: float) -> float:
    """Frames that the page draws in a wall second, once the run has begun."""
    visitor.page.wait_for_function(
        "() => document.querySelector('.farside-map circle')", timeout=60_000
    )
    frames, began_s = visitor.page.evaluate("() => farside.frames"), time.perf_counter()
    time.sleep(seconds)
    drawn = visitor.page.evaluate("() => farside.frames") - frames
    return float(drawn / (time.perf_counter() - began_s))


# --- the stick -----------------------------------------------------------------------------------


def stick_latency() -> list[float]:
    """Wall milliseconds from each movement of the stick to the call that makes it rumble."""
    station = StationStub(screen_of(options(E="problematic", W="invalid")))
    said: SimpleQueue[str] = SimpleQueue()
    chance = random.Random(1)  # noqa: S311 - no secret
    latencies_ms = []
    with VirtualStick() as pad, HostStick(station, None, say=said.put):
        said.get(timeout=10)
        for number in range(MOVEMENTS):
            time.sleep(chance.uniform(0.0, 0.02))  # anywhere between two polls
            moved_ns = time.perf_counter_ns()
            pad.push(0.6 if number % 2 else -0.6, 0.0)
            _, felt_ns = pad.wait(lambda level: level > 0)
            latencies_ms.append((felt_ns - moved_ns) / 1e6)
            pad.push(0.0, 0.0)
            pad.wait(lambda level: level == 0)
            while not pad.rumbles.empty():
                pad.rumbles.get()
    return latencies_ms


@contextmanager
def _busy() -> Iterator[None]:
    """A thread of this process that never pauses, as of a run in it that cannot keep its pace."""
    over = threading.Event()

    def reckon() -> None:
        while not over.is_set():
            sum(range(1000))

    working = threading.Thread(target=reckon)
    working.start()
    try:
        yield
    finally:
        over.set()
        working.join()


def page_latency(browser: Browser) -> list[float]:
    """Wall milliseconds from each movement of a page's pad to the call that makes it rumble."""
    with serving(FarAway()) as page, visiting(browser, page.address) as visitor:
        found: list[float] = visitor.page.evaluate(_PAD, MOVEMENTS)
    return found


class FarAway:
    """Shows a rover 20 minutes of light time away to a page."""

    version = 1
    chart = Chart(("#####", "#A.B#", "#####"), 1.0)

    is_hurried = False

    def screen(self) -> Screen:
        """See `farside.console.page.shown.Shown`."""
        return screen_of(options(E="problematic", W="invalid"))

    def do(self, _: Callable[[Session], str]) -> str:
        """Nothing is to be ordered."""
        return "not ordered"


_PAD = """async (movements) => {
    let level = null, felt = () => {};
    const rumbles = () => new Promise((told) => { felt = told; });
    const playEffect = (_, { strongMagnitude }) => { level = strongMagnitude; felt(); };
    const buttons = [...Array(17)].map(() => ({ pressed: false }));
    const pad = { connected: true, axes: [0, 0], buttons, vibrationActuator: { playEffect } };
    Object.defineProperty(navigator, "getGamepads", { value: () => [pad] });
    const latencies = [];
    for (let number = 0; number < movements; number++) {
        await new Promise((over) => setTimeout(over, 20 * Math.random()));  // between two polls
        const moved = performance.now();
        pad.axes = [number % 2 ? 0.6 : -0.6, 0];
        do await rumbles(); while (!level);
        latencies.push(performance.now() - moved);
        pad.axes = [0, 0];
        do await rumbles(); while (level);
    }
    return latencies;
}"""


# --- the tables ----------------------------------------------------------------------------------


def page_table(cores: set[int]) -> Table:
    """What the page costs a run; measured on these cores, paced on one of them alone."""
    with _pinned({max(cores)}), chromium() as browser:
        paced = {looks: speeds(PACE, browser if looks else None) for looks in (False, True)}
    full: dict[bool, list[Speeds]] = {False: [], True: []}
    with chromium() as browser:
        for _ in track(range(ROUNDS), "measuring"):
            for looks, found in full.items():
                found.append(speeds(FULL_SPEED, browser if looks else None))
    table = Table("page of blackout, four processes", "alone", "with the page", "line")
    alone, beside = paced[False], paced[True]
    table.add_row("60x, one core: x real time", f"{alone.run:.1f}", f"{beside.run:.1f}", "60")
    table.add_row("60x, one core: frames/s", "", f"{beside.page_hz:.1f}", "10")
    middle = {looks: statistics.median(one.run for one in found) for looks, found in full.items()}
    table.add_row(
        f"full speed, {len(cores)} cores: x real time",
        f"{middle[False]:.0f}",
        f"{middle[True]:.0f}",
    )
    ratios = [after.run / before.run for before, after in zip(*full.values(), strict=True)]
    lost = 100 * (1 - statistics.median(ratios))
    table.add_row("of its speed lost to the page", "", f"{lost:.0f} %", "10 %")
    return table


def stick_table() -> Table:
    """How soon a movement is felt."""
    table = Table("movement to rumble", "median", "p99", "worst", "line")
    _add_latencies(table, "stick", stick_latency())
    with _busy():
        _add_latencies(table, "stick, beside a busy thread", stick_latency())
    with chromium() as browser:
        _add_latencies(table, "pad on the page", page_latency(browser))
    return table


def _add_latencies(table: Table, name: str, latencies_ms: list[float]) -> None:
    p99_ms = statistics.quantiles(latencies_ms, n=100)[98]
    numbers = (statistics.median(latencies_ms), p99_ms, max(latencies_ms))
    table.add_row(name, *(f"{number:.1f} ms" for number in numbers), f"{LIMIT_MS:g} ms")


@contextmanager
def _pinned(cores: set[int]) -> Iterator[None]:
    """This process, and those that it starts, on these cores."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def main() -> None:
    """Print the tables."""
    console = Console()
    console.print(page_table(os.sched_getaffinity(0)))
    console.print(stick_table())


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        run(float(sys.argv[2]))
    else:
        main()
