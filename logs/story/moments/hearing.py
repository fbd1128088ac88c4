"""What was heard and what was not at a moment, on both sides: for `farside why LOG silence`."""

from collections.abc import Iterator
from typing import Any

from farside.control import Cause
from farside.frames import LinkOutage
from farside.logs.events import OUTAGES, time_text
from farside.logs.story import silence
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import frame_text, seconds, sentence
from farside.node import NS_PER_S, Direction, Role, Topic
from farside.topics import GROUND_SILENCE, ROVER_FAILSAFE

_QUIET_NS = 5 * NS_PER_S
"""From what gap on it is worth saying what explains it, though the side counts it as no silence."""

_SILENT = {Cause.SILENCE, Cause.EXPECTED_SILENCE}


def silence_on(search: Search, role: Role, t_ns: int) -> Iterator[str]:
    """What a side heard last, what explains that nothing came since, and when the next came.

    Raises:
        LogError: if the log is damaged.
    """
    direction = Direction.UP if role is Role.ROVER else Direction.DOWN
    explained = silence.explain(search, direction, t_ns)
    heard = explained.heard
    if heard is None:
        yield f"the {role} has heard nothing by {time_text(t_ns)}"
    else:
        name = frame_text(direction, heard.message.sequence)
        gap = f"{seconds(t_ns - heard.t_ns)} before" if t_ns > heard.t_ns else "at this moment"
        yield f"the {role} last heard {name} at {time_text(heard.t_ns)}, {gap}"
    since_ns = 0 if heard is None else heard.t_ns
    if t_ns - since_ns < _QUIET_NS and not _counts(search, role, t_ns):
        yield f"that is no silence: the {role} does not count it as one"
        return
    if not search.log.is_as_ground:
        yield f"why: {explained.text}"
    yield from _planned(explained.outages)
    if search.log.is_as_ground:
        return
    following = search.first(
        silence.RECEIVER[direction],
        lambda event: silence.is_used(event, direction),
        start_ns=t_ns + 1,
    )
    if following is None:
        yield f"the {role} hears nothing more to the end of the log"
    else:
        name = frame_text(direction, following.message.sequence)
        text = f"the next that it hears is {name} at {time_text(following.t_ns)}"
        yield f"{text}, after {seconds(following.t_ns - since_ns)} in all"
    yield from _followed(search, role, since_ns, following.t_ns if following else search.log.end_ns)


def _counts(search: Search, role: Role, t_ns: int) -> bool:
    """Whether a side says that it hears nothing, which the plan may explain."""
    if role is Role.ROVER:
        failsafe = search.last(ROVER_FAILSAFE, t_ns)
        return failsafe is not None and not _SILENT.isdisjoint(failsafe.message.causes)
    said = search.last(GROUND_SILENCE, t_ns)
    return said is not None and (said.message.silent or said.message.expected)


def _planned(outages: tuple[Found[LinkOutage], ...]) -> Iterator[str]:
    """Whether both ends could have known of it."""
    for outage in outages:
        reason = outage.message.reason
        known = "stands in the contact plan: both sides expect it"
        if not reason.is_foreseen:
            known = "stands in no plan: neither side can expect it"
        yield f"the {OUTAGES[reason]} of {time_text(outage.t_ns)} {known}"


def _followed(search: Search, role: Role, since_ns: int, until_ns: int) -> Iterator[str]:
    """What the side made of it."""
    topic: Topic[Any] = ROVER_FAILSAFE if role is Role.ROVER else GROUND_SILENCE
    for one in search.each(topic, start_ns=since_ns, end_ns=until_ns):
        yield f"{time_text(one.t_ns)}: {sentence(one.entry)}"
