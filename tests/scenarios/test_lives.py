"""What the ground says of its commands is so, whatever the link and the operator do."""

from pathlib import Path

import pytest
from hazards import Hazard
from hypothesis import HealthCheck, given, settings
from lives import Habits, Judge, fly_planned, planned_hazards


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lives")


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(planned=planned_hazards())
def test_every_verdict_is_true_and_every_promise_is_kept(
    logs: Path, planned: tuple[Hazard, Habits]
) -> None:
    """In the log of the whole run: see `lives.Judge` for what each verdict and promise means."""
    run = fly_planned(planned, logs)
    try:
        assert Judge(run).wrong == []
    finally:
        run.log.unlink()
