"""Why nothing was heard: the outage, the losses or the shadow that explain a silence."""

from collections import Counter, deque
from collections.abc import Iterator
from typing import Any, NamedTuple, cast

from farside.frames import Fate, FrameEvent, FrameFate, FrameStage, LinkOutage
from farside.logs.events import OUTAGES, time_text
from farside.logs.spacetime import lost_to
from farside.logs.story.search import Found, Search
from farside.node import NEVER_NS, Direction, Topic
from farside.topics import GROUND_FRAME, LINK_FRAME, LINK_OUTAGE, ROVER_FRAME

RECEIVER: dict[Direction, Topic[FrameEvent]] = {
    Direction.UP: ROVER_FRAME,
    Direction.DOWN: GROUND_FRAME,
}
"""Where the receiver of a direction records what it does with frames."""

SENDER: dict[Direction, Topic[FrameEvent]] = {
    direction: RECEIVER[direction.opposite] for direction in Direction
}
"""Where the sender of a direction does."""

_MOST_LOSSES = 3

Loss = Found[FrameFate] | Found[FrameEvent]
"""A record that says that a frame was lost: by the channel, to terrain shadow, or refused."""


class Explained(NamedTuple):
    """What explains a silence.

    Attributes:
        text: in words.
        heard: the frame that was heard last before it; `None` if none was.
        outages: the outages in it that lost frames, or began in it.
        losses: of the frames that would else have been heard, the last three that were lost.
        lost: how many of them were lost.
    """

    text: str
    heard: Found[FrameEvent] | None
    outages: tuple[Found[LinkOutage], ...]
    losses: tuple[Loss, ...]
    lost: int


def heard_before(search: Search, direction: Direction, t_ns: int) -> Found[FrameEvent] | None:
    """The last frame of a direction that its receiver used at `t_ns` or before."""
    return search.last(RECEIVER[direction], t_ns, lambda event: is_used(event, direction))


def is_used(event: FrameEvent, direction: Direction) -> bool:
    """Whether an event says that a frame of this direction was heard."""
    return event.direction is direction and event.stage is FrameStage.USED


def explain(search: Search, direction: Direction, t_ns: int) -> Explained:
    """Why the receiver of a direction has heard nothing by `t_ns` since it last did.

    Raises:
        LogError: if the log is damaged.
    """
    heard = heard_before(search, direction, t_ns)
    since_ns = 0 if heard is None else heard.t_ns
    outages = tuple(_outages(search, direction, since_ns, t_ns))
    kinds: Counter[str] = Counter()
    losses: deque[Loss] = deque(maxlen=_MOST_LOSSES)
    for loss in _losses(search, direction, since_ns, t_ns):
        losses.append(loss)
        kinds[_how(loss)] += 1
    way = "the uplink" if direction is Direction.UP else "the downlink"
    texts = [_out(search, one, t_ns, way) for one in outages]
    texts += [f"{_frames(count)} {how}" for how, count in sorted(kinds.items())]
    if not texts:
        texts.append(_under_way(search, direction, t_ns, way))
    return Explained("; ".join(texts), heard, outages, tuple(losses), kinds.total())


def _out(search: Search, outage: Found[LinkOutage], t_ns: int, way: str) -> str:
    """That a direction is out, or was while nothing was heard."""
    ended = search.first(
        LINK_OUTAGE,
        lambda one: one.direction is outage.message.direction and not one.down,
        start_ns=outage.t_ns,
        end_ns=t_ns,
    )
    what, since = OUTAGES[outage.message.reason], time_text(outage.t_ns)
    if ended is None:
        return f"{way} is out, {what} since {since}"
    return f"{way} was out, {what} from {since} to {time_text(ended.t_ns)}"


def _frames(count: int) -> str:
    return "1 frame" if count == 1 else f"{count} frames"


def _how(loss: Loss) -> str:
    if isinstance(loss.message, FrameFate):
        return lost_to(loss.message) or "lost"
    if loss.message.stage is FrameStage.REFUSED:
        return f"refused as {loss.message.what}"
    return "lost in terrain shadow"


def _outages(
    search: Search, direction: Direction, since_ns: int, until_ns: int
) -> list[Found[LinkOutage]]:
    """Those that were on between the two times, by the moment at which each began."""
    before = search.last(LINK_OUTAGE, since_ns, lambda outage: outage.direction is direction)
    found = [] if before is None or not before.message.down else [before]
    found += [
        one
        for one in search.each(LINK_OUTAGE, start_ns=since_ns + 1, end_ns=until_ns)
        if one.message.direction is direction and one.message.down
    ]
    return found


def _losses(search: Search, direction: Direction, since_ns: int, until_ns: int) -> Iterator[Loss]:
    """The frames lost between the two times, in the order in which that came about."""
    # Terrain shadow is at the rover, whoever sends.
    topics: set[Topic[Any]] = {LINK_FRAME, ROVER_FRAME, RECEIVER[direction]}
    for record in search.log.records(topics, start_ns=since_ns + 1, end_ns=until_ns):
        found = Found.of(record)
        match found.message:
            case FrameFate(fate=fate, copy=0) as one if fate is not Fate.DELIVERED:
                pass
            case FrameEvent(stage=FrameStage.SHADOWED | FrameStage.REFUSED) as one:
                pass
            case _:
                continue
        if one.direction is direction:
            yield cast("Loss", found)


def _under_way(search: Search, direction: Direction, t_ns: int, way: str) -> str:
    """Nothing was lost: either nothing was sent, or what was is still on its way."""
    sent = search.last(
        SENDER[direction],
        t_ns,
        lambda event: event.direction is direction and event.stage is FrameStage.MADE,
    )
    if sent is None:
        return f"nothing has been sent over {way}"
    fate = search.first(
        LINK_FRAME,
        lambda fate: fate.direction is direction and fate.sequence == sent.message.sequence,
        start_ns=sent.t_ns,
        end_ns=NEVER_NS,
    )
    if fate is not None and (fate.message.arrival_ns or 0) > t_ns:
        return f"what was sent over {way} at {time_text(sent.t_ns)} is still on its way"
    return f"nothing more was sent over {way} since {time_text(sent.t_ns)}"
