"""Whether a run comes out the same when it is lived again: `farside verify`."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from farside.logs import Digest, LogFile
from farside.logs.diff.parting import Parting
from farside.logs.foxglove.pictures import Pictures
from farside.missions.extensions.kinds import Extensions, search_path, searching
from farside.missions.reliving.crew import advanced, revived
from farside.missions.reliving.past import Past, RelivingError, read_past
from farside.node import NS_PER_S, Record, to_s

if TYPE_CHECKING:
    from farside.ground.operators.operator import Operator
    from farside.rover.controller import Controller

_TOLD_NS = 10 * NS_PER_S


class OtherVersion(msgspec.Struct, frozen=True):
    """Something that is installed here in another version than a run was recorded with."""

    name: str
    then: str
    now: str


class Verdict(msgspec.Struct, frozen=True):
    """What came of living a run again.

    Attributes:
        log: the log.
        equal: whether every record came out as it is in the log, and the digest as it says.
        records: how many records were equal, pictures included.
        sim_seconds: how far it was lived again, in simulated time.
        whole: whether that is all of the run; false for a log that nobody finished.
        digest: of the run lived again, as far as it went.
        recorded: the digest that the log states; `None` if nobody finished it.
        parting: the first record that differs; `None` if none does.
        other_versions: what is installed here in another version than the run was recorded with.
        damage: what is missing of the log, a sentence each.
    """

    log: str
    equal: bool
    records: int
    sim_seconds: float
    whole: bool
    digest: str
    recorded: str | None
    parting: Parting | None
    other_versions: tuple[OtherVersion, ...]
    damage: tuple[str, ...]


class _Comparison:
    """Compares the records of a run with those of a log.

    Args:
        expected: the records of the log.
        whole: whether that is all of the run.

    Attributes:
        digest: of the records that were equal.
        parting: the first difference.
        count: how many records were equal.
    """

    def __init__(self, expected: Iterator[Record], *, whole: bool) -> None:
        self._expected, self._whole = expected, whole
        self._next = next(expected, None)
        self.digest = Digest()
        self.parting: Parting | None = None
        self.count = 0

    @property
    def over(self) -> bool:
        """Whether all is said: they have parted, or an unfinished log has no more."""
        return self.parting is not None or (self._next is None and not self._whole)

    def add(self, records: Sequence[Record]) -> None:
        """Compare the next records of the run."""
        self.digest.add(self._equal(records))

    def _equal(self, records: Iterable[Record]) -> Iterator[Record]:
        for record in records:
            if self.over:
                return
            if record != self._next:
                self.parting = Parting.of(self._next, record)
                return
            yield record
            self.count += 1
            self._next = next(self._expected, None)

    def end(self) -> None:
        """The run has no more records."""
        if self.parting is None and self._next is not None:
            self.parting = Parting.of(self._next, None)


def verify(
    log: LogFile | Path | str,
    progress: Callable[[float], None] | None = None,
    *,
    controller: "type[Controller] | None" = None,
    operator: "type[Operator] | None" = None,
) -> Verdict:
    """Live a run again, and compare each record with the log's; stops at the first that differs.

    Of a log that nobody finished, what it holds is compared. Nothing is written.

    Args:
        log: the log, open or by its path.
        progress: told of how far it has come, in simulated seconds.
        controller: the class of the run's own controller, where its name does not lead to it.
        operator: likewise.

    Raises:
        LogError: if the log cannot be read.
        RelivingError: if the run cannot be lived again, such as after the loss of a process.
    """
    past = read_past(log)
    if (why := past.not_whole()) is not None:
        raise RelivingError(f"{past.log.path}: the run cannot be lived again to its end: {why}")
    extensions = Extensions(controller, operator, search_path(Path.cwd()))
    return compared(past, past.end_ns, extensions, progress)


def compared(
    past: Past,
    until_ns: int,
    extensions: Extensions,
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """`verify`, up to, not including, a moment; the digest counts if that is the end of the run.

    Raises:
        RelivingError: if the run cannot be lived again.
    """
    recorded = None
    if until_ns >= past.end_ns:
        recorded = past.log.metadata.get("farside.result", {}).get("digest")
    records = past.log.records(end_ns=until_ns - 1, pictures=True)
    comparison = _Comparison(records, whole=recorded is not None or until_ns < past.end_ns)
    pictures = Pictures()
    with searching(extensions.path):
        crew = revived(past, extensions)
        while crew.now_ns < until_ns and not comparison.over:
            lived = advanced(crew, past, min(crew.now_ns + _TOLD_NS, until_ns))
            # In the order in which a run is recorded, with the pictures beside.
            lived.sort(key=attrgetter("log_time_ns"))
            comparison.add(pictures.beside(lived))
            if progress is not None:
                progress(to_s(crew.now_ns))
    if crew.now_ns >= until_ns:
        comparison.end()
    return Verdict(
        log=str(past.log.path),
        equal=comparison.parting is None and recorded in {None, comparison.digest.hex},
        records=comparison.count,
        sim_seconds=to_s(crew.now_ns),
        whole=recorded is not None,
        digest=comparison.digest.hex,
        recorded=recorded,
        parting=comparison.parting,
        other_versions=tuple(OtherVersion(*other) for other in past.other_versions()),
        damage=past.log.damage,
    )
