"""Missions that several scenarios are told of fly once."""

from collections.abc import Callable
from pathlib import Path

import pytest

from farside.missions import FinishedRun, Rehearsal, load_mission

_FLOWN: dict[str, FinishedRun] = {}


class Remembered(Rehearsal):
    """A rehearsal of which the same mission with the same values flies once in a test session.

    Its run is only read. What asks whether two runs are the same stands elsewhere, and uses the
    plugin's own fixture.
    """

    def run(self) -> FinishedRun:
        """See `Rehearsal.run`."""
        values = dict(self._assignments)
        if any(isinstance(value, type) for value in values.values()):
            return super().run()  # a class of a test's own may be another one the next time
        key = repr((load_mission(self._source, values).mission, self._orders))
        if key not in _FLOWN:
            _FLOWN[key] = super().run()
        return _FLOWN[key]


@pytest.fixture
def mission(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str | Path], Rehearsal]:
    """As the plugin's fixture, with runs that are remembered."""
    logs = tmp_path_factory.getbasetemp() / "flown"
    return lambda source: Remembered(source, logs)
