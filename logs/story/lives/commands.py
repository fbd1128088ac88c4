"""The story of a command: from the order to the effect, and to the ground knowing of it."""

from collections.abc import Iterator

from farside.control import CommandStage
from farside.logs.events import order_text, time_text, when_text
from farside.logs.known import KnownCommands
from farside.logs.story.causes.at_ground import ordered
from farside.logs.story.lives.journey import Key, Line, journeys, kept_back, learned_text
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import act_text, event_text, seconds, sentence
from farside.logs.story.subjects import SubjectError
from farside.messages import ACTS, Approve, CommandForced, CommandReached, Override, Veto
from farside.node import NEVER_NS, Role
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_HELD,
    GROUND_LIFE,
    GROUND_ORDER,
    GROUND_REVIEW,
    GROUND_TELEMETRY,
    ROVER_ACTION_ENDED,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
    EventLearned,
    HeldFate,
)

_PAST = {
    CommandStage.TAKEN: "that it arrived",
    CommandStage.BEGUN: "that it began",
    CommandStage.DONE: "that it was done",
}


def sent_command(search: Search, number: int) -> Found[CommandSent]:
    """Where the ground gave a command.

    Raises:
        SubjectError: if it gave none of this number.
        LogError: if the log is damaged.
    """
    sent = search.first(GROUND_COMMAND, lambda one: one.number == number)
    if sent is not None:
        return sent
    last = search.last(GROUND_COMMAND, NEVER_NS)
    there = "the ground gave none"
    if last is not None:
        there = f"the ground gave commands 1 to {last.message.number}"
    raise SubjectError(f"there is no command {number}: {there}")


def command_story(search: Search, number: int) -> tuple[str, list[Line]]:
    """The title of a command's story, and its lines in any order.

    Raises:
        SubjectError: as `sent_command`.
        LogError: if the log is damaged.
    """
    sent = sent_command(search, number)
    stages = _stages(search, number, sent.t_ns)
    told = _told(search, number, sent.t_ns)
    over_ns = max(
        [one.t_ns for one in stages if one.message.stage.is_last]
        + [one.t_ns for one in told if _is_end(one)],
        default=NEVER_NS,
    )
    lines = [*given(search, sent)]
    taken_ns = stages[0].t_ns if stages else over_ns
    itself: dict[Key, str] = {("command", number): f"command {number}"}
    crossed = list(journeys(search.log, itself, sent.t_ns, taken_ns))
    lines += [*crossed, *_on_board(search, sent, stages, crossed)]
    events: dict[Key, str] = {("event", one.message.event.number): _word_of(one) for one in told}
    if events:
        lines += journeys(search.log, events, taken_ns if stages else sent.t_ns, over_ns)
    lines += (Line(one.t_ns, Role.GROUND, _learns(one)) for one in told)
    lines += _verdicts(search, number, sent.t_ns, over_ns)
    order = f"{order_text(sent.message.order)}{when_text(sent.message.when)}"
    return f"command {number}: {order}{_ending(search, number, stages, told)}", lines


def _stages(search: Search, number: int, since_ns: int) -> list[Found[CommandEntry]]:
    stages = []
    for one in search.each(ROVER_COMMAND, start_ns=since_ns):
        if one.message.number == number:
            stages.append(one)
            if one.message.stage.is_last:
                break
    return stages


def _told(search: Search, number: int, since_ns: int) -> list[Found[EventLearned]]:
    told = []
    for one in search.each(GROUND_EVENT, start_ns=since_ns):
        what = one.message.event.what
        if isinstance(what, CommandReached | CommandForced) and what.number == number:
            told.append(one)
            if _is_end(one):
                break
    return told


def _is_end(learned: Found[EventLearned]) -> bool:
    what = learned.message.event.what
    return isinstance(what, CommandReached) and what.stage.is_last


def _word_of(learned: Found[EventLearned]) -> str:
    what = learned.message.event.what
    stage = what.stage if isinstance(what, CommandReached) else CommandStage.BEGUN
    return f"event {learned.message.event.number} (it is {stage})"


# --- at the ground ----------------------------------------------------------------------------


def given(search: Search, sent: Found[CommandSent]) -> Iterator[Line]:
    """How a command came to be given: the order, its waiting at the ground, and the plan."""
    message, t_ns = sent.message, sent.t_ns
    released = search.at(GROUND_HELD, t_ns, lambda held: message.number in held.commands)
    if released:
        holding = released[0].message.number
        held = search.last(
            GROUND_HELD,
            t_ns,
            lambda one: (
                one.number == holding and one.fate is HeldFate.HELD and message.order in one.orders
            ),
        )
        first = held
        while held is not None and held.t_ns > 0:
            first = held
            held = search.last(
                GROUND_HELD,
                held.t_ns - 1,
                lambda one: one.number == holding and message.order in one.orders,
            )
        if first is not None:
            yield from _order(search, first.t_ns, message.order)
            wait = seconds(t_ns - first.t_ns)
            text = f"the link is up: it is sent after {wait} of waiting at the ground"
            yield Line(t_ns, Role.GROUND, text)
    else:
        yield from _order(search, t_ns, message.order)
    dues = {due.stage: due.expected_ns for due in message.dues}
    text = f"command {message.number} is given"
    if CommandStage.TAKEN in dues:
        text += f", to arrive at {time_text(dues[CommandStage.TAKEN])}"
    if isinstance(message.order, ACTS) and CommandStage.DONE in dues:
        text += f" and be done at {time_text(dues[CommandStage.DONE])} by plan"
    if message.expires_ns < NEVER_NS:
        text += f"; it may begin until {time_text(message.expires_ns)}"
    yield Line(t_ns, Role.GROUND, text)


def _order(search: Search, t_ns: int, order: object) -> Iterator[Line]:
    """The order; for an answer to a proposal, what was found of its path."""
    orders = search.at(GROUND_ORDER, t_ns, lambda one: ordered(one) == order)
    if isinstance(order, Approve | Override | Veto):
        number = order.proposal
        reviews = search.at(GROUND_REVIEW, t_ns, lambda one: one.proposal == number)
        if reviews:
            yield Line(t_ns, Role.GROUND, sentence(reviews[0].entry))
            return
    if orders:
        yield Line(t_ns, Role.GROUND, act_text(orders[0].message.act))


def _verdicts(search: Search, number: int, since_ns: int, until_ns: int) -> Iterator[Line]:
    """What the ground concluded from hearing nothing, or hearing late."""
    known = KnownCommands()
    for one in search.each(GROUND_COMMAND, start_ns=since_ns, end_ns=since_ns):
        known.apply(one.message, one.t_ns)
    for life in search.each(GROUND_LIFE, start_ns=since_ns, end_ns=until_ns):
        if life.message.number != number:
            continue
        if known.says_news(life.message) and (text := event_text(life.entry)):
            yield Line(life.t_ns, Role.GROUND, text)
        known.apply(life.message, life.t_ns)


def _learns(learned: Found[EventLearned]) -> str:
    event, what = learned.message.event, learned.message.event.what
    if isinstance(what, CommandForced):
        text = f"that it began although {what.why}"
    elif isinstance(what, CommandReached):
        text = _PAST.get(what.stage, f"that it was {what.stage}")
        text += f" ({what.why})" if what.why else ""
    return learned_text(text, event.time_ns, learned.t_ns)


# --- on board ---------------------------------------------------------------------------------


def _on_board(
    search: Search,
    sent: Found[CommandSent],
    stages: list[Found[CommandEntry]],
    crossed: list[Line],
) -> Iterator[Line]:
    """Every stage on board, and what it waited for."""
    before: Found[CommandEntry] | None = None
    number = sent.message.number
    for one in stages:
        stage = one.message.stage
        text = sentence(one.entry)
        if stage is CommandStage.TAKEN:
            text = f"command {number} is taken{kept_back(crossed, Role.ROVER, one.t_ns)}"
        elif stage is CommandStage.WAITING:
            before = one
            continue
        elif stage is CommandStage.BEGUN:
            text = f"command {number} begins{_waited(search, sent.message, before, one.t_ns)}"
            text += f", although {one.message.why}" if one.message.why else ""
        elif stage is CommandStage.DONE:
            text = f"command {number} is done{_lasted(search, sent.message, one.t_ns)}"
        yield Line(one.t_ns, Role.ROVER, text)
    if before is not None and stages[-1] is before:
        text = f"command {number} waits on board{when_text(sent.message.when)}"
        yield Line(before.t_ns, Role.ROVER, text)


def _waited(
    search: Search, sent: CommandSent, waiting: Found[CommandEntry] | None, t_ns: int
) -> str:
    if waiting is None or waiting.t_ns >= t_ns:
        return ""
    text = f" after {seconds(t_ns - waiting.t_ns)}"
    if sent.when is not None:
        return f"{text} of waiting on board{when_text(sent.when)}"
    if search.at(ROVER_ACTION_ENDED, t_ns):
        return f"{text} of waiting for the rover to end its move"
    return f"{text} of waiting on board"


def _lasted(search: Search, sent: CommandSent, t_ns: int) -> str:
    if not isinstance(sent.order, ACTS):
        return ""
    ended = search.at(ROVER_ACTION_ENDED, t_ns)
    if not ended:
        return ""
    return f": {ended[0].message.action} took {ended[0].message.duration_s:.2f} s"


def _ending(
    search: Search,
    number: int,
    stages: list[Found[CommandEntry]],
    told: list[Found[EventLearned]],
) -> str:
    """How it ended, for the title."""
    if stages and stages[-1].message.stage.is_last:
        end = stages[-1]
        text = f" - {end.message.stage} at {time_text(end.t_ns)}"
        text += f": {end.message.why}" if end.message.why else ""
    elif told and _is_end(told[-1]):
        what, event = told[-1].message.event.what, told[-1].message.event
        text = f" - {what.stage} at {time_text(event.time_ns)}"  # type: ignore[union-attr]
    elif search.log.is_as_ground:
        over = search.first(GROUND_TELEMETRY, lambda one: one.commands_done >= number)
        return " - over, but not known how" if over is not None else " - not known to be over"
    elif stages:
        return f" - {stages[-1].message.stage} at the end of the log"
    else:
        return " - never arrived"
    if not (told and _is_end(told[-1])):
        return f"{text}, which the ground never learned"
    return f"{text}, known at the ground at {time_text(told[-1].t_ns)}"
