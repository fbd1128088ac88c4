"""The pytest plugin: a `mission` fixture for tests that script blackouts.

def test_the_rover_goes_on_alone(mission):
    run = mission("blackout").with_seed(5).blackout(start_s=620, duration_s=300).run()
    assert run.mode_at(700) == "autonomous"
    assert run.reached("at:B")
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from farside.missions.testing.rehearsal import Rehearsal

# Asserts in there are to say what they found, as in a test's own module.
pytest.register_assert_rewrite("farside.missions.testing.contracts")


@pytest.fixture
def mission(tmp_path: Path) -> "Callable[[str | Path], Rehearsal]":
    """Rehearsals of missions in simulated time, with logs in the test's `tmp_path`.

    Call it with a path or the name of a shipped mission to get a `farside.missions.Rehearsal`.
    """
    # Every test session of every user who has Farside installed imports this module.
    from farside.missions.testing.rehearsal import Rehearsal  # noqa: PLC0415

    return lambda source: Rehearsal(source, tmp_path)
