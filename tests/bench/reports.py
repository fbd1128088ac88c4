"""`farside report` of a day: wall time of the whole command, and the size of the page.

    python tests/bench/reports.py [HOURS]

It is to take less than 20 s, and the page less than 6 MB. The runs are `mars-relay` with all its
passes, and `blackout` without an end to the operator's tour, so that a command crosses the link
every few seconds.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

TOUR = '{do = "tour", places = ["A", "7,7", "B", "12,1", "8,2", "C", "D"]}'
MISSIONS = {"mars-relay": [], "blackout": [f"ground.script=[{', '.join([TOUR] * 150)}]"]}


def farside(*arguments: str) -> bytes:
    """What a command prints."""
    command = [sys.executable, "-m", "farside", *arguments]
    return subprocess.run(command, check=True, capture_output=True).stdout  # noqa: S603


def main() -> None:
    """Print a row for each mission."""
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 24.0
    table = Table("mission", "simulated h", "log MB", "page MB", "report s")
    for mission, values in MISSIONS.items():
        settings = [f"duration_s={hours * 3600}", "expect=[]", *values]
        options = [f"--set={setting}" for setting in settings]
        with tempfile.TemporaryDirectory() as out:
            told = farside("run", mission, "--in-process", "--json", "--out", out, *options)
            log, page = Path(json.loads(told)["log"]), Path(out) / "page.html"
            began_s = time.perf_counter()
            farside("report", str(log), "--out", str(page))
            took_s = time.perf_counter() - began_s
            sizes = [f"{path.stat().st_size / 1e6:.1f}" for path in (log, page)]
        table.add_row(mission, f"{hours:g}", *sizes, f"{took_s:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
