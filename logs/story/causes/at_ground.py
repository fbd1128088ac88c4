"""What led to what the ground did and learned: finders for the table of causes."""

from collections.abc import Iterator
from typing import Any

from farside.acts import Discard, Planned
from farside.control import Verdict
from farside.logs.story import silence as silences
from farside.logs.story.causes.crossing import brought, came
from farside.logs.story.search import Found, Search
from farside.messages import Approve, CommandReached, Override, Proposal, Telemetry, Veto
from farside.node import Direction, Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_HELD,
    GROUND_ORDER,
    GROUND_PROPOSAL,
    GROUND_SILENCE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    CommandSent,
    EventLearned,
    HeldEntry,
    HeldFate,
    LifeEntry,
    OrderGiven,
    Review,
    ShadowEntry,
    Silence,
)

_Any = Found[Any]


def command_sent(search: Search, found: Found[CommandSent]) -> Iterator[_Any]:
    """What it was held for, or the order of that moment."""
    sent = found.message
    released = search.at(GROUND_HELD, found.t_ns, lambda held: sent.number in held.commands)
    if released:
        yield from released[:1]
        return
    orders = search.at(GROUND_ORDER, found.t_ns, lambda given: ordered(given) == sent.order)
    yield from orders[:1]


def ordered(given: OrderGiven) -> object:
    """The order in what the operator gave; `None` if it was none."""
    if isinstance(given.act, Planned):
        return given.act.order
    return None if isinstance(given.act, Discard) else given.act


def held(search: Search, found: Found[HeldEntry]) -> Iterator[_Any]:
    """The order that was held, or had it given up; and what let it be sent."""
    entry = found.message
    match entry.fate:
        case HeldFate.HELD:
            orders = search.at(
                GROUND_ORDER, found.t_ns, lambda given: ordered(given) == entry.orders[-1]
            )
            yield from orders[-1:]
        case HeldFate.GIVEN_UP:
            yield from search.at(
                GROUND_ORDER, found.t_ns, lambda given: given.act == Discard(entry.number)
            )[:1]
        case HeldFate.RELEASED:
            silence_ended = search.last(GROUND_SILENCE, found.t_ns)
            before = search.last(
                GROUND_HELD,
                found.t_ns - 1,
                lambda one: one.number == entry.number and one.fate is HeldFate.HELD,
            )
            if before is not None:
                yield before
            if silence_ended is not None and not silence_ended.message.silent:
                yield silence_ended


def order(search: Search, found: Found[OrderGiven]) -> Iterator[_Any]:
    """The proposal that it answers. Any other order has nothing before it but the operator."""
    given = ordered(found.message)
    if isinstance(given, Approve | Override | Veto):
        number = given.proposal
        answered = search.last(
            GROUND_PROPOSAL, found.t_ns, lambda proposal: proposal.number == number
        )
        if answered is not None:
            yield answered


def review(search: Search, found: Found[Review]) -> Iterator[_Any]:
    """The order that answers the proposal."""
    number = found.message.proposal
    answers = search.at(
        GROUND_ORDER,
        found.t_ns,
        lambda given: getattr(ordered(given), "proposal", None) == number,
    )
    yield from answers[:1]


def received(
    search: Search, found: Found[EventLearned] | Found[Proposal] | Found[Telemetry]
) -> Iterator[_Any]:
    """The frame that brought it."""
    match found.message:
        case EventLearned(event=event):
            kind, number = "event", event.number
        case Proposal(number=number):
            kind = "proposal"
        case Telemetry(time_ns=number):
            kind = "telemetry"
    yield from brought(
        search,
        Direction.DOWN,
        kind,
        found.t_ns,
        lambda one: number == (one.time_ns if kind == "telemetry" else one.number),
    )


def silence(search: Search, found: Found[Silence]) -> Iterator[_Any]:
    """What explains it; or the frame that ended it."""
    explained = silences.explain(search, Direction.DOWN, found.t_ns)
    if found.message.silent or found.message.expected:
        yield from explained.outages or explained.losses
    yield from came(search, explained.heard)


def life(search: Search, found: Found[LifeEntry]) -> Iterator[_Any]:
    """The word of it that came, or the command of which no word came."""
    entry = found.message
    if entry.verdict in {Verdict.ON_TIME, Verdict.LATE}:
        told = search.at(
            GROUND_EVENT,
            found.t_ns,
            lambda known: (
                isinstance(known.event.what, CommandReached)
                and known.event.what.number == entry.number
            ),
        )
        yield from told[:1] or search.at(GROUND_TELEMETRY, found.t_ns)[:1]
    else:
        sent = search.last(GROUND_COMMAND, found.t_ns, lambda one: one.number == entry.number)
        if sent is not None:
            yield sent


def shadow(search: Search, found: Found[ShadowEntry]) -> Iterator[_Any]:
    """The frame that brought the update."""
    number = found.message.number
    yield from brought(
        search, Direction.DOWN, "model", found.t_ns, lambda one: one.number == number
    )


_NEWS: tuple[Topic[Any], ...] = (
    GROUND_EVENT,
    GROUND_PROPOSAL,
    GROUND_TELEMETRY,
    GROUND_STORED_TELEMETRY,
)


def follows_news(search: Search, found: _Any) -> Iterator[_Any]:
    """What the ground learned at that moment."""
    for topic in _NEWS:
        if news := search.at(topic, found.t_ns):
            yield news[-1]
            return
