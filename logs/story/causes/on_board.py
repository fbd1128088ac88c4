"""What led to what the rover decided and did: finders for the table of causes."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from farside.control import CommandStage
from farside.logs.events import sign_text
from farside.logs.story.causes.authority import Finds, Given, charge_at, ordered_at, some
from farside.logs.story.causes.crossing import brought
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import sentence
from farside.messages import (
    ACTS,
    Approve,
    Override,
    Proposal,
    SetGoal,
    TakeBack,
    Tokens,
    Veto,
    WithdrawGoal,
)
from farside.node import Direction, Topic
from farside.places import ON_CHARGE
from farside.topics import (
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ActionEnded,
    ActionStarted,
    CommandEntry,
    Cycle,
    Decision,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModelSent,
    PolicyMapEntry,
    ProposalEnded,
    StuckEntry,
    reasons,
)

_Any = Found[Any]


# --- actions and decisions --------------------------------------------------------------------


def action_started(search: Search, found: Found[ActionStarted]) -> Finds:
    """The decision of that moment."""
    started = found.message
    yield from search.at(
        ROVER_DECISION,
        found.t_ns,
        lambda decision: decision.action == started.action and decision.proposal is None,
    ) or _wanted_by(search, found.t_ns, started.goal, started.command)


def action_ended(search: Search, found: Found[ActionEnded]) -> Iterator[_Any]:
    """The action when it began."""
    yield from some(search.last(ROVER_ACTION_STARTED, found.t_ns - 1))


def decision(search: Search, found: Found[Decision]) -> Finds:
    """The command behind it; or the goal that it serves, and what lets the rover act for it."""
    yield from _wanted_by(search, found.t_ns, found.message.goal, found.message.command)


def _wanted_by(search: Search, t_ns: int, goal: Tokens | None, command: int | None) -> Finds:
    if command is not None:
        yield from _stage(search, command, t_ns, CommandStage.BEGUN)
        return
    yield from search.at(ROVER_PROPOSAL_ENDED, t_ns, lambda ended: reasons.NO_VETO.is_in(ended.why))
    if goal is not None:
        for source in GoalSource:
            yield from _goal_set(search, goal, source, t_ns)
    yield from some(search.last(ROVER_MODE, t_ns))


def _goal_set(search: Search, goal: Tokens, source: GoalSource, t_ns: int) -> Iterator[_Any]:
    """Where a source set a goal that it still wants at that time."""

    def is_its(entry: GoalEntry) -> bool:
        return entry.tokens == goal and entry.source is source

    newest = search.last(ROVER_GOAL, t_ns, is_its)
    if newest is not None and newest.message.change not in {
        GoalChange.REACHED,
        GoalChange.WITHDRAWN,
    }:
        yield from _was_set(search, newest)


def _was_set(search: Search, found: Found[GoalEntry]) -> Iterator[_Any]:
    """Where the source of a change set the goal."""
    goal = found.message
    yield from some(
        search.last(
            ROVER_GOAL,
            found.t_ns,
            lambda one: (
                one.tokens == goal.tokens
                and one.source is goal.source
                and one.change is GoalChange.SET
            ),
        )
    )


# --- commands ---------------------------------------------------------------------------------


def _stage(search: Search, number: int, t_ns: int, *stages: CommandStage) -> Iterator[_Any]:
    yield from some(
        search.last(ROVER_COMMAND, t_ns, lambda one: one.number == number and one.stage in stages)
    )


def command(search: Search, found: Found[CommandEntry]) -> Finds:
    """What brought a command to a stage: for most, what it waited for, and that it was taken."""
    entry = found.message
    if entry.stage is CommandStage.TAKEN:
        yield from brought(
            search, Direction.UP, "command", found.t_ns, lambda one: one.number == entry.number
        )
        return
    if entry.stage in {CommandStage.DONE, CommandStage.FAILED} and isinstance(entry.order, ACTS):
        yield from some(search.last(ROVER_ACTION_ENDED, found.t_ns))
        return
    if (finder := _COMMAND.get(entry.stage)) is not None:
        yield from finder(search, entry, found.t_ns)
    yield from _stage(search, entry.number, found.t_ns, CommandStage.TAKEN)


def _let_begin(search: Search, entry: CommandEntry, t_ns: int) -> Finds:
    """What a command waited for that came about at this moment, if it had waited."""
    for waited in _stage(search, entry.number, t_ns, CommandStage.WAITING):
        if waited.t_ns < t_ns:
            for ended in search.at(ROVER_ACTION_ENDED, t_ns):
                yield Given(t_ns, sentence(ended.entry), ended.topic)
            yield from search.at(ROVER_FAILSAFE, t_ns)


def _refused(search: Search, entry: CommandEntry, t_ns: int) -> Iterator[_Any]:
    """What the reason of a refusal speaks of."""
    why = entry.why
    if isinstance(entry.order, Approve | Override | Veto):
        number = entry.order.proposal
        yield from some(
            search.last(ROVER_PROPOSAL_ENDED, t_ns, lambda ended: ended.number == number)
        )
    yield from some(search.last(ROVER_FAILSAFE, t_ns, lambda state: state.why == why))
    for reason, finder in REFUSALS.items():
        if reason.is_in(why):
            yield from some(finder(search, t_ns))
    for follows in (reasons.NEVER_AFTER, reasons.NOT_AFTER):
        if (after := follows.number_in(why)) is not None:
            yield from _stage(search, after, t_ns, *_ENDS)


_ENDS = tuple(stage for stage in CommandStage if stage.is_last)

REFUSALS: Mapping[reasons.Reason, Callable[[Search, int], _Any | None]] = {
    reasons.OTHER_MODE: lambda search, t_ns: search.last(ROVER_MODE, t_ns),
    reasons.BLOCKED_HERE: lambda search, t_ns: search.last(
        ROVER_ACTION_ENDED, t_ns, lambda ended: ended.blocked
    ),
    reasons.OTHER_PLACE: lambda search, t_ns: search.last(ROVER_ACTION_ENDED, t_ns),
    reasons.CHARGE_TOO_LOW: lambda search, t_ns: search.last(ROVER_BATTERY, t_ns),
    reasons.BATTERY_FLAT: lambda search, t_ns: search.last(ROVER_BATTERY, t_ns),
}
"""What the reason of a refusal points to."""


def _superseded(search: Search, entry: CommandEntry, t_ns: int) -> Iterator[_Any]:
    """The order that took its place, or the loss of the link."""
    number = reasons.MODE_CHANGED.number_in(entry.why)
    if number is not None:
        yield from _stage(search, number, t_ns, CommandStage.TAKEN)
    else:
        yield from some(search.last(ROVER_FAILSAFE, t_ns))


def _withdrawn(search: Search, entry: CommandEntry, t_ns: int) -> Iterator[_Any]:
    yield from ordered_at(search, t_ns, TakeBack, lambda order: order.number == entry.number)


_COMMAND: Mapping[CommandStage, Callable[[Search, CommandEntry, int], Finds]] = {
    CommandStage.BEGUN: _let_begin,
    CommandStage.REFUSED: _refused,
    CommandStage.SUPERSEDED: _superseded,
    CommandStage.WITHDRAWN: _withdrawn,
}


# --- goals ------------------------------------------------------------------------------------


def goal(search: Search, found: Found[GoalEntry]) -> Finds:
    """Who set or withdrew it, or the move that reached it."""
    entry, t_ns = found.message, found.t_ns
    match entry.change:
        case GoalChange.SET | GoalChange.WITHDRAWN:
            yield from _wish(search, entry, t_ns)
        case GoalChange.REACHED:
            yield from search.at(ROVER_ACTION_ENDED, t_ns) or _was_set(search, found)
        case GoalChange.SUSPENDED | GoalChange.RECOVERED:
            yield from search.at(ROVER_ACTION_ENDED, t_ns)
            yield from _was_set(search, found)


def _wish(search: Search, entry: GoalEntry, t_ns: int) -> Finds:
    kind = SetGoal if entry.change is GoalChange.SET else WithdrawGoal
    is_it: Callable[[Any], bool] = lambda order: set(order.tokens) == set(entry.tokens)  # noqa: E731
    if entry.source is GoalSource.OPERATOR:
        yield from ordered_at(search, t_ns, kind, is_it)
        return
    if kind is WithdrawGoal:
        withdrawn = [one for one in ordered_at(search, t_ns, kind, is_it) if one.t_ns == t_ns]
        yield from withdrawn
        if withdrawn:
            return
    if entry.source is GoalSource.MISSION:
        yield Given(0, f"the mission gives the rover the goal {sign_text(entry.tokens)}")
        at_once: list[_Any] = [*search.at(ROVER_FAILSAFE, t_ns), *search.at(ROVER_MODE, t_ns)]
        yield from at_once or some(search.last(ROVER_FAILSAFE, t_ns))
    else:
        if entry.tokens == (ON_CHARGE,):
            yield from charge_at(search, t_ns)
        yield from some(search.last(ROVER_FAILSAFE, t_ns))


# --- proposals, the model, the rest -----------------------------------------------------------


def proposal(search: Search, found: Found[Proposal]) -> Iterator[_Any]:
    """The decision that was put before the operator."""
    number = found.message.number
    yield from search.at(ROVER_DECISION, found.t_ns, lambda one: one.proposal == number)


_SITUATION: tuple[Topic[Any], ...] = (ROVER_MODE, ROVER_FAILSAFE, ROVER_GOAL, ROVER_ACTION_ENDED)
"""What makes the situation another one than a proposal was made for."""


def proposal_ended(search: Search, found: Found[ProposalEnded]) -> Iterator[_Any]:
    """The command or the change that ended it, and the proposal."""
    ended, t_ns = found.message, found.t_ns
    if (by := reasons.CAME_BETWEEN.number_in(ended.why)) is not None:
        yield from _stage(search, by, t_ns, CommandStage.TAKEN)
    elif reasons.VETOED.is_in(ended.why):
        yield from ordered_at(search, t_ns, Veto, lambda order: order.proposal == ended.number)
    elif reasons.OTHER_SITUATION.is_in(ended.why):
        for topic in _SITUATION:
            yield from search.at(topic, t_ns)[:1]
    elif reasons.ANSWER_TOO_LATE.is_in(ended.why):
        yield from search.at(ROVER_COMMAND, t_ns, lambda one: one.stage is CommandStage.EXPIRED)[:1]
    yield from some(search.last(ROVER_PROPOSAL, t_ns, lambda made: made.number == ended.number))


def stuck(search: Search, found: Found[StuckEntry]) -> Iterator[_Any]:
    """The move that was blocked, or was not."""
    if found.t_ns > 0:
        yield from some(search.last(ROVER_ACTION_ENDED, found.t_ns))


def cycle(search: Search, found: Found[Cycle]) -> Iterator[_Any]:
    """The move that ended where this was sensed."""
    yield from search.at(ROVER_ACTION_ENDED, found.t_ns)


def policy_map(search: Search, found: Found[PolicyMapEntry]) -> Iterator[_Any]:
    """The change of the Goal List."""
    yield from search.at(ROVER_GOAL, found.t_ns) or some(search.last(ROVER_GOAL, found.t_ns))


def model_sent(search: Search, found: Found[ModelSent]) -> Iterator[_Any]:
    """The cycle of the model that it tells of."""
    yield from some(search.last(ROVER_CYCLE, found.t_ns))


def moving(search: Search, found: _Any) -> Iterator[_Any]:
    """The action under way, or the last one, which led to where the rover is."""
    yield from some(search.last(ROVER_ACTION_STARTED, found.t_ns))
