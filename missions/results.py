"""What a log says of its run beside the records: of its mission first, of its result in the end."""

import platform
from collections.abc import Sequence
from importlib.metadata import version

import msgspec

from farside.logs import LogFile, Recorder
from farside.logs.result import (
    DemResult,
    GoalResult,
    Judgement,
    LinkResult,
    LostProcessResult,
    ModeResult,
    OperatorResult,
    Outcome,
    RoverResult,
    RunResult,
    ShadowResult,
    StoreResult,
)
from farside.logs.views.run import RunView
from farside.missions.crew.crew import LostProcess
from farside.missions.expectations import judge
from farside.missions.loading import LoadedMission
from farside.missions.schema import MissionFile
from farside.node import Direction, to_ns, to_s

_LIBRARIES = ("farside", "eclipse-zenoh", "foxglove-sdk", "mcap", "msgspec", "numpy", "pymunk")


def describe(recorder: Recorder, loaded: LoadedMission) -> None:
    """Have a log say at its start of what mission it is, so that the run can be lived again."""
    mission = loaded.mission
    recorder.attach("mission.toml", "application/toml", loaded.text.encode())
    recorder.attach("mission.json", "application/json", msgspec.json.encode(mission))
    recorder.attach("overrides.json", "application/json", msgspec.json.encode(loaded.overrides))
    if loaded.files:
        recorder.attach("files.json", "application/json", msgspec.json.encode(loaded.files))
    if loaded.changes:
        recorder.attach("changes.json", "application/json", msgspec.json.encode(loaded.changes))
    if loaded.again:
        recorder.metadata("farside.rerun", dict(loaded.again))
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


def conclude(
    recorder: Recorder,
    mission: MissionFile,
    end_ns: int,
    wall_s: float,
    lost_processes: Sequence[LostProcess] = (),
) -> RunResult:
    """Have a log say how its run ended; the result.

    Args:
        recorder: writes the log.
        mission: the mission, at the end of the run.
        end_ns: simulated time reached.
        wall_s: wall time that it took.
        lost_processes: processes that ended before the run, in order of loss.
    """
    for lost in lost_processes:
        if lost.last_words:
            recorder.attach(f"{lost.role}-last-words.txt", "text/plain", lost.last_words.encode())
    result = _result(recorder, mission, end_ns, wall_s, lost_processes)
    recorder.attach("result.json", "application/json", msgspec.json.encode(result))
    recorder.metadata("farside.result", {"outcome": result.outcome, "digest": result.digest})
    return result


def _result(
    recorder: Recorder,
    mission: MissionFile,
    end_ns: int,
    wall_s: float,
    lost_processes: Sequence[LostProcess],
) -> RunResult:
    recorder.flush()
    recorder.check()
    view = RunView(LogFile(recorder.path))
    complete = end_ns >= to_ns(mission.duration_s)
    judgements = (
        tuple(judge(expectation, view) for expectation in mission.expect) if complete else ()
    )
    sim_s = to_s(end_ns)
    dem = view.dem
    return RunResult(
        mission=mission.name,
        seed=mission.seed,
        outcome=_outcome(judgements, aborted=bool(lost_processes) or not complete),
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
        store=_store_result(view),
        rover=_rover(view),
        operator=_operator(view),
        dem=DemResult(dem.signs, dem.hypotheses, dem.mean_cm) if dem else DemResult(0, 0, 0.0),
        shadow=_shadow(view),
        lost_processes=tuple(
            LostProcessResult(lost.role, lost.how, to_s(lost.time_ns)) for lost in lost_processes
        ),
    )


def _store_result(view: RunView) -> StoreResult:
    store = view.store
    arrived = store.kept - store.given_up - store.waiting
    return StoreResult(store.kept, arrived, store.given_up, store.waiting)


def _shadow(view: RunView) -> ShadowResult | None:
    price = view.shadow
    if price is None:
        return None
    bits = 8 * (price.downlink_byte + price.report_byte)
    return ShadowResult(
        updates=price.updates,
        wholes=price.wholes,
        cycles=price.cycles,
        downlink_bytes=price.downlink_byte,
        downlink_share=price.downlink_share,
        report_bytes=price.report_byte,
        bits_per_cycle=bits / price.cycles if price.cycles else None,
        in_step=price.in_step,
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
    return last and OperatorResult(last.step, last.of, last.waiting_for, last.t_s, last.left)


def _outcome(judgements: Sequence[Judgement], *, aborted: bool) -> Outcome:
    if aborted:
        return Outcome.ABORTED
    return Outcome.SUCCESS if all(judgement.met for judgement in judgements) else Outcome.FAILURE
