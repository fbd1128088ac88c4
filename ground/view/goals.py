"""The goals on board as the ground knows them: who wants each, and what of it is on its way."""

from collections.abc import Iterator

from msgspec.structs import replace

from farside.control import CommandStage
from farside.dem import Goal
from farside.ground.view.knowledge import Knowledge
from farside.ground.view.view import GoalSource, KnownGoal
from farside.messages import Event, GoalAside, GoalReached, SetGoal, Tokens, WithdrawGoal
from farside.places import LINK_UP, ON_CHARGE
from farside.topics import GoalSource as Source

_LOOKED_BACK = 16  # commands that are over
_ASIDE = {
    "blocked": "it was blocked too often on the way",
    "unknown": "the model does not know it yet",
    "unreachable": "the model knows no way to it from here",
}
_WANTED_BY = {
    Source.OPERATOR: GoalSource.OPERATOR,
    Source.MISSION: GoalSource.MISSION,
    Source.INHERENT: GoalSource.ROVER,
}


def known_goals(known: Knowledge) -> tuple[KnownGoal, ...]:
    """The goals, the top-goal first, after all that is on its way."""
    goals = {goal.tokens: goal for goal in (*_on_board(known), *_set_since(known))}
    for one in known.coming:
        match one.command.order:
            case SetGoal(tokens=tokens, priority=priority):
                sign = tuple(sorted(set(tokens)))
                goals[sign] = KnownGoal(sign, priority, GoalSource.OPERATOR, is_sent=True)
            case WithdrawGoal(tokens=tokens) if (sign := tuple(sorted(set(tokens)))) in goals:
                goals[sign] = replace(goals[sign], is_withdrawn=True)
    if known.after and (met := goals.get((known.start_place or "",))) is not None:
        goals[met.tokens] = replace(met, is_met=True)
    return _ordered(list(goals.values()))


def _ordered(goals: list[KnownGoal]) -> tuple[KnownGoal, ...]:
    """As the list on board stands, with those that are sent put in by their priority."""
    ordered = [goal for goal in goals if not goal.is_sent]
    for sent in (goal for goal in goals if goal.is_sent):
        place = next(
            (
                index
                for index, goal in enumerate(ordered)
                if goal.aside is not None or (goal.priority or 0.0) < (sent.priority or 0.0)
            ),
            len(ordered),
        )
        ordered.insert(place, sent)
    return tuple(ordered)


def _on_board(known: Knowledge) -> Iterator[KnownGoal]:
    telemetry, shadow = known.telemetry, known.sources.shadow
    if telemetry is None:
        return
    held = {} if shadow is None else {goal.tokens: goal for goal in shadow.model.goals}
    aside = _told_aside(known)
    since = list(_since(known, telemetry.time_ns))
    reached = {event.what.tokens for event in since if isinstance(event.what, GoalReached)}
    for tokens in telemetry.goals:
        if tokens in reached:
            continue
        goal = held.get(tokens)
        why = aside.get(tokens)
        if goal is not None:
            why = None if goal.aside is None else goal.aside.value
        yield KnownGoal(
            tokens,
            _priority(known, tokens, goal),
            _source(known, tokens, goal),
            aside=None if why is None else _ASIDE.get(why, why),
        )


def _set_since(known: Knowledge) -> Iterator[KnownGoal]:
    """The goals that were set on board since the newest telemetry."""
    told_ns = -1 if known.telemetry is None else known.telemetry.time_ns
    for life in known.sources.desk.over[-_LOOKED_BACK:]:
        order, done = life.command.order, life.stages[CommandStage.DONE]
        is_done = life.end is not None and life.end.stage is CommandStage.DONE
        if isinstance(order, SetGoal) and is_done and (done.so_ns or 0) > told_ns:
            yield KnownGoal(tuple(sorted(set(order.tokens))), order.priority, GoalSource.OPERATOR)


def _since(known: Knowledge, time_ns: int) -> Iterator[Event]:
    """The events newer than this, the newest first."""
    for event in reversed(known.sources.belief.events):
        if event.time_ns <= time_ns:
            return
        yield event


def _told_aside(known: Knowledge) -> dict[Tokens, str | None]:
    """Why goals are put aside, by the newest event of each; only asked for without a shadow."""
    if known.sources.shadow is not None:
        return {}
    return {
        event.what.tokens: event.what.why
        for event in known.sources.belief.events
        if isinstance(event.what, GoalAside)
    }


def _priority(known: Knowledge, tokens: Tokens, goal: Goal | None) -> float | None:
    return known.sources.memory.goals.get(tokens) if goal is None else goal.priority


def _source(known: Knowledge, tokens: Tokens, goal: Goal | None) -> GoalSource:
    if goal is not None:
        for source, wanted_by in _WANTED_BY.items():
            if source in goal.priorities:
                return wanted_by
    if tokens in known.sources.memory.goals:
        return GoalSource.OPERATOR
    own = tokens in {(ON_CHARGE,), (LINK_UP,)}
    return GoalSource.ROVER if own else GoalSource.MISSION
