"""On every topic of every log, what was known and what was so come in order."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from farside.logs import LogFile
from farside.missions import load_mission, run_mission

FLAPPING = [{"start_s": 10.0 + 12 * n, "end_s": 18.0 + 12 * n} for n in range(10)]


@pytest.mark.parametrize(
    ("mission", "changes"),
    [
        ("blackout", {"duration_s": 130.0, "link.blackouts": FLAPPING}),
        ("mars-relay", {"duration_s": 130.0}),
        ("tether", {"duration_s": 60.0}),
        ("teach", {"duration_s": 60.0}),
        ("shadow", {"duration_s": 60.0}),
    ],
)
def test_no_topic_goes_back_in_time(mission: str, changes: dict[str, Any], tmp_path: Path) -> None:
    """Neither in log time nor in publish time, which viewers sort by."""
    run = run_mission(load_mission(mission, changes), in_process=True, out=tmp_path)

    last: dict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for record in LogFile(run.log).records(pictures=True):
        log_ns, publish_ns = last[record.topic]
        assert record.log_time_ns >= log_ns, record
        assert record.publish_time_ns >= publish_ns, record
        last[record.topic] = record.log_time_ns, record.publish_time_ns
