"""What the tests of the console start from."""

from collections.abc import Iterator

import pytest
from browsing import chromium
from playwright.sync_api import Browser
from sitting import Sitting, sat

from farside.logs import LogEntry, LogFile
from farside.missions import load_mission, run_mission
from farside.missions.run import FinishedRun


@pytest.fixture(scope="session")
def known(tmp_path_factory: pytest.TempPathFactory) -> list[LogEntry]:
    """All that the ground knew in the shipped blackout mission, entry by entry."""
    run = run_mission(load_mission("blackout"), in_process=True, out=tmp_path_factory.mktemp("run"))
    log = LogFile(run.log).as_ground()
    return [LogEntry.of(record) for record in log.records()]


@pytest.fixture(scope="module")  # while it is there, no event loop can be run in this thread
def browser() -> Iterator[Browser]:
    """The browser of all tests of the page."""
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="session")
def afternoon(tmp_path_factory: pytest.TempPathFactory) -> tuple[FinishedRun, Sitting]:
    """A person who plays `blackout` by the screen alone."""
    return sat(tmp_path_factory.mktemp("sat"))
