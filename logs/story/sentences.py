"""A sentence for every record that a chain of causes or a story may name.

What `farside.logs.events` has a line for is told in the same words; the rest is told here.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from farside.acts import Act, Discard, Planned
from farside.control import CommandStage
from farside.frames import FrameEvent, FrameFate, FrameHop, FrameStage
from farside.logs.events import event_line, order_text, sign_text, time_text, when_text
from farside.logs.file.reading import LogEntry
from farside.logs.spacetime import cargo_text, lost_to
from farside.messages import CommandReached, Proposal, Telemetry, Tokens
from farside.node import to_s
from farside.topics import (
    GROUND_PROPOSAL,
    GROUND_STORED_TELEMETRY,
    ActionEnded,
    ActionStarted,
    Answer,
    Arc,
    CommandEntry,
    CommandSent,
    Cycle,
    Decision,
    EventLearned,
    LifeEntry,
    ModelSent,
    OperatorEntry,
    OrderGiven,
    PolicyMapEntry,
    ProposalEnded,
    Review,
    ShadowEntry,
    StuckEntry,
)
from farside.validation import one_line

_LENGTH = 400
_SHORT_S = 0.0995

_STAGES = {
    CommandStage.TAKEN: "arrives on board",
    CommandStage.WAITING: "waits until the rover stands still and its turn has come",
    CommandStage.BEGUN: "begins",
    CommandStage.DONE: "is done",
}

_ANSWERED = {
    Answer.APPROVED: "approves",
    Answer.OVERRIDDEN: "overrides",
    Answer.VETOED: "vetoes",
}


def seconds(duration_ns: int) -> str:
    """A duration for people, such as `1.28 s`: tenths from a minute on, ms below a tenth."""
    duration_s = to_s(duration_ns)
    if 0 < duration_s < _SHORT_S:
        return f"{duration_s * 1000:.2g} ms"
    return f"{duration_s:.2f} s" if abs(duration_s) < 60 else f"{duration_s:.1f} s"


def frame_text(direction: str, sequence: int) -> str:
    """A frame's name, as `farside story` takes it."""
    return f"frame {direction}:{sequence}"


def sentence(entry: LogEntry) -> str:
    """What a record says, in a sentence fit for one line of a terminal."""
    finder = _SENTENCES.get(type(entry.message))
    text = None if finder is None else finder(entry.message, entry)
    return one_line(text or event_text(entry) or f"{entry.topic} is recorded", _LENGTH)


def event_text(entry: LogEntry) -> str:
    """The text of a record's event line, empty without one."""
    line = event_line(entry)
    return "" if line is None else line.text


def act_text(act: Act) -> str:
    """What the operator gives, as the operator means it."""
    match act:
        case Discard(held=held):
            return f"the operator gives up what is held under {held}"
        case Planned(order=order) as planned:
            text = f"the operator orders: {order_text(order)}"
            text += ", after the order before it" if planned.follows else ""
            if planned.at_ns is not None:
                text += f", not before {time_text(planned.at_ns)}"
            return text + (", once the link is up" if planned.link_up else "")
        case _:
            return f"the operator orders: {order_text(act)}"


def started_text(started: ActionStarted) -> str:
    """An action that begins, who chose it, and for what."""
    text = f"{started.action} begins, {started.chooser}"
    if started.goal is not None:
        text += f", {towards(started.goal)}"
    return text + (f", by command {started.command}" if started.command is not None else "")


def towards(goal: Tokens) -> str:
    """A goal, to follow an action."""
    return f"towards {sign_text(goal)}"


def decision_text(decision: Decision) -> str:
    """What was decided, by whom and for what; the hypotheses behind it are another matter."""
    text = f"decides on {decision.action}, {decision.chooser}"
    if decision.goal is not None:
        text += f", {towards(decision.goal)}"
    if decision.proposal is not None:
        return f"{text}, and puts it before the operator as proposal {decision.proposal}"
    return text + (f", by command {decision.command}" if decision.command is not None else "")


def arc_text(arc: Arc) -> str:
    """A hypothesis with what is believed of it: `at:D ∧ N → at:5,4 (C_m 0.50, 44.3 s to go)`."""
    text = f"{sign_text(arc.context)} ∧ {one_line(arc.action)} → {sign_text(arc.outcome)}"
    to_go = "" if arc.cost_to_go is None else f", cost to go {arc.cost_to_go:.1f} s"
    return f"{text} (C_m {arc.cm:.2f}{to_go})"


def fate_text(fate: FrameFate, what: str = "", hops: Sequence[FrameHop] = ()) -> str:
    """What became of a frame in the channel, and how long each part of its way took.

    Args:
        fate: what became of it.
        what: what was in it.
        hops: what became of it at each node, on a way by other nodes.
    """
    name = frame_text(fate.direction, fate.sequence) + (f" with {what}" if what else "")
    if fate.arrival_ns is None:
        where = f" at node {hops[-1].node}" if hops and hops[-1].fate is not None else ""
        return f"{name} was {lost_to(fate)}{where}, sent at {time_text(fate.queued_ns)}"
    legs = legs_text(fate, hops)
    return f"{name} arrives after {seconds(fate.arrival_ns - fate.queued_ns)}: {legs}"


def legs_text(fate: FrameFate, hops: Sequence[FrameHop] = ()) -> str:
    """How long a frame waited in the transmit queue, took to send, and was under way."""
    legs = []
    if fate.sent_ns > fate.queued_ns:
        legs.append(f"{seconds(fate.sent_ns - fate.queued_ns)} in the transmit queue")
    legs.append(f"{seconds(fate.sent_end_ns - fate.sent_ns)} to send")
    if fate.arrival_ns is not None:
        how = "of light time"
        if len(hops) > 1:
            nodes = [str(hop.node) for hop in hops[1:]]
            how = f"by way of {'node' if len(nodes) == 1 else 'nodes'} {', '.join(nodes)}"
        legs.append(f"{seconds(fate.arrival_ns - fate.sent_end_ns)} {how}")
    return ", ".join(legs)


# --- one for each type ------------------------------------------------------------------------


def _command_sent(sent: CommandSent, _entry: LogEntry) -> str:
    return f"command {sent.number} is given: {order_text(sent.order)}{when_text(sent.when)}"


def _command(command: CommandEntry, _entry: LogEntry) -> str | None:
    if command.why is not None or command.stage not in _STAGES:
        return None
    return f"command {command.number} ({order_text(command.order)}) {_STAGES[command.stage]}"


def _review(review: Review, _entry: LogEntry) -> str:
    text = f"the operator {_ANSWERED[review.answer]} proposal {review.proposal} ({review.action})"
    conflicts = "; ".join(review.review.conflicts)
    return f"{text}, although {conflicts}" if conflicts else text


def _ended(ended: ActionEnded, _entry: LogEntry) -> str | None:
    return None if ended.blocked else f"{ended.action} ends after {ended.duration_s:.1f} s"


def _proposal(proposal: Proposal, entry: LogEntry) -> str:
    if entry.topic == GROUND_PROPOSAL.name:
        return f"the ground receives proposal {proposal.number} ({proposal.action})"
    return f"proposal {proposal.number} is made: {proposal.action}, {towards(proposal.goal)}"


def _proposal_ended(ended: ProposalEnded, _entry: LogEntry) -> str:
    return f"proposal {ended.number} ends: {ended.why}"


def _learned(learned: EventLearned, _entry: LogEntry) -> str | None:
    event = learned.event
    if not isinstance(event.what, CommandReached):
        return None
    how = _STAGES.get(event.what.stage, str(event.what.stage))
    text = f"learns of {time_text(event.time_ns)}: command {event.what.number} {how}"
    return f"{text}: {event.what.why}" if event.what.why else text


def _life(life: LifeEntry, entry: LogEntry) -> str:
    if life.stage is None:
        return f"the chance to take command {life.number} back changes"
    return event_text(entry) or f"command {life.number} {life.stage}: {life.verdict}"


def _telemetry(telemetry: Telemetry, entry: LogEntry) -> str:
    stored = "stored " if entry.topic == GROUND_STORED_TELEMETRY.name else ""
    return f"the ground receives {stored}telemetry of {time_text(telemetry.time_ns)}"


def _stuck(stuck: StuckEntry, entry: LogEntry) -> str | None:
    return "the rover can move" if entry.log_time_ns == 0 and not stuck.stuck else None


def _cycle(cycle: Cycle, _entry: LogEntry) -> str:
    return f"the rover senses {sign_text(cycle.tokens) or 'nothing'}"


def _policy_map(entry: PolicyMapEntry, _entry: LogEntry) -> str:
    if entry.goal is None:
        return "there is no top-goal any more"
    return f"{sign_text(entry.goal)} is the top-goal; {len(entry.places)} Signs can reach it"


def _model_sent(sent: ModelSent, _entry: LogEntry) -> str:
    return f"update {sent.number} of the model is made"


def _shadow(shadow: ShadowEntry, _entry: LogEntry) -> str | None:
    in_step = f"the shadow takes update {shadow.number} of the model"
    return in_step if shadow.in_step else None


def _operator(operator: OperatorEntry, _entry: LogEntry) -> str:
    if operator.waiting_for is None:
        return "the operator's script is over"
    return f"the operator waits for {operator.waiting_for}"


def _frame_event(event: FrameEvent, _entry: LogEntry) -> str:
    name = frame_text(event.direction, event.sequence)
    match event.stage:
        case FrameStage.MADE:
            text = f"{name} is sent, with {cargo_text(event)}"
        case FrameStage.SHADOWED:
            text = f"{name} is lost in terrain shadow"
        case FrameStage.REFUSED:
            text = f"{name} is refused by the receiver: {event.what}"
        case FrameStage.USED:
            text = f"{name} brings {cargo_text(event)}"
    return text


_SENTENCES: Mapping[type[msgspec.Struct], Callable[[Any, LogEntry], str | None]] = {
    OrderGiven: lambda given, _entry: act_text(given.act),
    CommandSent: _command_sent,
    CommandEntry: _command,
    Review: _review,
    FrameFate: lambda fate, _entry: fate_text(fate),
    FrameEvent: _frame_event,
    ActionStarted: lambda started, _entry: started_text(started),
    ActionEnded: _ended,
    Decision: lambda decision, _entry: decision_text(decision),
    Proposal: _proposal,
    ProposalEnded: _proposal_ended,
    EventLearned: _learned,
    LifeEntry: _life,
    Telemetry: _telemetry,
    StuckEntry: _stuck,
    Cycle: _cycle,
    PolicyMapEntry: _policy_map,
    ModelSent: _model_sent,
    ShadowEntry: _shadow,
    OperatorEntry: _operator,
}
"""What a message says where `event_line` has nothing, or says it too shortly to stand alone."""
