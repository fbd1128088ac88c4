"""Missions, links, outages and operators at random: what surprised, and what happened."""

import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from hazards import Hazard, fly, hazards
from hypothesis import HealthCheck, Phase, given, seed, settings

from farside.missions.surprises import surprises
from farside.topics import (
    ROVER_ACTION_STARTED,
    ROVER_FAILSAFE,
    ROVER_MODE,
    ROVER_PROPOSAL,
)

RUNS = 250
"""Runs of one part of the study."""

PARTS = 4


def surprised(part: int, runs: int = RUNS) -> dict[str, Any]:
    """Make the runs of a part: counts of what happened in them, and every surprise."""
    counts: Counter[str] = Counter()
    found: list[dict[str, Any]] = []

    @seed(part)
    @settings(
        max_examples=runs,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(hazard=hazards())
    def one(hazard: Hazard) -> None:
        with tempfile.TemporaryDirectory() as folder:
            run = fly(hazard, Path(folder))
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
            counts["proposals"] += len(run.entries(ROVER_PROPOSAL))
            counts["outages"] += len(run.outages)

    one()
    return {"seed": part, "counts": dict(sorted(counts.items())), "found": found}
