"""Missions: the mission files, the crew and conductor that run them, and the command line."""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.logs.result import Outcome, RunResult
    from farside.missions.loading import MissionError, load_mission
    from farside.missions.orders.timed import TimedOrders
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
    "TimedOrders",
    "load_mission",
    "run_mission",
]

__getattr__ = lazily(
    __name__,
    {
        "FinishedRun": "run",
        "MissionError": "loading",
        "MissionFile": "schema",
        "Outcome": "results",
        "Rehearsal": "testing.rehearsal",
        "RunResult": "results",
        "TimedOrders": "orders.timed",
        "load_mission": "loading",
        "run_mission": "run",
    },
)
