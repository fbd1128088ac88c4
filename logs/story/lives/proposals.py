"""The stories of a proposal and of an event: made on board, and on their way to the ground."""

from collections.abc import Iterator

from farside.control import Chooser
from farside.logs.events import sign_text, time_text
from farside.logs.story.causes.crossing import happened
from farside.logs.story.lives.commands import command_story
from farside.logs.story.lives.journey import Key, Line, journeys, kept_back, learned_text
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import arc_text, sentence
from farside.logs.story.subjects import SubjectError
from farside.messages import Approve, Override, Proposal, Veto
from farside.node import NEVER_NS, Role
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_PROPOSAL,
    ROVER_COMMAND,
    ROVER_DECISION,
    ROVER_FRAME,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    Decision,
    ProposalEnded,
    reasons,
)


def proposal_story(search: Search, number: int) -> tuple[str, list[Line]]:
    """The title of a proposal's story, and its lines in any order.

    Raises:
        SubjectError: if there is none of this number, or the ground cannot have known of it.
        LogError: if the log is damaged.
    """
    topic = GROUND_PROPOSAL if search.log.is_as_ground else ROVER_PROPOSAL
    made = search.first(topic, lambda one: one.number == number)
    if made is None:
        last = search.last(topic, NEVER_NS)
        who = "the ground received" if search.log.is_as_ground else "the rover made"
        there = f"{who} none" if last is None else f"{who} proposals up to {last.message.number}"
        raise SubjectError(f"there is no proposal {number}: {there}")
    proposal = made.message
    ended = search.first(ROVER_PROPOSAL_ENDED, lambda one: one.number == number, start_ns=made.t_ns)
    lines = list(_made(search, proposal))
    received = search.first(
        GROUND_PROPOSAL, lambda one: one.number == number, start_ns=proposal.time_ns
    )
    until_ns = max(
        ended.t_ns if ended is not None else NEVER_NS,
        received.t_ns if received is not None else 0,
    )
    names: dict[Key, str] = {
        ("proposal", number): f"proposal {number}",
        ("shown", number): f"word that the operator was shown proposal {number}",
    }
    crossed = list(journeys(search.log, names, proposal.time_ns, until_ns))
    lines += crossed
    if received is not None:
        text = learned_text(f"of proposal {number}, made", proposal.time_ns, received.t_ns)
        text += kept_back(crossed, Role.GROUND, received.t_ns)
        lines.append(Line(received.t_ns, Role.GROUND, text))
        lines += _answers(search, number, received.t_ns)
    if ended is not None:
        how = _end(search, ended)
        lines.append(Line(ended.t_ns, Role.ROVER, f"proposal {number} ends: {how}"))
    title = f"proposal {number}: {proposal.action}, towards {sign_text(proposal.goal)}"
    if ended is not None:
        title += f" - ended at {time_text(ended.t_ns)}: {_end(search, ended)}"
    elif received is None:
        title += " - never arrived at the ground"
    return title, lines


def _end(search: Search, ended: Found[ProposalEnded]) -> str:
    """Why it ended; of a command in between that answers it, what that says."""
    number, why = reasons.CAME_BETWEEN.number_in(ended.message.why), ended.message.why
    if number is None:
        return why
    answer = search.last(ROVER_COMMAND, ended.t_ns, lambda one: one.number == number)
    match None if answer is None else answer.message.order:
        case Approve(proposal=proposal) if proposal == ended.message.number:
            return f"approved by command {number}"
        case Override(proposal=proposal) if proposal == ended.message.number:
            return f"overridden by command {number}"
        case _:
            return why


def _made(search: Search, proposal: Proposal) -> Iterator[Line]:
    t_ns, number = proposal.time_ns, proposal.number
    if search.log.is_as_ground:
        return
    for decision in search.at(ROVER_DECISION, t_ns, lambda one: one.proposal == number):
        yield Line(t_ns, Role.ROVER, sentence(decision.entry))
        yield from (Line(t_ns, Role.ROVER, text) for text in behind(decision.message))
    if proposal.veto_window_s is not None:
        text = f"without a veto it is carried out {proposal.veto_window_s:g} s after it was shown"
        yield Line(t_ns, Role.ROVER, text)


def behind(decision: Decision) -> Iterator[str]:
    """The hypothesis behind a decision, the runner-up and the margin, as far as there are any."""
    if decision.chooser is Chooser.RETURNING:
        yield "it goes back along its own track"
    elif decision.behind is None:
        yield f"no hypothesis about {decision.action} here: it is not known what it leads to"
    else:
        yield f"because {arc_text(decision.behind)}"
    if decision.runner_up is not None:
        text = f"the runner-up is {arc_text(decision.runner_up)}"
        yield text + (f", {decision.margin:.1f} s dearer" if decision.margin is not None else "")
    elif decision.goal is not None and decision.behind is not None:
        yield "no other action is known to lead there"


def _answers(search: Search, number: int, since_ns: int) -> Iterator[Line]:
    """The stories of the commands that answer it."""
    for sent in search.each(GROUND_COMMAND, start_ns=since_ns):
        order = sent.message.order
        if isinstance(order, Approve | Override | Veto) and order.proposal == number:
            yield from command_story(search, sent.message.number)[1]
            return


def event_story(search: Search, number: int) -> tuple[str, list[Line]]:
    """The title of an event's story, and its lines in any order.

    Raises:
        SubjectError: as `proposal_story`.
        LogError: if the log is damaged.
    """
    learned = search.first(GROUND_EVENT, lambda one: one.event.number == number)
    if learned is None and not search.log.is_as_ground:
        return _never_learned(search, number)
    if learned is None:
        last = search.last(GROUND_EVENT, NEVER_NS)
        there = "none" if last is None else f"events up to {last.message.event.number}"
        raise SubjectError(f"there is no event {number}: the ground learned of {there}")
    event = learned.message.event
    lines = [Line(one.t_ns, Role.ROVER, sentence(one.entry)) for one in happened(search, event)]
    names: dict[Key, str] = {("event", number): f"event {number}"}
    crossed = list(journeys(search.log, names, event.time_ns, learned.t_ns))
    lines += crossed
    text = learned_text(f"of event {number}, which was so", event.time_ns, learned.t_ns)
    text += kept_back(crossed, Role.GROUND, learned.t_ns)
    lines.append(Line(learned.t_ns, Role.GROUND, text))
    what = sentence(learned.entry).split(": ", 1)[-1]
    known = f"so at {time_text(event.time_ns)}, known at the ground at {time_text(learned.t_ns)}"
    return f"event {number}: {what} - {known}", lines


def _never_learned(search: Search, number: int) -> tuple[str, list[Line]]:
    """Of an event that did not arrive, the log holds the frames that should have brought it."""

    def is_it(one: object) -> bool:
        return getattr(one, "kind", None) == "event" and getattr(one, "number", None) == number

    made = search.first(ROVER_FRAME, lambda frame: any(map(is_it, frame.carries)))
    if made is None:
        last = search.last(GROUND_EVENT, NEVER_NS)
        there = "none" if last is None else f"events up to {last.message.event.number}"
        raise SubjectError(f"there is no event {number}: the ground learned of {there}")
    names: dict[Key, str] = {("event", number): f"event {number}"}
    lines = list(journeys(search.log, names, made.t_ns, NEVER_NS))
    so_ns = made.message.carries[0].time_ns or made.t_ns
    return f"event {number} of {time_text(so_ns)} - never arrived at the ground", lines
