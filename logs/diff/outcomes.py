"""What two runs came to, and by which missions they went, side by side."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, TypeVar

import msgspec

from farside.logs.diff.parting import MISSING, different
from farside.logs.events import sign_text
from farside.logs.file.parts import LogError
from farside.logs.file.reading import LogFile
from farside.logs.views.run import RunView
from farside.messages import Tokens
from farside.node import Direction, to_s
from farside.topics import GoalSource

T = TypeVar("T")


class Row(msgspec.Struct, frozen=True):
    """Something in which two runs differ.

    Attributes:
        what: what it is.
        first, second: how it is in either; `None` where there is none.
    """

    what: str
    first: str | None
    second: str | None


class MissionKey(msgspec.Struct, frozen=True):
    """A key of two missions whose values differ.

    Attributes:
        key: the dotted key.
        first, second: the values, as in JSON; `None` where there is none.
        from_s: since when, for a mission that changed during the run.
    """

    key: str
    first: Any
    second: Any
    from_s: float = 0.0


class _Change(msgspec.Struct):
    at_ns: Annotated[int, msgspec.Meta(ge=0)]
    mission: dict[str, Any]


def mission_differences(first: LogFile, second: LogFile) -> Iterator[MissionKey]:
    """In what two missions differ, key by key, from the start; and from later, where they change.

    A log that carries no mission has no keys.

    Raises:
        LogError: if a log's mission cannot be read.
    """
    ours, theirs = _missions(first), _missions(second)
    told: dict[str, tuple[Any, Any]] = {}
    for at_ns in sorted({at_ns for at_ns, _ in (*ours, *theirs)}):
        now = {
            key: (one, other)
            for key, one, other in different(_in_force(ours, at_ns), _in_force(theirs, at_ns))
        }
        for key in {**told, **now}:
            one, other = now.get(key, (MISSING, MISSING))
            if key in now and told.get(key) != (one, other):
                yield MissionKey(key, _value(one), _value(other), to_s(at_ns))
        told = now


def outcome_differences(first: LogFile, second: LogFile) -> Iterator[Row]:
    """In what two runs differ by what they came to: the outcome first, then what led to it."""
    ours, theirs = dict(_facts(first)), dict(_facts(second))
    for what in {**ours, **theirs}:
        one, other = ours.get(what), theirs.get(what)
        if one != other:
            yield Row(what, one, other)


def _missions(log: LogFile) -> list[tuple[int, dict[str, Any]]]:
    """The missions by which a run went, each with the time from which on."""
    changes = _attached(log, "changes.json", list[_Change], [])
    return [
        (0, _attached(log, "mission.json", dict[str, Any], {})),
        *((change.at_ns, change.mission) for change in changes),
    ]


def _attached(log: LogFile, name: str, kind: type[T], default: T) -> T:
    if name not in log.attachments:
        return default
    try:
        return msgspec.json.decode(log.attachments[name].data, type=kind)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise LogError(
            f"{log.path}: expected JSON of a mission in {name}, found: {error}"
        ) from error


def _in_force(missions: list[tuple[int, dict[str, Any]]], at_ns: int) -> Mapping[str, Any]:
    return [mission for begins_ns, mission in missions if begins_ns <= at_ns][-1]


def _value(value: Any) -> Any:
    return None if value is MISSING else value


def _facts(log: LogFile) -> Iterator[tuple[str, str]]:
    """What a run came to, fact by fact, each with a name of its own."""
    view = RunView(log)
    result = view.result
    yield "outcome", "unfinished" if result is None else result.outcome
    for judged in () if result is None else result.expectations:
        met = "met" if judged.met else "not met"
        yield f"expectation: {judged.name}", f"{met}, {judged.detail}"
    yield "length", f"{view.duration_s:g} s"
    yield from _goals(view)
    for number, mode in enumerate(view.modes, start=1):
        yield f"mode {number}", f"{mode.mode} from {mode.t_s:g} s, {mode.why}"
    yield "commands sent", str(sum(1 for _ in view.commands_sent))
    for direction in Direction:
        counters = msgspec.structs.asdict(view.link_counters(direction))
        delay_s = counters.pop("delay_s")
        for name, count in counters.items():
            yield f"frames {direction}, {name.replace('_', ' ')}", str(count)
        if delay_s is not None:
            yield f"frames {direction}, mean delay", f"{delay_s:.3f} s"
    if (dem := view.dem) is not None:
        yield "Signs", str(dem.signs)
        yield "hypotheses", str(dem.hypotheses)
        yield "mean C_m", f"{dem.mean_cm:.3f}"
    if (least := view.least_charge) is not None:
        yield "least charge", f"{least.charge:.1%} at {least.t_s:g} s"


def _goals(view: RunView) -> Iterator[tuple[str, str]]:
    counts: dict[tuple[Tokens, GoalSource], int] = {}
    for goal in view.goals:
        key = goal.tokens, goal.source
        counts[key] = counts.get(key, 0) + 1
        again = f", time {counts[key]}" if counts[key] > 1 else ""
        end = "never reached"
        if goal.reached_s is not None:
            end = f"reached at {goal.reached_s:g} s"
        elif goal.withdrawn_s is not None:
            end = f"withdrawn at {goal.withdrawn_s:g} s"
        yield (
            f"goal {sign_text(goal.tokens)}, of {goal.source}{again}",
            (f"set at {goal.set_s:g} s, {end}"),
        )
