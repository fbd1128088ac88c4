"""What the ground thought of the rover at a moment, in words."""

from collections.abc import Iterator

from farside.logs.events import sign_text, time_text
from farside.logs.story.search import Search
from farside.logs.story.sentences import seconds
from farside.places import place_name
from farside.topics import (
    GROUND_BELIEF,
    GROUND_PREDICTION,
    GROUND_SHADOW,
    GROUND_SILENCE,
    GROUND_TELEMETRY,
    BeliefEntry,
    BeliefItem,
)


def ground_at(search: Search, t_ns: int) -> Iterator[str]:
    """What it believed, and how old that was; what it predicted; its silence; its shadow.

    Raises:
        LogError: if the log is damaged.
    """
    belief = search.last(GROUND_BELIEF, t_ns)
    if belief is None:
        yield "it has heard nothing of the rover yet"
        return
    believed = ", ".join(_believed(belief.message))
    if believed:
        yield f"it believes the rover {believed}"
    else:
        yield "it does not know yet where the rover is or what it does"
    heard = search.last(GROUND_TELEMETRY, t_ns)
    if heard is not None:
        age = seconds(t_ns - heard.message.time_ns)
        yield f"its newest telemetry is of {time_text(heard.message.time_ns)}, {age} old"
    stale = belief.message.stale
    if stale:
        which = "all of that" if set(_TOLD) <= set(stale) else ", ".join(stale).replace("_", " ")
        yield f"something newer was due, so this is stale: {which}"
    yield from _predicted(search, t_ns)
    silence = search.last(GROUND_SILENCE, t_ns)
    if silence is not None and silence.message.silent:
        explained = "as the contact plan says" if silence.message.expected else "unexpectedly"
        yield f"the rover has counted as silent since {time_text(silence.t_ns)}, {explained}"
    elif silence is not None and silence.message.expected:
        yield "nothing is heard, which the contact plan explains"
    shadow = search.last(GROUND_SHADOW, t_ns)
    if shadow is not None:
        state = "in step" if shadow.message.in_step else f"out of step: {shadow.message.why}"
        update = f"update {shadow.message.number} of {time_text(shadow.so_ns)}"
        yield f"its shadow of the model is {state}, after {update}"


def _believed(belief: BeliefEntry) -> Iterator[str]:
    if belief.place is not None:
        place = belief.place.value
        yield "at a place that it does not know" if place is None else f"at {place_name(place)}"
    if belief.action is not None:
        action = belief.action.value
        yield "standing still" if action is None else f"performing {action}"
    if belief.mode is not None:
        yield f"in mode {belief.mode.value}"
    if belief.failsafe is not None:
        yield f"with failsafe {belief.failsafe.value}"
    if belief.goals is not None:
        goals = ", then ".join(map(sign_text, belief.goals.value))
        plural = "s" if len(belief.goals.value) > 1 else ""
        yield f"with goal{plural} {goals}" if goals else "with no goal"


_TOLD = (
    BeliefItem.PLACE,
    BeliefItem.ACTION,
    BeliefItem.MODE,
    BeliefItem.FAILSAFE,
    BeliefItem.GOALS,
)
"""What `_believed` tells of."""


def _predicted(search: Search, t_ns: int) -> Iterator[str]:
    prediction = search.last(GROUND_PREDICTION, t_ns, lambda one: one.command is None)
    if prediction is None:
        return
    message, made = prediction.message, f"at {time_text(prediction.t_ns)}"
    if not message.likely:
        since = time_text(message.from_ns)
        yield f"{made} it could not say where the rover was, from telemetry of {since}"
        return
    likely = message.likely[0]
    text = f"{made} it predicted {sign_text(likely.sign)} with {likely.probability:.0%}"
    if len(message.likely) > 1:
        second = message.likely[1]
        text += f", else {sign_text(second.sign)} with {second.probability:.0%}"
    yield f"{text}, from telemetry of {time_text(message.from_ns)}"
