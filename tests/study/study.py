"""`make study`: runs the studies and writes docs/study.md, its pictures and its results.

    python tests/study/study.py [--seeds N] [--only shadowed,working,...]
    python tests/study/study.py --render [FOLDER]

The page and the pictures are made from docs/study/results.json alone: with `--render` they are
made anew from there, and nothing is run.
"""

import argparse
import json
import os
from collections.abc import Callable, Iterable
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from delays import delay_cases, delayed, lesson_cases
from exploring import GRID, WAYS, explored
from page import written
from rich.progress import track
from shadow_price import MISSIONS, priced
from supervising import supervised, supervision_cases
from surprises import PARTS, surprised
from working import cases, shadowed, worked
from yards import arcs_of, mission_with, shadowed_map

DOCS = Path(__file__).parents[2] / "docs"
RESULTS = DOCS / "study/results.json"
FEW = 5
"""Seeds of the supervisor's runs, which are long."""

PARTS_OF_STUDY = "shadowed,working,exploring,delays,lessons,price,supervised,surprises"
POLICIES = ("signal", "track", "none", "hold")

Result = dict[str, Any]
Run = Callable[[], Result]


def done(run: Run) -> Result:
    """The result of one run; a name for worker processes to call."""
    return run()


def studies(seeds: Iterable[int]) -> dict[str, list[Run]]:
    """Every run of each study, the longest first."""
    seeds = list(seeds)
    return {
        "exploring": [partial(explored, way, seed) for way in WAYS[::-1] for seed in seeds],
        "working": [partial(worked, *case) for case in cases(seeds)],
        "shadowed": [partial(shadowed, policy, seed) for policy in POLICIES for seed in seeds],
        "delays": [partial(delayed, *case) for case in delay_cases(seeds)],
        "lessons": [partial(delayed, *case) for case in lesson_cases(seeds)],
        "price": [partial(priced, name, seed) for name in MISSIONS for seed in seeds],
        "supervised": [partial(supervised, *case) for case in supervision_cases(seeds[:FEW])],
        "surprises": [partial(surprised, part) for part in range(1, PARTS + 1)],
    }


def yard() -> Result:
    """What the yard of `blackout` has: counted, not believed."""
    chart = mission_with(0).world.chart()
    shadow = len(mission_with(0, world__map=shadowed_map()).world.chart().shadow)
    return {
        "places": len(chart.places),
        "arcs": len(arcs_of(chart)),
        "shadow": shadow,
        "grid": GRID,
    }


def run_all(seeds: int, only: Iterable[str]) -> None:
    """Run the studies on all cores, one after the other; the results of others stay."""
    results: Result = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results["seeds"], results["yard"] = seeds, yard()
    runs = studies(range(1, seeds + 1))
    RESULTS.parent.mkdir(exist_ok=True)
    with Pool(os.cpu_count()) as pool:
        for name in filter(None, only):
            each = pool.imap(done, runs[name])
            results[name] = list(track(each, name, total=len(runs[name])))
            RESULTS.write_text(compact(results))


def main() -> None:
    """Run, or render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--only", default=PARTS_OF_STUDY)
    parser.add_argument("--render", nargs="?", const=DOCS, type=Path)
    asked = parser.parse_args()
    if asked.render is None:
        run_all(asked.seeds, asked.only.split(","))
    folder = asked.render or DOCS
    written(json.loads(RESULTS.read_text()), folder)


def compact(results: Result) -> str:
    """JSON with a line for each run."""
    parts = []
    for key, value in results.items():
        text = json.dumps(value)
        if isinstance(value, list):
            text = "[\n" + ",\n".join(json.dumps(one) for one in value) + "\n]"
        parts.append(f"{json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    main()
