"""Frames and the messages in them: finders for the table of causes."""

from collections.abc import Callable, Iterator
from typing import Any

from farside.control import CommandStage
from farside.frames import Carried, Fate, FrameEvent, FrameFate, FrameHop, FrameStage
from farside.logs.story.search import Found, Search
from farside.logs.story.silence import RECEIVER, SENDER, is_used
from farside.messages import (
    BatteryChanged,
    CommandForced,
    CommandReached,
    Event,
    FailsafeChanged,
    GoalAside,
    GoalReached,
    LinkBack,
    ModeChanged,
    StuckChanged,
)
from farside.node import Direction, Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_PROPOSAL,
    LINK_FRAME,
    LINK_HOP,
    LINK_OUTAGE,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_MODEL,
    ROVER_PROPOSAL,
    ROVER_STUCK,
    EventLearned,
    GoalChange,
)

_Any = Found[Any]


def fate(search: Search, found: Found[FrameFate]) -> Iterator[_Any]:
    """The outage that it was lost to; and the message in it."""
    one = found.message
    if one.fate is Fate.OUTAGE:
        outage = search.last(
            LINK_OUTAGE, found.t_ns, lambda out: out.direction is one.direction and out.down
        )
        if outage is not None:
            yield outage
    made = made_of(search, one)
    if made is not None:
        yield from message_in(search, made)


def event(search: Search, found: Found[FrameEvent]) -> Iterator[_Any]:
    """What an endpoint did with a frame: its fate in the channel, or the message it was made of.

    What terrain shadow took was lost since the rover had driven into it.
    """
    one, is_sender = found.message, found.topic == SENDER[found.message.direction].name
    if one.stage is FrameStage.SHADOWED:
        drove = search.last(ROVER_ACTION_STARTED, found.t_ns)
        if drove is not None:
            yield drove
        return
    if is_sender:
        yield from message_in(search, found)
        return
    fate = fate_of(search, one, found.t_ns)
    if fate is not None:
        yield fate


def came(search: Search, heard: Found[FrameEvent] | None) -> Iterator[_Any]:
    """The frame that was heard, by what the channel says of it, or else the receiver."""
    if heard is not None:
        yield fate_of(search, heard.message, heard.t_ns) or heard


def made_of(search: Search, one: FrameFate) -> Found[FrameEvent] | None:
    """Where its sender says that it made a frame."""
    made = search.at(
        SENDER[one.direction],
        one.queued_ns,
        lambda event: (
            event.direction is one.direction
            and event.sequence == one.sequence
            and event.stage is FrameStage.MADE
        ),
    )
    return made[0] if made else None


def hops_of(search: Search, one: FrameFate, t_ns: int) -> list[FrameHop]:
    """What nodes on its way say of a frame whose fate was known at `t_ns`."""
    hops = search.each(LINK_HOP, start_ns=one.queued_ns, end_ns=t_ns)
    return [
        found.message
        for found in hops
        if (found.message.direction, found.message.sequence) == (one.direction, one.sequence)
    ]


def fate_of(search: Search, event: FrameEvent, t_ns: int) -> Found[FrameFate] | None:
    """What the channel says of a frame that an endpoint received at `t_ns`."""
    return search.last(
        LINK_FRAME,
        t_ns,
        lambda fate: (
            fate.direction is event.direction and fate.sequence == event.sequence and not fate.copy
        ),
    )


def brought(
    search: Search, direction: Direction, kind: str, t_ns: int, is_it: Callable[[Carried], bool]
) -> Iterator[_Any]:
    """The frame that completed a message at its receiver at `t_ns`; then the attempts lost before.

    Args:
        search: the log.
        direction: of the message.
        kind: of the message; see `Carried`.
        t_ns: when the receiver had it.
        is_it: whether a message of that kind is it.
    """

    def has(event: FrameEvent) -> bool:
        return event.direction is direction and any(
            one.kind == kind and is_it(one) for one in event.carries
        )

    used = search.at(
        RECEIVER[direction], t_ns, lambda event: is_used(event, direction) and has(event)
    )
    if not used:
        return
    came = fate_of(search, used[0].message, t_ns)
    yield used[0] if came is None else came
    made = None if came is None else made_of(search, came.message)
    if made is not None and made.message.carries and made.message.carries[0].attempt > 1:
        yield from _lost_before(search, made)


def _lost_before(search: Search, made: Found[FrameEvent]) -> Iterator[_Any]:
    """The last earlier attempt at the same part of a message that was lost, if any was."""
    part, direction = made.message.carries[0], made.message.direction
    before = search.last(
        SENDER[direction],
        made.t_ns - 1,
        lambda event: (
            event.direction is direction
            and event.stage is FrameStage.MADE
            and any(_same_part(one, part) for one in event.carries)
        ),
    )
    if before is None:
        return
    lost = search.first(
        LINK_FRAME,
        lambda fate: (
            fate.direction is direction
            and fate.sequence == before.message.sequence
            and not fate.copy
        ),
        start_ns=before.t_ns,
        end_ns=made.t_ns,
    )
    if lost is not None and lost.message.fate is not Fate.DELIVERED:
        yield lost


def _same_part(one: Carried, other: Carried) -> bool:
    return (one.kind, one.number, one.time_ns, one.part) == (
        other.kind,
        other.number,
        other.time_ns,
        other.part,
    )


# --- what a message was made of ---------------------------------------------------------------


def message_in(search: Search, made: Found[FrameEvent]) -> Iterator[_Any]:
    """The record of the message that a frame was made of; nothing for signs of life."""
    for one in made.message.carries:
        if one.number is None:
            continue
        if one.kind == "event":
            learned = _learned(search, one.number, one.time_ns or 0)
            if learned is not None:
                yield from happened(search, learned.message.event)
        elif (topic := _MADE_OF.get(one.kind)) is not None:
            found = _numbered(search, topic, one.number, made.t_ns)
            if found is not None:
                yield found


_MADE_OF: dict[str, Topic[Any]] = {
    "command": GROUND_COMMAND,
    "shown": GROUND_PROPOSAL,
    "proposal": ROVER_PROPOSAL,
    "model": ROVER_MODEL,
}
"""Where the sender records what it makes messages of, by their kind."""


def _numbered(search: Search, topic: Topic[Any], number: int, t_ns: int) -> _Any | None:
    return search.last(topic, t_ns, lambda message: message.number == number)


def _learned(search: Search, number: int, start_ns: int) -> Found[EventLearned] | None:
    return search.first(GROUND_EVENT, lambda known: known.event.number == number, start_ns=start_ns)


def happened(search: Search, event: Event) -> Iterator[_Any]:
    """The record of the rover's of what an event tells of."""
    t_ns, found = event.time_ns, list[Any]()
    match event.what:
        case ModeChanged(mode=mode):
            found = search.at(ROVER_MODE, t_ns, lambda one: one.mode is mode)
        case FailsafeChanged(why=why):
            found = search.at(ROVER_FAILSAFE, t_ns, lambda one: one.why == why)
        case LinkBack():
            found = search.at(ROVER_FAILSAFE, t_ns)
        case GoalReached(tokens=tokens):
            found = search.at(
                ROVER_GOAL,
                t_ns,
                lambda one: one.tokens == tokens and one.change is GoalChange.REACHED,
            )
        case GoalAside(tokens=tokens):
            found = search.at(ROVER_GOAL, t_ns, lambda one: one.tokens == tokens)
        case CommandReached(number=number, stage=stage):
            found = search.at(
                ROVER_COMMAND, t_ns, lambda one: one.number == number and one.stage is stage
            )
        case CommandForced(number=number):
            found = search.at(
                ROVER_COMMAND,
                t_ns,
                lambda one: one.number == number and one.stage is CommandStage.BEGUN,
            )
        case BatteryChanged():
            found = search.at(ROVER_BATTERY, t_ns)
        case StuckChanged():
            found = search.at(ROVER_STUCK, t_ns)
    yield from found[-1:]
