"""The story of a goal: who set it, what was done for it, how it ended, and what the ground knew."""

from collections.abc import Iterator

from farside.logs.events import sign_text, time_text
from farside.logs.story.causes.at_ground import ordered
from farside.logs.story.causes.chain import causes_of
from farside.logs.story.lives.commands import command_story
from farside.logs.story.lives.journey import Line, learned_text
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import sentence
from farside.logs.story.subjects import SubjectError
from farside.messages import GoalAside, GoalReached, SetGoal, Tokens, WithdrawGoal
from farside.node import NEVER_NS, Role
from farside.places import place_token
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_ORDER,
    GROUND_TELEMETRY,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_DECISION,
    ROVER_GOAL,
    ROVER_POLICY_MAP,
    ActionStarted,
    GoalChange,
    GoalEntry,
    GoalSource,
)
from farside.validation import did_you_mean

_GONE = {GoalChange.REACHED, GoalChange.WITHDRAWN}


def goal_story(search: Search, wanted: Tokens) -> tuple[str, list[Line]]:
    """The title of a goal's story, and its lines in any order.

    Args:
        search: the log.
        wanted: its Sign; the name of a place stands for its Token.

    Raises:
        SubjectError: if it never was a goal, or the ground cannot have known of it.
        LogError: if the log is damaged.
    """
    goal = _goal_named(search, wanted)
    lines = [*_orders(search, goal)]
    changes = [one for one in search.each(ROVER_GOAL) if one.message.tokens == goal]
    for change in changes:
        lines += _change(search, change)
    lines += _top(search, goal)
    lines += _pursued(search, goal)
    lines += _known(search, goal)
    ending = _known_end(search, goal) if search.log.is_as_ground else _end(changes)
    return f"goal {sign_text(goal)}{ending}", lines


def _end(changes: list[Found[GoalEntry]]) -> str:
    """How it ended, for the title: by the last change, once nobody wants it any more."""
    wanted_by: set[GoalSource] = set()
    for one in changes:
        if one.message.change is GoalChange.SET:
            wanted_by.add(one.message.source)
        elif one.message.change in _GONE:
            wanted_by.discard(one.message.source)
    ends = [one for one in changes if one.message.change in _GONE]
    if wanted_by:
        return " - still a goal at the end of the log"
    return f" - {ends[-1].message.change} at {time_text(ends[-1].t_ns)}" if ends else ""


def _known_end(search: Search, goal: Tokens) -> str:
    """The newest that the ground knew of whether it is a goal, for the title."""
    reached = search.last(
        GROUND_EVENT,
        NEVER_NS,
        lambda one: isinstance(one.event.what, GoalReached) and one.event.what.tokens == goal,
    )
    reached_ns = -1 if reached is None else reached.message.event.time_ns
    heard = search.last(GROUND_TELEMETRY, NEVER_NS)
    if heard is not None and goal in heard.message.goals and heard.message.time_ns > reached_ns:
        return f" - a goal by the newest telemetry, of {time_text(heard.message.time_ns)}"
    if reached is None:
        return " - not known to be reached"
    known = time_text(reached.t_ns)
    return f" - reached at {time_text(reached_ns)}, known at the ground at {known}"


def _goal_named(search: Search, wanted: Tokens) -> Tokens:
    """The goal of the log that is meant by these Tokens or places."""
    known: dict[Tokens, None] = {}
    for one in search.each(ROVER_GOAL):
        known[one.message.tokens] = None
    for given in search.each(GROUND_ORDER):
        order = ordered(given.message)
        if isinstance(order, SetGoal):
            known[tuple(sorted(set(order.tokens)))] = None
    for learned in search.each(GROUND_EVENT):
        what = learned.message.event.what
        if isinstance(what, GoalReached | GoalAside):
            known[what.tokens] = None
    places = tuple(sorted(place_token(name) for name in wanted))
    for tokens in (wanted, places):
        if tokens in known:
            return tokens
    names = ["+".join(tokens) for tokens in known]
    there = f"the goals are {', '.join(names)}" if names else "there were no goals"
    hint = did_you_mean("+".join(places), names)
    raise SubjectError(f"there is no goal {sign_text(wanted)}: {there}{hint}")


def _orders(search: Search, goal: Tokens) -> Iterator[Line]:
    """The stories of the commands that set or withdrew it."""
    for sent in search.each(GROUND_COMMAND):
        order = sent.message.order
        if isinstance(order, SetGoal | WithdrawGoal) and set(order.tokens) == set(goal):
            yield from command_story(search, sent.message.number)[1]


def _change(search: Search, change: Found[GoalEntry]) -> Iterator[Line]:
    entry = change.message
    text = sentence(change.entry)
    if entry.change is GoalChange.SET and entry.source is not GoalSource.OPERATOR:
        why = [one for one in causes_of(search, change) if one.depth == 1 and one.topic]
        text += f", since {why[0].sentence}" if why else ""
    yield Line(change.t_ns, Role.ROVER, text)


def _pursued(search: Search, goal: Tokens) -> Iterator[Line]:
    """The actions for it, row by row: until another goal, or another chooser, comes in between."""
    row: list[Found[ActionStarted]] = []
    for started in search.each(ROVER_ACTION_STARTED):
        ours = started.message.goal == goal
        if row and not (ours and _by(started.message) == _by(row[-1].message)):
            yield from _row(search, row)
            row = []
        if ours:
            row.append(started)
    if row:
        yield from _row(search, row)


def _by(started: ActionStarted) -> str:
    word = "on its own" if started.command is None else "with the operator's consent"
    return f"{started.chooser}, {word}"


def _row(search: Search, row: list[Found[ActionStarted]]) -> Iterator[Line]:
    first, last = row[0], row[-1]
    ended = search.first(ROVER_ACTION_ENDED, start_ns=last.t_ns + 1)
    ends = search.each(
        ROVER_ACTION_ENDED,
        start_ns=first.t_ns + 1,
        end_ns=last.t_ns if ended is None else ended.t_ns,
    )
    blocked = sum(one.message.blocked for one in ends)
    ways = " ".join(one.message.action for one in row[:_SHOWN])
    ways += f" and {len(row) - _SHOWN} more" if len(row) > _SHOWN else ""
    moves = "1 action" if len(row) == 1 else f"{len(row)} actions"
    text = f"{moves} towards it, {_by(first.message)}: {ways}"
    decision = search.at(ROVER_DECISION, first.t_ns, lambda one: one.proposal is None)
    if decision and decision[-1].message.behind is not None:
        to_go = decision[-1].message.behind.cost_to_go
        text += "" if to_go is None else f"; cost to go {to_go:.1f} s at first"
    if len(row) > 1:
        text += f"; the last begins at {time_text(last.t_ns)}"
    yield Line(first.t_ns, Role.ROVER, text + (f"; {blocked} blocked" if blocked else ""))


_SHOWN = 12


def _top(search: Search, goal: Tokens) -> Iterator[Line]:
    """When it became the top-goal, and what the way was worth then."""
    for one in search.each(ROVER_POLICY_MAP):
        if one.message.goal == goal:
            yield Line(one.t_ns, Role.ROVER, sentence(one.entry))


def _known(search: Search, goal: Tokens) -> Iterator[Line]:
    """When the ground learned that it was on the list, put aside, reached, or gone."""
    listed = False
    for heard in search.each(GROUND_TELEMETRY):
        telemetry = heard.message
        if (goal in telemetry.goals) is not listed:
            listed = not listed
            what = "it is a goal" if listed else "it is no goal any more"
            text = f"telemetry of {time_text(telemetry.time_ns)} tells the ground that {what}"
            yield Line(heard.t_ns, Role.GROUND, text)
    for learned in search.each(GROUND_EVENT):
        event = learned.message.event
        match event.what:
            case GoalReached(tokens=tokens) if tokens == goal:
                text = learned_text("that it was reached", event.time_ns, learned.t_ns)
            case GoalAside(tokens=tokens, why=why) if tokens == goal:
                what = "taken up again" if why is None else f"put aside ({why})"
                text = learned_text(f"that it was {what}", event.time_ns, learned.t_ns)
            case _:
                continue
        yield Line(learned.t_ns, Role.GROUND, f"{text} (event {event.number})")
