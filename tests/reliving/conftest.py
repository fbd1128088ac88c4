"""Short runs to be lived again, flown once each."""

from pathlib import Path

import pytest
from short_life import ORDERS, QUEUED, SHORT

from farside.missions import FinishedRun, TimedOrders, load_mission, run_mission


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="session")
def flown(runs: Path) -> FinishedRun:
    """The short run."""
    return run_mission(load_mission("blackout", SHORT), in_process=True, out=runs)


@pytest.fixture(scope="session")
def ordered(runs: Path) -> FinishedRun:
    """A run whose orders came from outside."""
    loaded = load_mission("blackout", QUEUED)
    return run_mission(loaded, in_process=True, out=runs, watcher=TimedOrders(ORDERS))
