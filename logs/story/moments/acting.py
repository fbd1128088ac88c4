"""What the rover did at a moment, and why it did that, or nothing."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from farside.control import BatteryState, CommandStage, Failsafe, Mode
from farside.logs.events import order_text, sign_text, time_text, when_text
from farside.logs.story.lives.proposals import behind
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import sentence
from farside.messages import Tokens
from farside.node import Topic
from farside.topics import (
    GROUND_COMMAND,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_DECISION,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_POLICY_MAP,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ActionStarted,
    CommandEntry,
    Decision,
    GoalChange,
    GoalSource,
    reasons,
)


def action_at(search: Search, t_ns: int) -> Found[ActionStarted] | None:
    """The action under way at a moment; `None` while the rover stands still."""
    started = search.last(ROVER_ACTION_STARTED, t_ns)
    if started is None:
        return None
    ended = search.first(ROVER_ACTION_ENDED, start_ns=started.t_ns + 1, end_ns=t_ns)
    return started if ended is None else None


# --- an action --------------------------------------------------------------------------------


def decided(search: Search, started: Found[ActionStarted]) -> Iterator[str]:
    """The decision behind an action: active Signs, hypothesis, runner-up, and the policy map."""
    decisions = search.at(
        ROVER_DECISION,
        started.t_ns,
        lambda one: one.action == started.message.action and one.proposal is None,
    )
    if not decisions:
        yield "the log holds no decision of that moment"
        return
    decision = decisions[-1].message
    active = ", ".join(map(sign_text, decision.active)) or "none"
    yield f"chooser {decision.chooser}; active Signs: {active}"
    yield from behind(decision)
    yield from _on_the_map(search, started.t_ns, decision)


def _on_the_map(search: Search, t_ns: int, decision: Decision) -> Iterator[str]:
    """What the active Signs were worth when the goal became the top-goal."""
    drawn = search.last(ROVER_POLICY_MAP, t_ns)
    if drawn is None or drawn.message.goal is None or drawn.message.goal != decision.goal:
        return
    goal = sign_text(drawn.message.goal)
    for place in drawn.message.places:
        if place.sign in decision.active:
            best = "" if place.action is None else f", best action {place.action}"
            yield (
                f"on the policy map of {goal}, as it was at {time_text(drawn.t_ns)}: "
                f"{sign_text(place.sign)} has P_v {place.value:.1f} s{best}, depth {place.depth}"
            )


# --- standing still ---------------------------------------------------------------------------


class Standing(NamedTuple):
    """Why the rover stands still.

    Attributes:
        lines: in words, the reason first.
        record: the record that the reason rests on; `None` where there is none.
    """

    lines: tuple[str, ...]
    record: Found[Any] | None


def standing(search: Search, t_ns: int) -> Standing:
    """Why the rover stands still at a moment, by what the log says was so.

    Raises:
        LogError: if the log is damaged.
    """
    found = next(
        (reason for finder in _REASONS if (reason := finder(search, t_ns)) is not None), None
    )
    text, record = found or ("the log does not tell why", None)
    lines = [text, *_before_and_after(search, t_ns), *_expected(search, t_ns)]
    return Standing(tuple(lines), record)


_Reason = tuple[str, Found[Any] | None]


def _battery(search: Search, t_ns: int) -> _Reason | None:
    battery = search.last(ROVER_BATTERY, t_ns)
    if battery is None or battery.message.state not in {BatteryState.FLAT, BatteryState.CHARGING}:
        return None
    return sentence(battery.entry), battery


def _failsafe(search: Search, t_ns: int) -> _Reason | None:
    failsafe = search.last(ROVER_FAILSAFE, t_ns)
    if failsafe is None or failsafe.message.state not in {Failsafe.HOLD, Failsafe.SAFE}:
        return None
    return f"{sentence(failsafe.entry)}, so it begins nothing of its own", failsafe


def _waiting(search: Search, t_ns: int) -> _Reason | None:
    waiting: dict[int, Found[CommandEntry]] = {}
    for one in search.each(ROVER_COMMAND, end_ns=t_ns):
        if one.message.stage is CommandStage.WAITING:
            waiting[one.message.number] = one
        else:
            waiting.pop(one.message.number, None)
    if not waiting:
        return None
    number, first = next(iter(waiting.items()))
    sent = search.last(GROUND_COMMAND, t_ns, lambda one: one.number == number)
    when = "" if sent is None else when_text(sent.message.when)
    text = f"command {number} ({order_text(first.message.order)}{when}) waits on board"
    text += f" since {time_text(first.t_ns)}"
    return text + (f", and {len(waiting) - 1} more" if len(waiting) > 1 else ""), first


def _guided(search: Search, t_ns: int) -> _Reason | None:
    mode = search.last(ROVER_MODE, t_ns)
    if mode is None or mode.message.mode is not Mode.GUIDED:
        return None
    return "mode guided: it does what the operator commands, and no command waits on board", mode


def _no_goal(search: Search, t_ns: int) -> _Reason | None:
    if goals_at(search, t_ns):
        return None
    gone = search.last(ROVER_GOAL, t_ns)
    return "no goal is on the Goal List: without one it never acts by itself", gone


def _proposed(search: Search, t_ns: int) -> _Reason | None:
    proposal = search.last(ROVER_PROPOSAL, t_ns)
    if proposal is None:
        return None
    number = proposal.message.number
    ended = search.first(
        ROVER_PROPOSAL_ENDED,
        lambda one: one.number == number,
        start_ns=proposal.t_ns,
        end_ns=t_ns,
    )
    if ended is not None:
        return None
    text = f"proposal {number} ({proposal.message.action}) waits for the operator's word"
    return f"{text} since {time_text(proposal.t_ns)}", proposal


def _no_way(search: Search, t_ns: int) -> _Reason | None:
    goals = ", ".join(
        sign_text(tokens) + ("" if aside is None else f", put aside: {aside}")
        for tokens, aside in goals_at(search, t_ns).items()
    )
    vetoed = search.last(ROVER_PROPOSAL_ENDED, t_ns)
    if vetoed is not None and reasons.VETOED.is_in(vetoed.message.why):
        changes = (search.last(topic, t_ns) for topic in _NEW_SITUATION)
        if not any(change is not None and change.t_ns > vetoed.t_ns for change in changes):
            return f"it has goals ({goals}), and the operator vetoed what it proposed", vetoed
    text = f"it has goals ({goals}), and knows no way to them from here, or may not explore"
    return text, search.last(ROVER_GOAL, t_ns)


_NEW_SITUATION: tuple[Topic[Any], ...] = (ROVER_MODE, ROVER_GOAL, ROVER_ACTION_ENDED)
"""After a change of these the rover proposes again, whatever was vetoed before."""

_REASONS: tuple[Callable[[Search, int], _Reason | None], ...] = (
    _battery,
    _failsafe,
    _waiting,
    _guided,
    _no_goal,
    _proposed,
    _no_way,
)
"""Why it may stand still, in the order in which the pilot asks."""


def goals_at(search: Search, t_ns: int) -> dict[Tokens, str | None]:
    """The goals that somebody wants at a moment, each with why it is put aside, if it is."""
    wanted: dict[tuple[Tokens, GoalSource], None] = {}
    aside: dict[Tokens, str | None] = {}
    for one in search.each(ROVER_GOAL, end_ns=t_ns):
        entry = one.message
        match entry.change:
            case GoalChange.SET:
                wanted[entry.tokens, entry.source] = None
            case GoalChange.REACHED | GoalChange.WITHDRAWN:
                wanted.pop((entry.tokens, entry.source), None)
                if not any(tokens == entry.tokens for tokens, _ in wanted):
                    aside.pop(entry.tokens, None)
            case GoalChange.SUSPENDED | GoalChange.RECOVERED:
                aside[entry.tokens] = entry.why
    return {tokens: aside.get(tokens) for tokens, _ in wanted}


def _before_and_after(search: Search, t_ns: int) -> Iterator[str]:
    ended = search.last(ROVER_ACTION_ENDED, t_ns)
    if ended is None:
        yield "it has not moved yet"
    else:
        yield f"its last action: {sentence(ended.entry)}, at {time_text(ended.t_ns)}"
    following = search.first(ROVER_ACTION_STARTED, start_ns=t_ns + 1)
    if following is not None:
        yield f"it stands until {time_text(following.t_ns)}: {sentence(following.entry)}"
    else:
        yield "it does not move again in this log"


def _expected(search: Search, t_ns: int) -> Iterator[str]:
    """The commands that the ground has given and that have not arrived."""
    sent = search.last(GROUND_COMMAND, t_ns)
    taken = search.last(ROVER_COMMAND, t_ns)
    last_taken = 0 if taken is None else taken.message.number
    if sent is None or sent.message.number <= last_taken:
        return
    first, last = last_taken + 1, sent.message.number
    which = f"command {last} is" if first == last else f"commands {first} to {last} are"
    yield f"{which} given at the ground, and not on board yet"
