"""One run of a mission from start to result: crew, log, expectations."""

import math
import platform
import time
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import msgspec

from farside.logs.recording import LogError, Recorder
from farside.logs.views import RunView
from farside.missions.build import build_node
from farside.missions.conductor import Conductor, Watcher
from farside.missions.crew.crew import Crew, CrewError, InProcessCrew, LostRole
from farside.missions.crew.processes import ProcessCrew
from farside.missions.expectations import judge
from farside.missions.loading import LoadedMission
from farside.missions.result import (
    DemResult,
    GoalResult,
    Judgement,
    LinkResult,
    LostProcess,
    ModeResult,
    OperatorResult,
    Outcome,
    RoverResult,
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
        records: Iterable[Record],
        result: RunResult,
        losses: tuple[LostRole, ...],
        *,
        interrupted: bool,
    ) -> None:
        super().__init__(records)
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

    Raises:
        CrewError: if the processes cannot be started; there is no log then.
        LogError: if the log cannot be written.
    """
    mission = loaded.mission
    with _crew(mission, in_process=in_process) as crew, _new_log(out, mission) as recorder:
        _describe(recorder, loaded)
        conductor = Conductor(
            mission, crew, recorder, watcher or Unwatched(), pace=pace, window_ns=window_ns
        )
        began_s = time.monotonic()
        end = _conduct(conductor, crew)
        wall_s = time.monotonic() - began_s
        result = _result(mission, conductor, recorder, end, wall_s)
        recorder.attach("result.json", "application/json", msgspec.json.encode(result))
        recorder.metadata("farside.result", {"outcome": result.outcome, "digest": result.digest})
    return FinishedRun(conductor.records, result, end.losses, interrupted=end.interrupted)


def _crew(mission: MissionFile, *, in_process: bool) -> Crew:
    if in_process:
        return InProcessCrew(*(build_node(role, mission) for role in Role))
    return ProcessCrew(mission)


class _End(NamedTuple):
    """How a run came to its end."""

    losses: tuple[LostRole, ...]
    interrupted: bool


def _conduct(conductor: Conductor, crew: Crew) -> _End:
    try:
        conductor.run()
    except CrewError as error:
        return _End((*crew.losses, error.loss), interrupted=False)
    except KeyboardInterrupt:
        return _End(tuple(crew.losses), interrupted=True)
    return _End(tuple(crew.losses), interrupted=False)


def _new_log(out: Path, mission: MissionFile) -> Recorder:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LogError(f"{out}: expected a folder for logs, found: {error.strerror}") from error
    number = 1
    while (path := out / f"{mission.name}-seed{mission.seed}-{number}.mcap").exists():
        number += 1
    return Recorder(path)


def _describe(recorder: Recorder, loaded: LoadedMission) -> None:
    mission = loaded.mission
    recorder.attach("mission.toml", "application/toml", loaded.text.encode())
    recorder.attach("mission.json", "application/json", msgspec.json.encode(mission))
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
    view = RunView(conductor.records)
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
        rover=_rover(view),
        operator=_operator(view),
        dem=DemResult(dem.signs, dem.hypotheses, dem.mean_cm) if dem else DemResult(0, 0, 0.0),
        lost_processes=tuple(
            LostProcess(loss.role, loss.how, to_s(loss.time_ns)) for loss in end.losses
        ),
    )


def _rover(view: RunView) -> RoverResult:
    least = view.least_charge
    return RoverResult(
        least_charge=least.charge if least else None,
        least_charge_s=least.t_s if least else None,
        flat_since_s=view.flat_since_s,
        stuck_since_s=view.stuck_since_s,
    )


def _operator(view: RunView) -> OperatorResult | None:
    last = view.operator
    return OperatorResult(last.step, last.of, last.waiting_for, last.t_s) if last else None


def _outcome(judgements: Sequence[Judgement], *, aborted: bool) -> Outcome:
    if aborted:
        return Outcome.ABORTED
    return Outcome.SUCCESS if all(j.met for j in judgements) else Outcome.FAILURE
