"""What led to a mode, or to a state of the failsafe: finders for the table of causes."""

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

import msgspec

from farside.control import Cause, CommandStage, Failsafe, ModeCause
from farside.logs.events import time_text
from farside.logs.file.parts import LogError
from farside.logs.story import silence
from farside.logs.story.causes.crossing import came
from farside.logs.story.search import Found, Search
from farside.messages import Drive, SetMode, SetOnLoss
from farside.node import NEVER_NS, Direction, to_ns, to_s
from farside.topics import (
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STUCK,
    TRUTH_POSE,
    CommandEntry,
    FailsafeEntry,
    GoalChange,
    ModeEntry,
)

_Any = Found[Any]


class Given(NamedTuple):
    """What is not looked into any further.

    Either it stands in the mission and in no record, such as a goal, a fault or a setting; or it
    says only when something could begin, so that what led to it is another story.

    Attributes:
        t_ns: from when it counts.
        sentence: what it is.
        topic: of its record; empty for what stands in the mission.
    """

    t_ns: int
    sentence: str
    topic: str = ""


Finds = Iterator[_Any | Given]


def some(*found: _Any | None) -> Iterator[_Any]:
    """Those that were found."""
    yield from (one for one in found if one is not None)


# --- the mode ---------------------------------------------------------------------------------


def mode(search: Search, found: Found[ModeEntry]) -> Iterator[_Any]:
    """The order, the drive, or the loss of the link."""
    match found.message.why:
        case ModeCause.OPERATOR:
            yield from ordered_at(search, found.t_ns, SetMode)
        case ModeCause.TAKEN_OVER:
            yield from ordered_at(search, found.t_ns, Drive)
        case ModeCause.LINK_LOST:
            yield from some(search.last(ROVER_FAILSAFE, found.t_ns))


def ordered_at(
    search: Search,
    t_ns: int,
    kind: type[Any],
    where: Callable[[Any], bool] = lambda _order: True,
) -> Iterator[Found[CommandEntry]]:
    """The command with such an order that was carried out at `t_ns`.

    Either it was taken then; or it had waited on board, and was begun or done then.
    """

    def fits(entry: CommandEntry) -> bool:
        return isinstance(entry.order, kind) and where(entry.order)

    carried_out = search.at(ROVER_COMMAND, t_ns, fits)
    yield from carried_out[:1] or some(
        search.last(
            ROVER_COMMAND, t_ns, lambda entry: fits(entry) and entry.stage is CommandStage.TAKEN
        )
    )


# --- the failsafe -----------------------------------------------------------------------------


def failsafe(search: Search, found: Found[FailsafeEntry]) -> Finds:
    """What has become so, or is so no more, since the failsafe was noted before.

    Only what the state rests on now, or rested on before: that no goal is left matters only when
    the link is lost. Where the link was silent before it was lost, the silence tells why.
    """
    before = search.last(ROVER_FAILSAFE, found.t_ns - 1)
    now = frozenset(found.message.causes)
    was = frozenset() if before is None else frozenset(before.message.causes)
    come = (now - was) & rests_on(found.message)
    gone = frozenset() if before is None else (was - now) & rests_on(before.message)
    told: list[_Any | Given] = []
    for cause in Cause:
        if cause in come | gone:
            told += _CHANGED[cause](search, found, cause in now)
    yield from told
    if before is not None and (not told or (Cause.LOST in come and Cause.SILENCE in was)):
        yield before


def _silence(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    if not so:
        yield from _heard(search, found.t_ns)
        return
    explained = silence.explain(search, Direction.UP, found.t_ns)
    yield from explained.outages or explained.losses or came(search, explained.heard)


def _expected(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    if not so:
        yield from _heard(search, found.t_ns)
        return
    explained = silence.explain(search, Direction.UP, found.t_ns)
    yield from explained.outages or came(search, explained.heard)


def _lost(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    if not so:
        yield from _heard(search, found.t_ns)


def _heard(search: Search, t_ns: int) -> Finds:
    """The frame that ended a silence, and the end of the outage before it."""
    heard = silence.heard_before(search, Direction.UP, t_ns)
    yield from came(search, heard)
    if heard is not None:
        before = silence.heard_before(search, Direction.UP, heard.t_ns - 1)
        since_ns = 0 if before is None else before.t_ns
        ended = search.last(
            LINK_OUTAGE, heard.t_ns, lambda out: out.direction is Direction.UP and not out.down
        )
        if ended is not None and ended.t_ns >= since_ns:
            yield ended


def _unconfirmed(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    yield from some(
        search.last(ROVER_MODE, found.t_ns, lambda entry: (entry.why is ModeCause.LINK_LOST) is so)
    )


def _forbidden(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    ordered = search.last(
        ROVER_COMMAND,
        found.t_ns,
        lambda one: isinstance(one.order, SetOnLoss) and one.stage is CommandStage.DONE,
    )
    if ordered is None and so:
        yield Given(0, "the mission forbids autonomy on loss of the link")
    yield from some(ordered)


_GONE = {GoalChange.REACHED, GoalChange.WITHDRAWN}


def _exhausted(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    last = search.last(ROVER_GOAL, found.t_ns, lambda entry: (entry.change in _GONE) is so)
    if last is None and so:
        yield Given(0, "the mission gives the rover no goal of its own")
    yield from some(last)


def _reserve(search: Search, found: Found[FailsafeEntry], _so: bool) -> Finds:  # noqa: FBT001
    yield from charge_at(search, found.t_ns)


def charge_at(search: Search, t_ns: int) -> Finds:
    """The charge of that moment, and the state of the battery if it has just changed."""
    pose = search.last(TRUTH_POSE, t_ns)
    if pose is not None:
        charge = f"the battery holds {pose.message.battery:.0%}"
        yield Given(pose.t_ns, charge, pose.topic)
    yield from search.at(ROVER_BATTERY, t_ns)


def _signal(search: Search, found: Found[FailsafeEntry], _so: bool) -> Finds:  # noqa: FBT001
    yield from some(search.last(ROVER_ACTION_ENDED, found.t_ns))


def _stuck(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
    yield from some(search.last(ROVER_STUCK, found.t_ns, lambda entry: entry.stuck is so))


_Time = Annotated[float, msgspec.Meta(ge=0)]


class _MissionFault(msgspec.Struct):
    what: str
    start_s: _Time
    end_s: _Time | None = None


class _MissionRover(msgspec.Struct):
    faults: tuple[_MissionFault, ...] = ()


class _Mission(msgspec.Struct):
    rover: _MissionRover


def _fault(what: str) -> "_Changed":
    def find(search: Search, found: Found[FailsafeEntry], so: bool) -> Finds:  # noqa: FBT001
        attachment = search.log.attachments.get("mission.json")
        if attachment is None:
            return
        try:
            faults = msgspec.json.decode(attachment.data, type=_Mission).rover.faults
        except msgspec.MsgspecError as error:
            message = f"{search.log.path}: the mission in it, mission.json, cannot be read: {error}"
            raise LogError(message) from error
        for fault in faults:
            at_s = fault.start_s if so else fault.end_s
            if fault.what != what or at_s is None:
                continue
            t_ns = to_ns(min(at_s, to_s(NEVER_NS)))
            if t_ns <= found.t_ns:
                verb = "begins" if so else "ends"
                yield Given(t_ns, f"the mission's fault of {what} {verb} at {time_text(t_ns)}")

    return find


def rests_on(entry: FailsafeEntry) -> frozenset[Cause]:
    """Those of its causes that a state of the failsafe rests on; the others make no difference.

    Of a lost link the silence is one, since it was lost by that.
    """
    so = frozenset(entry.causes)
    rests = next((causes for causes in _RESTS_ON[entry.state] if causes <= so), frozenset[Cause]())
    return rests | ({Cause.SILENCE} & so) if Cause.LOST in rests else rests


_RESTS_ON: Mapping[Failsafe, tuple[frozenset[Cause], ...]] = {
    Failsafe.SAFE: (
        frozenset({Cause.TILT}),
        frozenset({Cause.SENSOR_DEAD}),
        frozenset({Cause.STUCK}),
    ),
    Failsafe.ALONE: (
        frozenset({Cause.LOST, Cause.RESERVE}),
        frozenset({Cause.LOST, Cause.NO_SIGNAL}),
        frozenset({Cause.LOST}),
    ),
    Failsafe.HOLD: (
        frozenset({Cause.LOST, Cause.FORBIDDEN}),
        frozenset({Cause.LOST, Cause.EXHAUSTED}),
        frozenset({Cause.SILENCE}),
        frozenset({Cause.UNCONFIRMED}),
    ),
    Failsafe.NOMINAL: (
        frozenset({Cause.RESERVE}),
        frozenset({Cause.EXPECTED_SILENCE}),
    ),
}
"""What a state may rest on: the first that is so counts, as in the failsafe's own table."""

_Changed = Callable[[Search, Found[FailsafeEntry], bool], Finds]

_CHANGED: Mapping[Cause, _Changed] = {
    Cause.EXPECTED_SILENCE: _expected,
    Cause.SILENCE: _silence,
    Cause.LOST: _lost,
    Cause.UNCONFIRMED: _unconfirmed,
    Cause.FORBIDDEN: _forbidden,
    Cause.EXHAUSTED: _exhausted,
    Cause.RESERVE: _reserve,
    Cause.NO_SIGNAL: _signal,
    Cause.STUCK: _stuck,
    Cause.TILT: _fault("tilt"),
    Cause.SENSOR_DEAD: _fault("position-sensor"),
}
"""What finds why each of the failsafe's causes came about, or went."""
