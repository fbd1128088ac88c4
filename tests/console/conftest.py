"""What the tests of the console start from."""

import pytest

from farside.logs import LogEntry, LogFile
from farside.missions import load_mission, run_mission


@pytest.fixture(scope="session")
def known(tmp_path_factory: pytest.TempPathFactory) -> list[LogEntry]:
    """All that the ground knew in the shipped blackout mission, entry by entry."""
    run = run_mission(load_mission("blackout"), in_process=True, out=tmp_path_factory.mktemp("run"))
    log = LogFile(run.log).as_ground()
    return [LogEntry.of(record) for record in log.records()]
