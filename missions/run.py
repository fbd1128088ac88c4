"""One run of a mission from start to result: crew, log, expectations."""

import math
import platform
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import msgspec

from farside.logs import LogFile, Recorder
from farside.logs.views import RunView
from farside.missions.build import build_node
from farside.missions.conductor import Conductor, Watcher
from farside.missions.crew.crew import Crew, CrewError, InProcessCrew, LostRole
from farside.missions.crew.processes import ProcessCrew
from farside.missions.expectations import judge
from farside.missions.interrupts import Interrupts
from farside.missions.loading import LoadedMission
from farside.missions.result import (
    DemResult,
    GoalResult,
    Judgement,
    LinkResult,
    LostProcess,
    ModeResult,
    Outcome,
    RunResult,
)
from farside.missions.schema import MissionFile
from farside.node import Direction, Record, Role, to_ns, to_s

RUNS = Path("logs/runs")
"""Where logs go unless told otherwise, below the current folder."""

_LIBRARIES = ("farside", "eclipse-zenoh", "mcap", "msgspec", "numpy", "pymunk")


class Unwatched:
    """A `Watcher` that looks away."""

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """Do nothing."""


class FinishedRun(RunView):
    """A run that is over: its result, and all there is to ask about it.

    Attributes:
        result: what came of it.
        losses: the processes that ended before the run did, with their last words.
        interrupted: whether somebody stopped it.
    """

    def __init__(
        self,
        log: LogFile,
        result: RunResult,
        losses: tuple[LostRole, ...],
        *,
        interrupted: bool,
    ) -> None:
        super().__init__(log)
        self.result = result
        self.losses = losses
        self.interrupted = interrupted

    @property
    def log(self) -> Path:
        """The log."""
        return Path(self.result.log)

    @property
    def digest(self) -> str:
        """SHA-256 over all that was logged; see `farside.logs.Digest`."""
        return self.result.digest


def run_mission(
    loaded: LoadedMission,
    *,
    in_process: bool = False,
    pace: float = math.inf,
    out: Path = RUNS,
    watcher: Watcher | None = None,
    window_ns: int | None = None,
) -> FinishedRun:
    """Run a mission and leave its log.

    Args:
        loaded: the mission.
        in_process: run all nodes in this process, not in one each over Zenoh.
        pace: simulated seconds per wall second at most.
        out: folder for the log; made if need be.
        watcher: is shown the run while it goes on.
        window_ns: length of a window at most, where it should be shorter than the link allows.

    Ctrl-C or SIGTERM ends the run after the window that is on; a second one at once. The log is
    whole either way.

    Raises:
        KeyboardInterrupt: if one came before the first window; there is no log then.
        CrewError: if the processes cannot be started; there is no log then.
        LogError: if the log cannot be written.
    """
    mission = loaded.mission
    with Interrupts() as interrupts, ExitStack() as stack:
        with interrupts.breakable(at=1):
            crew = stack.enter_context(_crew(mission, in_process=in_process))
        recorder = stack.enter_context(
            Recorder.in_folder(out, f"{mission.name}-seed{mission.seed}")
        )
        _describe(recorder, loaded)
        conductor = Conductor(
            mission,
            crew,
            recorder,
            watcher or Unwatched(),
            interrupts,
            pace=pace,
            window_ns=window_ns,
        )
        began_s = time.monotonic()
        end = _conduct(conductor, crew, interrupts)
        wall_s = time.monotonic() - began_s
        result = _result(mission, conductor, recorder, end, wall_s)
        recorder.attach("result.json", "application/json", msgspec.json.encode(result))
        recorder.metadata("farside.result", {"outcome": result.outcome, "digest": result.digest})
        # Packing may be broken off: the log then stays as it was written, and is as good.
        with suppress(KeyboardInterrupt), interrupts.breakable(at=2):
            recorder.close()
    return FinishedRun(LogFile(recorder.path), result, end.losses, interrupted=end.interrupted)


def _crew(mission: MissionFile, *, in_process: bool) -> Crew:
    if in_process:
        return InProcessCrew(*(build_node(role, mission) for role in Role))
    return ProcessCrew(mission)


class _End(NamedTuple):
    """How a run came to its end."""

    losses: tuple[LostRole, ...]
    interrupted: bool


def _conduct(conductor: Conductor, crew: Crew, interrupts: Interrupts) -> _End:
    losses: tuple[LostRole, ...] = ()
    try:
        conductor.run()
    except CrewError as error:
        losses = (error.loss,)
    except KeyboardInterrupt:
        pass
    return _End((*crew.losses, *losses), interrupts.requested)


def _describe(recorder: Recorder, loaded: LoadedMission) -> None:
    mission = loaded.mission
    recorder.attach("mission.toml", "application/toml", loaded.text.encode())
    recorder.attach("mission.json", "application/json", msgspec.json.encode(mission))
    recorder.attach("overrides.json", "application/json", msgspec.json.encode(loaded.overrides))
    versions = {name: version(name) for name in _LIBRARIES}
    recorder.metadata(
        "farside.run",
        {
            "mission": mission.name,
            "seed": str(mission.seed),
            "python": platform.python_version(),
            **versions,
        },
    )


def _result(
    mission: MissionFile,
    conductor: Conductor,
    recorder: Recorder,
    end: _End,
    wall_s: float,
) -> RunResult:
    recorder.flush()
    view = RunView(LogFile(recorder.path))
    finished = conductor.now_ns >= to_ns(mission.duration_s)
    judgements = tuple(judge(one, view) for one in mission.expect) if finished else ()
    sim_s = to_s(conductor.now_ns)
    dem = view.dem
    return RunResult(
        mission=mission.name,
        seed=mission.seed,
        outcome=_outcome(judgements, aborted=bool(end.losses) or not finished),
        expectations=judgements,
        log=str(recorder.path),
        digest=recorder.digest,
        sim_seconds=sim_s,
        wall_seconds=wall_s,
        speedup=sim_s / wall_s,
        goals=tuple(
            GoalResult(goal.tokens, goal.source, goal.set_s, goal.reached_s) for goal in view.goals
        ),
        modes=tuple(ModeResult(mode.t_s, mode.mode, mode.why) for mode in view.modes),
        link=LinkResult(
            uplink=view.link_counters(Direction.UP), downlink=view.link_counters(Direction.DOWN)
        ),
        dem=DemResult(dem.signs, dem.hypotheses, dem.mean_cm) if dem else DemResult(0, 0, 0.0),
        lost_processes=tuple(
            LostProcess(loss.role, loss.how, to_s(loss.time_ns)) for loss in end.losses
        ),
    )


def _outcome(judgements: Sequence[Judgement], *, aborted: bool) -> Outcome:
    if aborted:
        return Outcome.ABORTED
    return Outcome.SUCCESS if all(j.met for j in judgements) else Outcome.FAILURE
