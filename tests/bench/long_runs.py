"""Memory and speed of long runs: an hour on a Mars link, and a day (or DAYS) of the same.

    python tests/bench/long_runs.py [DAYS]

Each run is a process of its own, whose peak memory the system counts. Nobody keeps a whole run, so
both should grow with simulated time as little as possible.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import track
from rich.table import Table

HOUR_S = 3600
DAY_S = 24 * HOUR_S


class Measured(NamedTuple):
    """A run: simulated seconds, wall seconds of the whole command, peak memory, size of the log."""

    sim_s: float
    wall_s: float
    peak_mib: float
    log_mib: float


def measured(duration_s: float) -> Measured:
    """Run `blackout` in one process over the direct link to Mars, without its blackout."""
    settings = {"duration_s": duration_s, "link": '{preset="mars-direct"}', "expect": "[]"}
    options = [f"--set={key}={value}" for key, value in settings.items()]
    with tempfile.TemporaryDirectory() as out:
        command = ["run", "blackout", "--in-process", "--json", "--out", out, *options]
        began_s = time.perf_counter()
        done = subprocess.run(  # noqa: S603 - our own command
            [sys.executable, "-m", "farside", *command], check=True, capture_output=True
        )
        wall_s = time.perf_counter() - began_s
        log_byte = Path(json.loads(done.stdout)["log"]).stat().st_size
    peak_kib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return Measured(duration_s, wall_s, peak_kib / 1024, log_byte / 2**20)


def main() -> None:
    """Print both runs and their ratios."""
    days = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    console = Console()
    spans_s = (HOUR_S, days * DAY_S)
    hour, long = (measured(span_s) for span_s in track(spans_s, "Running", console=console))
    table = Table("simulated", "wall s", "x real time", "peak MiB", "log MiB")
    for name, run in (("1 h", hour), (f"{days:g} d", long)):
        table.add_row(
            name,
            f"{run.wall_s:.1f}",
            f"{run.sim_s / run.wall_s:.0f}",
            f"{run.peak_mib:.0f}",
            f"{run.log_mib:.1f}",
        )
    slower = (long.wall_s / long.sim_s) / (hour.wall_s / hour.sim_s)
    table.add_row("ratio", f"{slower:.2f} a second", "", f"{long.peak_mib / hour.peak_mib:.2f}", "")
    console.print(table)


if __name__ == "__main__":
    main()
