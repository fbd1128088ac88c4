"""Random missions, links, outages and operators by the thousand: what surprised, and what happened.

`python tests/study/surprises.py RUNS SEED OUT.json` makes RUNS of them from SEED on.
"""

import json
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from hazards import Hazard, fly, hazards
from hypothesis import HealthCheck, Phase, given, seed, settings

from farside.missions.surprises import surprises
from farside.topics import (
    GROUND_PROPOSAL,
    ROVER_ACTION_STARTED,
    ROVER_FAILSAFE,
    ROVER_MODE,
)


def count(runs: int, first: int, log: Path) -> dict[str, Any]:
    """Make the runs; counts of what happened in them, and every surprise with its mission."""
    counts: Counter[str] = Counter()
    found: list[dict[str, Any]] = []

    @seed(first)
    @settings(
        max_examples=runs,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(hazard=hazards())
    def one(hazard: Hazard) -> None:
        run = fly(hazard, log)
        counts["runs"] += 1
        counts["simulated_s"] += round(run.result.sim_seconds)
        found.extend(
            {"what": surprise.what, "t_s": surprise.t_s, "hazard": repr(hazard)}
            for surprise in surprises(run)
        )
        counts.update(f"action {a.chooser}" for _, a in run.entries(ROVER_ACTION_STARTED))
        counts.update(f"command {entry.stage}" for _, entry in run.command_stages)
        counts.update(f"failsafe {entry.state}" for _, entry in run.entries(ROVER_FAILSAFE))
        counts.update(f"mode {mode.why}" for _, mode in run.entries(ROVER_MODE))
        counts["proposals"] += len(run.entries(GROUND_PROPOSAL))
        counts["outages"] += len(run.outages)
        run.log.unlink()

    one()
    return {"counts": dict(sorted(counts.items())), "surprises": found}


if __name__ == "__main__":
    number, start, out = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as folder:
        out.write_text(json.dumps(count(number, start, Path(folder)), indent=1) + "\n")
