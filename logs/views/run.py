"""One run, opened for reading: every query on it, and what its log says of itself."""

import shlex
from pathlib import Path

import msgspec

from farside.logs.file.parts import LogError
from farside.logs.file.reading import LogFile
from farside.logs.result import RunResult
from farside.logs.views.goals import GoalView
from farside.logs.views.ground import GroundView
from farside.logs.views.life import LifeView
from farside.logs.views.link import LinkView
from farside.node import NEVER_NS, to_ns, to_s
from farside.validation import one_line

_LINE_LENGTH = 400
_NEVER_S = to_s(NEVER_NS)


class RunView(GoalView, GroundView, LifeView, LinkView):
    """Queries on a run, answered from its log. All times are simulated seconds.

    A query reads what it is about through the log's index. Only the map, the goals and the counts
    of frames are kept once they were asked for: a run may be larger than memory.

    As ground (see `LogFile.as_ground`), a query that asks for what the ground does not know raises
    a `ValueError` that begins with `not known at the ground:`.

    Args:
        log: the log.
    """

    def __repr__(self) -> str:
        """What run it is and how it ended, or what was heard of it last; and where its log is."""
        said = self._log.metadata.get("farside.run", {})
        run = f"{said.get('mission', 'a run')}, seed {said.get('seed', 'unknown')}"
        try:
            told = self._heard() if self.is_as_ground else self._ended()
        except LogError as error:
            told = f": {error}"
        replay = f"farside replay {shlex.quote(str(self.path))}"
        return f"<{one_line(run + told, _LINE_LENGTH)}\n {one_line(replay, _LINE_LENGTH)}>"

    def _ended(self) -> str:
        result = self.result
        if result is None:
            return f": unfinished, {self.duration_s:.1f} s so far"
        told = f": {result.outcome} after {result.sim_seconds:.1f} s"
        met = [expected.met for expected in result.expectations]
        if met:
            told += f", {sum(met)} of {len(met)} expectations met"
        missed = [expected for expected in result.expectations if not expected.met]
        return told + "".join(f"; {missing.name}: {missing.detail}" for missing in missed)

    def _heard(self) -> str:
        believed = self.believed_at(self.duration_s)
        told = f", as the ground had it at {self.duration_s:.1f} s: "
        if believed.age_s is None:
            return told + "nothing heard yet"
        place, mode = believed.belief.place, believed.belief.mode
        where = place.value if place is not None and place.value is not None else "no place"
        told += f"heard {believed.age_s:.1f} s ago, {where}"
        return told if mode is None else f"{told}, {mode.value}"

    @property
    def path(self) -> Path:
        """Path of the log."""
        return self._log.path

    @property
    def mission_name(self) -> str:
        """Name of the mission.

        Raises:
            LogError: if the log does not say.
        """
        return self._said("mission")

    @property
    def seed(self) -> int:
        """The seed of the run.

        Raises:
            LogError: if the log does not say.
        """
        said = self._said("seed")
        try:
            return int(said)
        except ValueError as error:
            raise LogError(f"{self.path}: expected a whole number as seed: {error}") from error

    def _said(self, key: str) -> str:
        said = self._log.metadata.get("farside.run", {}).get(key)
        if said is None:
            raise LogError(f"{self.path}: expected {key} in the metadata farside.run, found none")
        return said

    @property
    def result(self) -> RunResult | None:
        """How the run ended; `None` if its log is not finished.

        Raises:
            LogError: if the log says it in a way that this version cannot read.
            ValueError: as ground.
        """
        self._check_over("how the run ended")
        attached = self._log.attachments.get("result.json")
        if attached is None:
            return None
        try:
            return msgspec.json.decode(attached.data, type=RunResult)
        except (msgspec.MsgspecError, ValueError) as error:
            raise LogError(
                f"{self.path}: expected a result.json of this version of Farside, found: {error}"
            ) from error

    @property
    def digest(self) -> str:
        """The digest of the log; see `farside.logs.Digest`. Of an unfinished log it is computed.

        Raises:
            LogError: if it is computed, and the log is damaged.
            ValueError: as ground.
        """
        self._check_over("the digest of the run")
        return self._log.metadata.get("farside.result", {}).get("digest") or self._log.digest()

    def _check_over(self, what: str) -> None:
        if self.is_as_ground:
            raise ValueError(f"not known at the ground: {what}")


def open(  # noqa: A001 - as `gzip.open` is: it is called by the name of its package
    path: Path | str, *, as_ground: bool = False, until_s: float | None = None
) -> RunView:
    """Open the log of a run, finished or not, to ask about it.

    Nothing is read but the log's index; every query reads what it is about. There is nothing to
    close.

    Args:
        path: the log.
        as_ground: whether to see only what the ground had learned; see `LogFile.as_ground`.
        until_s: by when, in simulated seconds; by the end of the run by default.

    Raises:
        LogError: if the log cannot be read.
        ValueError: if `until_s` is no time, or given for a log that is not opened as ground.
    """
    if until_s is not None and not as_ground:
        raise ValueError("expected until_s together with as_ground=True: it is the ground's time")
    if until_s is not None and not 0 <= until_s < _NEVER_S:
        beyond = "" if until_s < 0 else f" and less than {_NEVER_S:.3g} s"
        raise ValueError(f"expected a time of 0 s or more{beyond}, found {until_s} s")
    log = LogFile(Path(path))
    if as_ground:
        log = log.as_ground(None if until_s is None else to_ns(until_s))
    return RunView(log)
