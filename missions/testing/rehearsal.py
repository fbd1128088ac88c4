"""Rehearsals: missions run in simulated time from a test, with blackouts written in the test."""

from collections.abc import Mapping
from pathlib import Path
from typing import Self

from farside.missions.loading import load_mission
from farside.missions.run import FinishedRun, run_mission

_BLACKOUTS = "link.blackouts"


class Rehearsal:
    """A mission to run with changes, in this process and as fast as it goes.

    Every change gives a new rehearsal and leaves the old one as it was:
    `mission("blackout").with_seed(5).blackout(60, 300).run()`.

    Args:
        source: a mission file, or the name of a shipped mission.
        out: folder for logs.
        changes: values in place of the mission file's, by dotted key.
    """

    def __init__(
        self, source: str | Path, out: Path, changes: Mapping[str, object] | None = None
    ) -> None:
        self._source = source
        self._out = out
        self._changes = dict(changes or {})

    def set(self, key: str, value: object) -> Self:
        """Replace one value of the mission file, such as `link.up.loss`."""
        return type(self)(self._source, self._out, {**self._changes, key: value})

    def with_seed(self, seed: int) -> Self:
        """Replace the seed."""
        return self.set("seed", seed)

    def without_blackouts(self) -> Self:
        """Take all blackouts out."""
        return self.set(_BLACKOUTS, [])

    def blackout(self, start_s: float, duration_s: float, direction: str = "both") -> Self:
        """Add a blackout. The first one takes the place of the mission's own blackouts.

        Args:
            start_s: when it begins, in simulated seconds.
            duration_s: how long it lasts.
            direction: `up`, `down` or `both`.
        """
        scripted = self._changes.get(_BLACKOUTS, [])
        assert isinstance(scripted, list)  # noqa: S101 - only set here
        blackout = {"start_s": start_s, "end_s": start_s + duration_s, "direction": direction}
        return self.set(_BLACKOUTS, [*scripted, blackout])

    def run(self) -> FinishedRun:
        """Run it.

        Raises:
            MissionError: if the mission, with the changes, is not a good one.
            KeyboardInterrupt: if somebody stopped it.
        """
        loaded = load_mission(self._source, self._changes)
        run = run_mission(loaded, in_process=True, out=self._out)
        if run.interrupted:
            raise KeyboardInterrupt
        return run
