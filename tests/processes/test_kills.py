"""Whatever was recorded up to the last window survives `kill -9`, for any MCAP reader."""

import random
from hashlib import sha256
from pathlib import Path

import pytest
from killing import common_end_ns, hashes_by_npm, killed_log, read_by_mcap, records_of

from farside.logs import LogFile
from farside.missions import FinishedRun
from farside.node import Record

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def whole(blackout: FinishedRun) -> list[Record]:
    """All records of the same run when nobody kills it."""
    return records_of(blackout.log)


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Logs of runs of which a process was killed at a random moment."""
    chance = random.Random(14)  # noqa: S311
    out = tmp_path_factory.mktemp("killed")
    return [
        killed_log(out / str(number), chance, in_process=in_process)[0]
        for number, in_process in enumerate((True, True, False))
    ]


def test_a_killed_run_leaves_the_beginning_of_the_whole_one(
    killed: list[Path], whole: list[Record]
) -> None:
    for path in killed:
        log = LogFile(path)
        end_ns = common_end_ns(log)
        found = [record for record in records_of(path) if record.log_time_ns < end_ns]

        assert found
        assert found == whole[: len(found)]
        assert log.attachments["mission.toml"].data


def test_other_readers_take_a_killed_log_as_it_is(killed: list[Path]) -> None:
    """Cut by a write in progress, its last window may be missing; ours reads no less."""
    whole = [path for path in killed if not LogFile(path).damage]
    assert whole
    hashes = hashes_by_npm(*whole)
    for path, read in zip(whole, hashes, strict=True):
        found = sha256()
        for record in records_of(path):
            size = len(record.payload)
            found.update(f"{record.topic} {record.log_time_ns} {size} ".encode() + record.payload)
        assert read == found.hexdigest()
        assert read_by_mcap(path) == records_of(path)
