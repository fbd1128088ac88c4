"""Running a mission: crew, log, expectations and result."""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from farside.logs import LogError, LogFile, Recorder
from farside.logs.result import RunResult
from farside.logs.views.run import RunView
from farside.missions.build import build_node
from farside.missions.conductor import Conductor, Watcher
from farside.missions.crew.crew import (
    Crew,
    CrewError,
    InfrastructureError,
    InProcessCrew,
    LostProcess,
    Patience,
)
from farside.missions.crew.processes import ProcessCrew
from farside.missions.extensions.kinds import searching
from farside.missions.interrupts import Interrupts
from farside.missions.loading import LoadedMission
from farside.missions.results import conclude, describe
from farside.node import Node, Record, Role

RUNS = Path("logs/runs")
"""Default folder for logs, relative to the current folder."""

_PATIENT = Patience()


class _Unwatched(Watcher):
    """A `Watcher` that does nothing."""

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`."""

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `Watcher.wait`."""


class FinishedRun(RunView):
    """A run that is over: its result, and the queries of a `RunView`.

    Attributes:
        lost_processes: processes that ended before the run, in order of loss.
        interrupted: whether the run was stopped, as by Ctrl-C.
    """

    def __init__(
        self,
        log: LogFile,
        result: RunResult,
        lost_processes: tuple[LostProcess, ...],
        *,
        interrupted: bool,
    ) -> None:
        super().__init__(log)
        self._result = result
        self.lost_processes = lost_processes
        self.interrupted = interrupted

    @property
    def result(self) -> RunResult:
        """The result, as the log has it too."""
        return self._result

    @property
    def log(self) -> Path:
        """Path of the log."""
        return Path(self.result.log)

    @property
    def digest(self) -> str:
        """The digest of the log; see `farside.logs.Digest`."""
        return self.result.digest


def run_mission(
    loaded: LoadedMission,
    *,
    in_process: bool = False,
    pace: float = math.inf,
    out: Path = RUNS,
    watcher: Watcher | None = None,
    window_ns: int | None = None,
    patience: Patience = _PATIENT,
    interrupts: Interrupts | None = None,
    crew: Crew | None = None,
) -> FinishedRun:
    """Run a mission and write its log.

    Args:
        loaded: the mission.
        in_process: run all nodes in this process, not in a process each over Zenoh.
        pace: most simulated seconds per wall second.
        out: folder for the log, created if missing.
        watcher: observes the run in progress.
        window_ns: longest window, if shorter than the link allows.
        patience: how long to wait for a process that does not answer; see `ProcessCrew`.
        interrupts: those of a caller that is not to be interrupted after the run either.
        crew: rover, link and ground at time 0, in place of those that are made for the run. A
            mission that changes needs one that changes with it.

    Ctrl-C or SIGTERM ends the run after the window in progress, a second one at once. The log is
    whole either way.

    Raises:
        KeyboardInterrupt: if it came before the first window; no log is written then.
        InfrastructureError: if the processes or their network cannot be started, as a `CrewError`
            where one process is the cause; no log is written then. If the log is damaged, deleted
            or not accepted by the disk during the run; it holds what was recorded before.
        LogError: if the log cannot be created.
        ValueError: if the mission was loaded with a class, and is not to be run in this process; or
            if the watcher gives orders, and the mission's operator is not `queued`.
    """
    mission = loaded.last
    watcher = watcher or _Unwatched()
    if loaded.changes and crew is None:
        raise ValueError("expected a crew for a mission that changes during the run, found none")
    if loaded.extensions.local and not in_process and crew is None:
        raise ValueError(
            "expected a run in this process, as its controller or operator was given as a class; "
            "in processes, name it in the mission as module:Class"
        )
    with ExitStack() as stack:
        # Also for what code of one's own imports later on.
        stack.enter_context(searching(loaded.extensions.path))
        interrupts = interrupts or stack.enter_context(Interrupts())
        with interrupts.breakable(at=1):
            crew = stack.enter_context(
                crew or _crew(loaded, patience, watcher, in_process=in_process)
            )
        recorder = Recorder.in_folder(out, f"{mission.name}-seed{mission.seed}")
        stack.enter_context(_log_failures())
        stack.enter_context(recorder)
        describe(recorder, loaded)
        watcher.opened(recorder.path)
        conductor = Conductor(
            mission,
            crew,
            recorder,
            watcher,
            interrupts,
            pace=pace,
            window_ns=window_ns,
        )
        started_s = time.monotonic()
        end = _conduct(conductor, crew, interrupts)
        wall_s = time.monotonic() - started_s
        result = conclude(recorder, mission, conductor.now_ns, wall_s, end.lost_processes)
        # Packing may be interrupted: the log then stays as it was written, which is as good.
        with suppress(KeyboardInterrupt), interrupts.breakable(at=2):
            recorder.close()
    return FinishedRun(
        LogFile(recorder.path), result, end.lost_processes, interrupted=end.interrupted
    )


def _crew(loaded: LoadedMission, patience: Patience, watcher: Watcher, *, in_process: bool) -> Crew:
    if in_process:
        return InProcessCrew(*(_node(role, loaded) for role in Role))
    return ProcessCrew(loaded.mission, patience, watcher.wait, path=loaded.extensions.path)


def _node(role: Role, loaded: LoadedMission) -> Node:
    try:
        return build_node(role, loaded.mission, loaded.extensions)
    except Exception as error:
        raise CrewError(LostProcess.of_node(role, 0, error)) from error


@contextmanager
def _log_failures() -> Iterator[None]:
    """A log that could be created, and then fails, is no mistake of the caller's."""
    try:
        yield
    except LogError as error:
        raise InfrastructureError(str(error)) from error


class _End(NamedTuple):
    """How a run ended."""

    lost_processes: tuple[LostProcess, ...]
    interrupted: bool


def _conduct(conductor: Conductor, crew: Crew, interrupts: Interrupts) -> _End:
    lost: tuple[LostProcess, ...] = ()
    try:
        conductor.run()
    except CrewError as error:
        lost = (error.lost,)
    except KeyboardInterrupt:
        pass
    return _End((*crew.lost_processes, *lost), interrupts.requested)
