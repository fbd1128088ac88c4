"""A run once more, otherwise: `farside rerun`."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from farside.logs import LogFile
from farside.missions.assignments import Assignment, read_assignments
from farside.missions.conductor import Watcher
from farside.missions.extensions.kinds import (
    CONTROLLER,
    OPERATOR,
    ExtensionError,
    Kind,
    searching,
)
from farside.missions.interrupts import Interrupts
from farside.missions.loading import LoadedMission, MissionError, load_text
from farside.missions.reliving.changing import different_keys, refusals
from farside.missions.reliving.crew import RelivedCrew
from farside.missions.reliving.past import Past, RelivingError, read_past, refuse_beyond
from farside.missions.reliving.verifying import compared
from farside.missions.run import RUNS, FinishedRun, run_mission
from farside.missions.schema import Change, MissionFile
from farside.node import to_ns, to_s
from farside.validation import dotted

if TYPE_CHECKING:
    from farside.ground.operators.operator import Operator
    from farside.rover.controller import Controller

_RECORDED = ("ground", "recorded")
_THEN, _LATER = " set in that run", " changed during that run"


class _Beside(NamedTuple):
    """What comes beside the text of the mission.

    Attributes:
        controller, operator: classes in place of their names.
        files: texts of the files that its link names, by name; what is read is put in.
    """

    controller: "type[Controller] | None"
    operator: "type[Operator] | None"
    files: dict[str, str]


class _Stage(NamedTuple):
    """From a moment on, these keys have these values, on top of all before.

    Attributes:
        at_ns: the moment in simulated time.
        made: what was set, or is to be.
        recorded: the orders that were read from another log then.
    """

    at_ns: int
    made: tuple[Assignment, ...]
    recorded: tuple[Assignment, ...] = ()


def load_again(
    log: LogFile | Path | str,
    assignments: Sequence[str] | Mapping[str, object] = (),
    seed: int | None = None,
    *,
    from_s: float | None = None,
    progress: Callable[[float], None] | None = None,
    controller: "type[Controller] | None" = None,
    operator: "type[Operator] | None" = None,
) -> tuple[LoadedMission, Past]:
    """The mission of a log with changes, and the run in the log.

    The mission file in the log is read again with all that was set then, and the changes on top. So
    without `from_s` it is the mission that `farside run` would run with the same values. Files that
    it names are in the log; others, which a change names, are looked for in the current folder.

    Args:
        log: the log, open or by its path.
        assignments: as in `farside.missions.load_mission`.
        seed: in place of the run's.
        from_s: the changes act from this moment on, in simulated seconds, to the next tick; the run
            up to it is the recorded one, which is proved first. From the start by default.
        progress: told of how far that has come, in simulated seconds.
        controller: the class of the run's own controller, where its name does not lead to it.
        operator: likewise.

    Raises:
        LogError: if the log cannot be read.
        MissionError: if the mission with the changes is not valid.
        RelivingError: if the run cannot be lived again up to `from_s`, or does not come out as it
            is in the log; or a key cannot change then.
    """
    past = read_past(log)
    try:
        made = read_assignments(assignments)
    except ValueError as error:
        raise MissionError(f"{past.log.path}: {error}") from error
    if seed is not None:
        made.append(Assignment(("seed",), seed, f"--seed {seed}"))
    beside = _Beside(controller, operator, dict(past.files))
    begun = _Stage(0, _assigned(past.overrides, _THEN), _recorded(past, past.mission))
    later = [_later(past, one, made) for one in past.changes]
    again = {"log": past.log.path.name, "digest": _digest(past)}
    if from_s is None:
        begun = _Stage(0, (*begun.made, *begun.recorded, *made))
        loaded = _loaded(past, begun.made, beside)
        overrides = (*past.overrides, *_overrides(made))
        changes = _changes(past, loaded.mission, [begun], later, beside)
        return loaded._replace(changes=changes, overrides=overrides, again=again), past
    refuse_beyond(past, from_s)
    at_ns = -(-to_ns(from_s) // past.mission.tick_ns) * past.mission.tick_ns
    kept = tuple(one for one in past.changes if one.at_ns <= at_ns)
    mission = kept[-1].mission if kept else past.mission
    coming = [_Stage(at_ns, tuple(made)), *later[len(kept) :]]
    changes = _changes(past, mission, [begun, *later[: len(kept)]], coming, beside)
    loaded = _loaded(past, (*begun.made, *begun.recorded), beside)._replace(
        mission=past.mission,
        changes=(*kept, *changes),
        overrides=past.overrides,
        again={**again, "from_s": f"{to_s(at_ns):g}"},
    )
    _prove(past, at_ns, loaded, progress)
    return loaded, past


def rerun(
    log: LogFile | Path | str,
    assignments: Sequence[str] | Mapping[str, object] = (),
    seed: int | None = None,
    *,
    from_s: float | None = None,
    out: Path = RUNS,
    watcher: Watcher | None = None,
    interrupts: Interrupts | None = None,
    controller: "type[Controller] | None" = None,
    operator: "type[Operator] | None" = None,
) -> FinishedRun:
    """Run the mission of a log again with changes, in this process, and write a new log.

    What was ordered from outside is ordered at the same times, where the operator is `queued`. The
    new log can be lived again like any other.

    Args:
        log: see `load_again`.
        assignments: likewise.
        seed: likewise.
        from_s: likewise.
        controller: likewise.
        operator: likewise.
        out: folder for the new log, created if missing.
        watcher: observes the run in progress.
        interrupts: see `farside.missions.run_mission`.

    Raises:
        LogError, MissionError, RelivingError: as `load_again`.
        InfrastructureError, KeyboardInterrupt: as `farside.missions.run_mission`.
    """
    loaded, past = load_again(
        log, assignments, seed, from_s=from_s, controller=controller, operator=operator
    )
    return run_again(loaded, past, out=out, watcher=watcher, interrupts=interrupts)


def run_again(
    loaded: LoadedMission,
    past: Past,
    *,
    out: Path = RUNS,
    watcher: Watcher | None = None,
    interrupts: Interrupts | None = None,
) -> FinishedRun:
    """Run what `load_again` has loaded; see `rerun`."""
    with searching(loaded.extensions.path):
        try:
            crew = RelivedCrew(
                loaded.mission,
                loaded.changes,
                past.orders(),
                loaded.extensions,
                actions=past.actions(),
            )
        except ExtensionError as error:
            raise RelivingError(f"{past.log.path}: {error}") from error
        return run_mission(
            loaded, in_process=True, out=out, watcher=watcher, interrupts=interrupts, crew=crew
        )


def _later(past: Past, change: Change, made: Sequence[Assignment]) -> _Stage:
    """What a change of that run set, with the recorded orders that it took, if it did.

    Args:
        past: the run.
        change: one of its changes.
        made: what is set now: recorded orders among it are those of an operator who came later.
    """
    then = _assigned(change.overrides, _LATER)
    takes = any(one.touches(_RECORDED) for one in then) or (
        any(one.touches(OPERATOR.key) for one in then)
        and not any(one.touches(_RECORDED) for one in made)
    )
    return _Stage(change.at_ns, then, _recorded(past, change.mission) if takes else ())


def _recorded(past: Past, mission: MissionFile) -> tuple[Assignment, ...]:
    """The recorded orders that a mission gives, as they were read then."""
    if mission.ground.operator != "recorded":
        return ()
    recorded = msgspec.json.decode(msgspec.json.encode(mission.ground.recorded))
    given = {key: value for key, value in recorded.items() if value is not None}
    return (Assignment(_RECORDED, given, f"the orders in {past.log.path}"),)


def _assigned(overrides: Sequence[tuple[str, object]], when: str) -> tuple[Assignment, ...]:
    return tuple(
        made._replace(origin=f"{key}{when}")
        for key, value in overrides
        for made in read_assignments({key: value})
    )


def _overrides(made: Sequence[Assignment]) -> tuple[tuple[str, object], ...]:
    return tuple((dotted(one.key), one.value) for one in made)


def _loaded(past: Past, made: Sequence[Assignment], beside: _Beside) -> LoadedMission:
    if not past.text:
        raise RelivingError(f"{past.log.path}: expected a log with its mission file, found none")
    return load_text(
        past.text,
        # As if it lay in the current folder: what it names is in the log, or the user's own.
        f"mission.toml of {past.log.path.name}",
        made,
        beside.files,
        controller=None if _is_set(CONTROLLER, made) else beside.controller,
        operator=None if _is_set(OPERATOR, made) else beside.operator,
    )


def _is_set(kind: Kind, made: Sequence[Assignment]) -> bool:
    """Whether the run is to have another controller or operator than the recorded one."""
    return any(one.touches(kind.key) and not one.origin.endswith(_THEN) for one in made)


def _changes(
    past: Past,
    mission: MissionFile,
    before: Sequence[_Stage],
    coming: Sequence[_Stage],
    beside: _Beside,
) -> tuple[Change, ...]:
    """What becomes of a mission, stage by stage.

    Args:
        past: the run.
        mission: the mission in force before.
        before: how it came about, stage by stage, the start included.
        coming: the stages.
        beside: what comes beside the text.

    Raises:
        RelivingError: if a key changes that cannot during a run.
    """
    made = [one for stage in before for one in (*stage.made, *stage.recorded)]
    text = _loaded(past, made, beside).mission
    changes = []
    for stage in coming:
        made += (*stage.made, *stage.recorded)
        text_before, text = text, _loaded(past, made, beside).mission
        # Only what this stage changes: another Farside may read the rest of the text otherwise.
        after = _patched(mission, text_before, text)
        _refuse(past, stage.at_ns, mission, after)
        changes.append(Change(stage.at_ns, _overrides(stage.made), after))
        mission = after
    return tuple(changes)


def _patched(mission: MissionFile, before: MissionFile, after: MissionFile) -> MissionFile:
    """A mission with the keys changed in which two others differ."""
    data, source = msgspec.to_builtins(mission), msgspec.to_builtins(after)
    for *path, last in different_keys(before, after):
        table, other = data, source
        for part in path:
            table, other = table[part], other[part]
        if last in other:
            table[last] = other[last]
        else:
            table.pop(last, None)
    return msgspec.convert(data, MissionFile)


def _refuse(past: Past, at_ns: int, before: MissionFile, after: MissionFile) -> None:
    problems = [
        f"{past.log.path}: {dotted(key)}: {text}; without --from it can change"
        for key, text in refusals(before, after)
    ]
    if to_ns(after.duration_s) <= at_ns:
        problems.append(
            f"{past.log.path}: duration_s: expected more than the {to_s(at_ns):g} s from which it "
            f"is to hold, found {after.duration_s:g}"
        )
    if problems:
        raise RelivingError("\n".join(problems))


def _prove(
    past: Past, at_ns: int, loaded: LoadedMission, progress: Callable[[float], None] | None
) -> None:
    """Prove that the run up to a moment comes out as it is in the log, before anything is written.

    Raises:
        RelivingError: if it does not.
    """
    verdict = compared(past, at_ns, loaded.extensions, progress)
    if verdict.parting is None:
        return
    others = ", ".join(f"{one.name} {one.then}, here {one.now}" for one in verdict.other_versions)
    raise RelivingError(
        f"{past.log.path}: expected the run to come out as it is in the log up to "
        f"{to_s(at_ns):g} s, found another record at {verdict.parting.t_s:g} s in "
        f"{verdict.parting.topic}, which `farside verify` shows"
        + (f"; the log is damaged: {verdict.damage[0]}" if verdict.damage else "")
        + (f"; it was recorded with {others}" if others else "")
    )


def _digest(past: Past) -> str:
    return past.log.metadata.get("farside.result", {}).get("digest", "")
