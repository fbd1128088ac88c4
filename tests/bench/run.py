"""`make bench`: how fast the first mission runs, beside two reference loops of the same minute.

Every figure is the median of several runs, taken in turn, so that a machine whose speed drifts
drifts for all of them. The limits are those of the issue tracker; nothing here fails.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue

import pymunk
import zenoh
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.missions import load_mission, run_mission
from farside.rover.config import BodyConfig
from farside.rover.world.terrain import obstacles

ROUNDS = 7
ROUND_TRIPS = 2000
STEPS = 30_000


def bare_pymunk() -> float:
    """Simulated seconds per wall second of the mission's world, stepped with nothing around it."""
    mission = load_mission("blackout").mission
    space, body = pymunk.Space(), pymunk.Body(40.0, 1.8)
    body.position = (5.5, 3.5)
    space.add(
        body,
        pymunk.Circle(body, 0.3),
        *obstacles(space, mission.world.chart(), BodyConfig().friction),
    )
    began = time.perf_counter()
    for _ in range(STEPS):
        space.step(mission.tick_s)
    return STEPS * mission.tick_s / (time.perf_counter() - began)


def bare_zenoh() -> float:
    """Round trips per second of a small message between two Python processes."""
    session = zenoh.open(_config('{listen: {endpoints: ["tcp/127.0.0.1:0"]}, mode: "router"}'))
    locator = _locator(session)
    answers: SimpleQueue[bytes] = SimpleQueue()
    subscriber = session.declare_subscriber("back", lambda _: answers.put(b""))
    echo = subprocess.Popen([sys.executable, __file__, "echo", locator], stdin=subprocess.PIPE)  # noqa: S603
    answers.get(timeout=20)
    began = time.perf_counter()
    for _ in range(ROUND_TRIPS):
        session.put("forth", b"x" * 200, express=True)
        answers.get(timeout=5)
    wall_s = time.perf_counter() - began
    echo.communicate()
    subscriber.undeclare()
    session.close()
    return ROUND_TRIPS / wall_s


def echo(locator: str) -> None:
    """The other process of `bare_zenoh`: sends back whatever comes, until standard input ends."""
    session = zenoh.open(_config(f'{{connect: {{endpoints: ["{locator}"]}}, mode: "client"}}'))
    subscriber = session.declare_subscriber(
        "forth", lambda sample: session.put("back", sample.payload, express=True)
    )
    session.put("back", b"ready", express=True)
    sys.stdin.read()
    subscriber.undeclare()
    session.close()


def _config(json5: str) -> zenoh.Config:
    config = zenoh.Config.from_json5(json5)
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("adminspace/enabled", "true")
    return config


def _locator(session: zenoh.Session) -> str:
    for reply in session.get(f"@/{session.info.zid()}/router"):
        text = reply.ok.payload.to_string()
        return text[text.index("tcp/") :].split('"')[0]
    raise RuntimeError("the Zenoh router does not tell where it listens")


def mission_speed(*, in_process: bool) -> float:
    """Simulated seconds per wall second of `blackout`, with its log, from first window to last."""
    with tempfile.TemporaryDirectory() as out:
        run = run_mission(load_mission("blackout"), in_process=in_process, out=Path(out))
    return run.result.speedup


def shadow_share() -> float:
    """Share of the processor's time of `blackout` in one process that its shadow takes, in %.

    A run with it and one without, one after the other.
    """
    taken = []
    for shadow in (True, False):
        with tempfile.TemporaryDirectory() as out:
            began = time.process_time()
            run_mission(
                load_mission("blackout", {"rover.shadow": shadow}), in_process=True, out=Path(out)
            )
            taken.append(time.process_time() - began)
    return 100 * (1 - taken[1] / taken[0])


def main() -> None:
    """Measure, and print the table."""
    measures: dict[str, Callable[[], float]] = {
        "bare pymunk, same world (x real time)": bare_pymunk,
        "bare Zenoh, two processes (round trips/s)": bare_zenoh,
        "blackout, one process (x real time)": lambda: mission_speed(in_process=True),
        "blackout, four processes (x real time)": lambda: mission_speed(in_process=False),
        "shadow, share of a run in one process (%)": shadow_share,
    }
    figures: dict[str, list[float]] = {name: [] for name in measures}
    console = Console()
    for _ in track(range(ROUNDS), "measuring", console=console):
        for name, measure in measures.items():
            figures[name].append(measure())
    medians = [statistics.median(runs) for runs in figures.values()]
    pymunk_x, zenoh_hz, single_x, four_x, _ = medians
    table = Table("what", "median", "least", "most", "at least", "beside the reference")
    notes = {
        "blackout, one process (x real time)": (
            "1000",
            f"{single_x / pymunk_x:.3f} of bare pymunk",
        ),
        "blackout, four processes (x real time)": (
            "400",
            f"{zenoh_hz / (four_x / 1.28):.1f} bare round trips a window",
        ),
    }
    for name, runs in figures.items():
        limit, beside = notes.get(name, ("", ""))
        numbers = (f"{value:,.0f}" for value in (statistics.median(runs), min(runs), max(runs)))
        table.add_row(name, *numbers, limit, beside)
    console.print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["echo"]:
        echo(sys.argv[2])
    else:
        main()
