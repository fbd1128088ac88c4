"""Missions: the mission files, the crew and conductor that run them, and the command line.

The names below are imported on first use: neither the process of one role nor a test session that
has Farside installed should pay for importing all of it.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from farside.missions.loading import MissionError, load_mission
    from farside.missions.result import Outcome, RunResult
    from farside.missions.run import FinishedRun, run_mission
    from farside.missions.schema import MissionFile
    from farside.missions.testing.rehearsal import Rehearsal

__all__ = [
    "FinishedRun",
    "MissionError",
    "MissionFile",
    "Outcome",
    "Rehearsal",
    "RunResult",
    "load_mission",
    "run_mission",
]

_MODULES = {
    "FinishedRun": "run",
    "MissionError": "loading",
    "MissionFile": "schema",
    "Outcome": "result",
    "Rehearsal": "testing.rehearsal",
    "RunResult": "result",
    "load_mission": "loading",
    "run_mission": "run",
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
