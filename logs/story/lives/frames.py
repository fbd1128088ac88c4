"""The story of a frame: what was in it, what became of it, and the other frames with the same."""

from collections.abc import Iterator

from farside.frames import FrameEvent, FrameStage
from farside.logs.events import time_text
from farside.logs.spacetime import Word, words
from farside.logs.story.causes.crossing import message_in
from farside.logs.story.lives.journey import SENDER as SENDING_ROLE
from farside.logs.story.lives.journey import Line, journeys, word_lines
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import frame_text, sentence
from farside.logs.story.silence import RECEIVER, SENDER
from farside.logs.story.subjects import SubjectError
from farside.node import NEVER_NS, Direction, Role
from farside.topics import GROUND_FRAME, LINK_FRAME


def frame_story(search: Search, direction: Direction, number: int) -> tuple[str, list[Line]]:
    """The title of a frame's story, and its lines in any order.

    Raises:
        SubjectError: if there is none, or the ground cannot have known of it.
        LogError: if the log is damaged.
    """
    end = GROUND_FRAME if search.log.is_as_ground else SENDER[direction]

    def is_it(event: FrameEvent) -> bool:
        return event.direction is direction and event.sequence == number

    first = search.first(end, is_it)
    found = None
    if first is not None:
        sent = words(search.log, first.t_ns, first.t_ns)
        found = next(
            (one for one in sent if (one.direction, one.frame) == (direction, number)), None
        )
    if first is None or found is None:
        none = "the ground knows of no" if search.log.is_as_ground else "there is no"
        raise SubjectError(f"{none} frame {direction}:{number}: {_there(search, direction)}")
    lines = list(word_lines(found, _name(found)))
    lines += _message(search, found, first)
    lines += _used(search, found)
    lines += _duplicates(search, found)
    lines += _other_attempts(search, found)
    return f"{frame_text(direction, number)}: {found.what}{_ending(found)}", lines


def _there(search: Search, direction: Direction) -> str:
    end = GROUND_FRAME if search.log.is_as_ground else SENDER[direction]
    last = search.last(end, NEVER_NS, lambda one: one.direction is direction)
    if last is None:
        return "it knows of none" if search.log.is_as_ground else "the log has none"
    known = "those that it knows of" if search.log.is_as_ground else "those of the log"
    return f"{known} are up to {direction}:{last.message.sequence}"


def _message(search: Search, word: Word, made: Found[FrameEvent]) -> Iterator[Line]:
    """What the message in it was made of."""
    if made.message.stage is FrameStage.MADE:
        for one in message_in(search, made):
            yield Line(one.so_ns, SENDING_ROLE[word.direction], sentence(one.entry))


def _used(search: Search, word: Word) -> Iterator[Line]:
    """What the receiver got from it: a whole message, or several that had waited for it."""
    if word.arrives_ns is None or word.lost is not None:
        return
    used = search.first(
        RECEIVER[word.direction],
        lambda one: (
            one.direction is word.direction
            and one.sequence == word.frame
            and one.stage is FrameStage.USED
        ),
        start_ns=word.arrives_ns,
    )
    if used is not None:
        receiver = SENDING_ROLE[word.direction.opposite]
        yield Line(used.t_ns, receiver, _use(used.message, word))


def _use(event: FrameEvent, word: Word) -> str:
    if event.carries or word.carries is None:
        return _brings(event)
    if word.carries.parts > 1:
        return "the message is not whole yet: other parts are missing"
    return "nothing comes of it now: it had arrived before, or waits for those before it"


def _brings(event: FrameEvent) -> str:
    """What a frame brought."""
    brought = ", ".join(f"{one.kind} {one.number}" for one in event.carries if one.number)
    return f"it brings {brought}" if brought else f"it brings {event.what.lower()}"


def _duplicates(search: Search, word: Word) -> Iterator[Line]:
    """The copies that the channel made of it."""
    if word.fate is None:
        return
    for one in search.each(LINK_FRAME, start_ns=word.sent_ns, end_ns=word.sent_ns + _COPY_NS):
        fate = one.message
        if fate.copy and (fate.direction, fate.sequence) == (word.direction, word.frame):
            text = f"a duplicate that the link made of it: {fate.fate}"
            yield Line(one.t_ns, Role.LINK, text)


_COPY_NS = 7_200_000_000_000  # two hours: longer than light takes to any place of a mission


def _other_attempts(search: Search, word: Word) -> Iterator[Line]:
    """The other frames with the same message, until it had arrived."""
    carried = word.carries
    if carried is None or carried.number is None:
        return  # of telemetry and heartbeats only the latest counts: nothing is sent again

    def has(event: FrameEvent) -> bool:
        return event.direction is word.direction and any(
            (one.kind, one.number) == (carried.kind, carried.number) for one in event.carries
        )

    born = search.first(SENDER[word.direction], has, start_ns=carried.time_ns or 0)
    start_ns = word.sent_ns if born is None else born.t_ns
    whole = search.first(
        RECEIVER[word.direction],
        lambda event: event.stage is FrameStage.USED and has(event),
        start_ns=start_ns,
    )
    until_ns = NEVER_NS if whole is None else whole.t_ns
    name = _name(word)
    own = set(word_lines(word, name))
    for line in journeys(search.log, {(carried.kind, carried.number): name}, start_ns, until_ns):
        if line not in own:
            yield line


def _name(word: Word) -> str:
    """What it carries, without which part and which attempt."""
    return word.what.split(", ")[0]


def _ending(word: Word) -> str:
    if word.lost is not None:
        return f" - {word.lost}"
    if word.arrives_ns is not None:
        return f" - arrived at {time_text(word.arrives_ns)}"
    return ""
