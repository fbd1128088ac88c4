"""Every command on its way, the proposal that stands, and what could be ordered."""

from collections.abc import Iterator, Mapping

from farside.acts import Act, Discard, Planned
from farside.console.screen.mapping import place_text, spots_of
from farside.console.screen.screen import CommandRow, OptionRow, ProposalCard, Said, Tone
from farside.console.wording import percent, span_text
from farside.control import CommandStage, Mode, TakeBackChance
from farside.ground.view.view import GroundView, Option
from farside.logs.events import order_text
from farside.logs.known import KnownCommand, KnownCommands, command_text
from farside.logs.picture import Picture
from farside.messages import ACTS, Approve, Order, Override, TakeBack, Veto
from farside.node import to_s
from farside.places import Chart
from farside.topics import PathReview

_ROWS = 40
_ENDED_BADLY = {CommandStage.FAILED, CommandStage.REFUSED, CommandStage.EXPIRED}
_ANSWERS = {Approve: "approved", Override: "overridden", Veto: "vetoed"}


def order_of(act: Act) -> Order | None:
    """The order in an act; `None` of one that gives up what is held."""
    match act:
        case Planned(order=order):
            return order
        case Discard():
            return None
        case _:
            return act


def nothing_said(view: GroundView, waiting: int) -> str:
    """What happens if the person does nothing, with so many orders that wait here."""
    if not waiting:
        return f"If you do nothing: {view.if_nothing}."
    orders = "the order that waits here goes" if waiting == 1 else f"{waiting} orders go"
    return (
        f"If you do nothing: {orders} out when time goes on. The cues leave that out yet, and so "
        f"does this: {view.if_nothing}."
    )


def act_text(act: Act) -> str:
    """An act for people, such as `drive N`."""
    order = order_of(act)
    return "give up what is held" if order is None else order_text(order)


# --- on the way --------------------------------------------------------------------------------


def command_rows(
    commands: KnownCommands, queued: Mapping[int, Act], now_ns: int
) -> tuple[CommandRow, ...]:
    """The commands, newest first: what waits here, what is on the way, and the last that ended."""
    return tuple(_rows(commands, queued, now_ns))[:_ROWS]


def _rows(commands: KnownCommands, queued: Mapping[int, Act], now_ns: int) -> Iterator[CommandRow]:
    for waiting, act in reversed(list(queued.items())):
        text = act_text(act)
        yield CommandRow(
            0, text, ("goes out when time goes on",), Tone.PLAIN, can_take_back=True, held=-waiting
        )
    for number, orders in reversed(commands.held.items()):
        text = ", then ".join(map(order_text, orders))
        yield CommandRow(
            0,
            text,
            ("held at the ground until the link is up",),
            Tone.CAUTION,
            can_take_back=True,
            held=number,
        )
    for command in commands.foremost(_ROWS):
        yield _row(command, commands, now_ns)


def _row(command: KnownCommand, commands: KnownCommands, now_ns: int) -> CommandRow:
    effect = command.stages.get(
        CommandStage.BEGUN if isinstance(command.order, ACTS) else CommandStage.DONE
    )
    due = None if effect is None or effect.told_ns is not None else effect.due
    until_ns = command.take_back_until_ns if command.take_back is TakeBackChance.SURE else None
    return CommandRow(
        number=command.number,
        text=command_text(command),
        words=tuple(command.words(now_ns)),
        tone=_tone(command),
        is_over=command.is_over,
        begins_ns=None if due is None or command.is_over else due.expected_ns,
        seen_ns=None if due is None or command.is_over else due.told_due_ns,
        take_back_until_ns=None if command.is_over else until_ns,
        can_take_back=can_take_back(command, commands),
    )


def can_take_back(command: KnownCommand, commands: KnownCommands) -> bool:
    """Whether a take-back can still be tried, and none is on its way."""
    others = (other.order for other in commands.open.values())
    return (
        not command.is_over
        and command.take_back is not TakeBackChance.TOO_LATE
        and not isinstance(command.order, TakeBack)
        and not any(isinstance(o, TakeBack) and o.number == command.number for o in others)
    )


def _tone(command: KnownCommand) -> Tone:
    if command.is_overdue:
        return Tone.WRONG
    return (
        Tone.CAUTION
        if command.end in _ENDED_BADLY or command.is_late or command.lapses
        else Tone.PLAIN
    )


# --- the proposal ------------------------------------------------------------------------------


def proposal_card(
    picture: Picture, view: GroundView, queued: Mapping[int, Act]
) -> ProposalCard | None:
    """The proposal that stands, with what the ground finds of it; `None` where none does."""
    proposal, review = picture.proposal, view.review
    if proposal is None or review is None or review.proposal != proposal.number:
        return None
    answered = answer_text(picture, queued, proposal.number)
    left_s = None
    if view.veto_until_ns is not None:
        left_s = max(0.0, to_s(view.veto_until_ns - view.now_ns))
    return ProposalCard(
        number=proposal.number,
        action=proposal.action,
        title=f"Proposal {proposal.number}: {proposal.action}, towards {place_text(review.goal)}",
        facts=tuple(_facts(review)),
        conflicts=review.conflicts,
        runner_up=_runner_up(review),
        answered=answered,
        veto_left_s=left_s,
        veto_window_s=proposal.veto_window_s,
        can_answer=not answered and view.silent_since_ns is None,
    )


def answer_text(picture: Picture, queued: Mapping[int, Act], number: int) -> str:
    """How a proposal was answered, in words; empty while it is not, or that came to nothing."""
    for act in queued.values():
        order = order_of(act)
        if isinstance(order, Approve | Override | Veto) and order.proposal == number:
            return f"{_ANSWERS[type(order)]}, goes out when time goes on"
    for command in reversed(picture.commands.open.values()):
        order = command.order
        if isinstance(order, Approve | Override | Veto) and order.proposal == number:
            what = next(command.words(picture.now_ns), "")
            return f"{_ANSWERS[type(order)]} by command {command.number}, {what}"
    return ""


def _facts(review: PathReview) -> Iterator[Said]:
    yield Said("", f"{review.cost_to_go:.1f} s to go")
    if review.chance is not None:
        yield Said("as planned", percent(review.chance))
    if review.probability is not None:
        yield Said("product of C_m", percent(review.probability))
    yield Said("made", f"{span_text(round(review.age_s * 1e9))} ago")
    if not review.in_step:
        yield Said("", "from lists that the ground does not hold", Tone.CAUTION)


def _runner_up(review: PathReview) -> str:
    if review.runner_up is None:
        return ""
    dearer = "" if review.margin is None else f", {review.margin:.1f} s dearer"
    return f"runner-up {review.runner_up}{dearer}"


# --- what could be ordered ---------------------------------------------------------------------


def option_rows(
    picture: Picture, view: GroundView, card: ProposalCard | None, chart: Chart
) -> tuple[OptionRow, ...]:
    """Every action with what choosing it orders, and what is found of it."""
    return tuple(_option(option, picture, card, chart) for option in view.options)


def _option(option: Option, picture: Picture, card: ProposalCard | None, chart: Chart) -> OptionRow:
    return OptionRow(
        action=option.action,
        kind=option.kind,
        severity=option.severity,
        does=choice_text(option.action, picture, card),
        why="; ".join(option.why),
        spots=spots_of(option.likely, chart),
    )


def choice_text(action: str, picture: Picture, card: ProposalCard | None) -> str:
    """What choosing an action orders: an answer where a proposal waits for one, or a drive."""
    if card is not None and card.can_answer:
        if card.action == action:
            return f"approves proposal {card.number}: {action}"
        return f"overrides proposal {card.number} with {action}"
    behind = [c.number for c in picture.commands.open.values() if not c.is_over and _acts(c)]
    text = f"drives {action}" + (f" after command {behind[-1]}" if behind else "")
    if picture.mode is Mode.AUTONOMOUS:
        text = f"takes over from the model: {text}"
    return text


def _acts(command: KnownCommand) -> bool:
    return isinstance(command.order, ACTS)
