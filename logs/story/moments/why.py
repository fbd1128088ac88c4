"""One moment's reasons: why the rover did what it did, and what the ground could think of it."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

from farside.control import Cause
from farside.logs.events import time_text
from farside.logs.file.reading import LogFile
from farside.logs.story.causes.chain import causes_of, outline
from farside.logs.story.lives.commands import command_story
from farside.logs.story.moments.acting import action_at, decided, standing
from farside.logs.story.moments.hearing import silence_on
from farside.logs.story.moments.knowledge import ground_at
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import seconds, sentence
from farside.messages import FailsafeChanged, ModeChanged
from farside.node import Role, to_ns, to_s
from farside.topics import GROUND_EVENT, ROVER_FAILSAFE, ROVER_MODE, FailsafeEntry
from farside.validation import one_line

_LENGTH = 400


class Aspect(StrEnum):
    """What to give the reasons of."""

    ACTION = "action"
    MODE = "mode"
    FAILSAFE = "failsafe"
    SILENCE = "silence"


class Section(NamedTuple):
    """A part of the answer: a heading, and sentences."""

    heading: str
    lines: tuple[str, ...]


class Reasons(NamedTuple):
    """The answer to why something was so at a moment.

    Attributes:
        t_ns: the moment.
        aspect: what was asked for.
        sections: the answer, the most telling first. None is empty.
    """

    t_ns: int
    aspect: Aspect
    sections: tuple[Section, ...]

    @property
    def as_json(self) -> dict[str, object]:
        """The answer for programs."""
        return {
            "t_s": to_s(self.t_ns),
            "aspect": self.aspect.value,
            "sections": [
                {"heading": section.heading, "lines": list(section.lines)}
                for section in self.sections
            ],
        }


Mind = Callable[[], Iterable[str]]
"""Tells, in sentences, what the model on board held at the moment."""


def why(
    log: LogFile, t_ns: int, aspect: Aspect = Aspect.ACTION, mind: Mind | None = None
) -> Reasons:
    """Why something was so at a moment.

    Args:
        log: the log; as the ground had it, only what the ground could know then is told.
        t_ns: the moment, within the run.
        aspect: what to give the reasons of.
        mind: tells what the model held then, which no record does where nothing was decided;
            `None` to leave that out.

    Raises:
        LogError: if the log is damaged.
    """
    search = Search(log)
    sections = (
        Section(heading, tuple(one_line(line, _LENGTH) for line in lines))
        for heading, lines in _ASPECTS[aspect](search, t_ns, mind)
    )
    return Reasons(t_ns, aspect, tuple(section for section in sections if section.lines))


_Parts = Iterator[tuple[str, Iterable[str]]]


def _action(search: Search, t_ns: int, mind: Mind | None) -> _Parts:
    if not search.log.is_as_ground:
        model: Iterable[str] = ()
        started = action_at(search, t_ns)
        if started is None:
            behind = standing(search, t_ns)
            model = () if mind is None else mind()
            yield "the rover stands still", behind.lines
            because = behind.record
        else:
            since = f"{sentence(started.entry)}, at {time_text(started.t_ns)}"
            yield f"the rover performs {started.message.action}", (since,)
            yield "the decision behind it", tuple(decided(search, started))
            because = started
        yield "the model on board at that moment, re-lived", model
        yield "who drives", tuple(_drives(search, t_ns))
        if started is not None and started.message.command is not None:
            title, _ = command_story(search, started.message.command)
            yield "the command behind it", (title,)
        if because is not None:
            itself = () if started is not None else (_at(because),)
            yield "what led to it", (*itself, *_because(search, because))
    yield "what the ground thought then", tuple(ground_at(search, t_ns))


def _drives(search: Search, t_ns: int) -> Iterator[str]:
    mode, failsafe = search.last(ROVER_MODE, t_ns), search.last(ROVER_FAILSAFE, t_ns)
    if mode is not None:
        yield _since(mode, t_ns)
    if failsafe is not None:
        yield _since(failsafe, t_ns)


def _at(found: Found[Any]) -> str:
    return f"{time_text(found.t_ns):>9}  {sentence(found.entry)}"


def _because(search: Search, found: Found[Any]) -> Iterator[str]:
    chain = causes_of(search, found)
    for indent, cause in outline(chain):
        when = time_text(cause.t_ns) if cause.topic or cause.t_ns else "mission"
        yield f"{'  ' * indent}{when:>9}  {cause.sentence}"


def _mode(search: Search, t_ns: int, _mind: Mind | None) -> _Parts:
    entry = search.last(ROVER_MODE, t_ns)
    if entry is not None:
        yield f"mode {entry.message.mode}", (_since(entry, t_ns),)
        yield "what led to it", tuple(_because(search, entry))
        before = search.last(ROVER_MODE, entry.t_ns - 1)
        if before is not None:
            yield "before that", (f"{sentence(before.entry)} (since {time_text(before.t_ns)})",)
    yield "when the ground learned of it", tuple(_told(search, t_ns, ModeChanged, entry))
    yield "what the ground thought then", tuple(ground_at(search, t_ns))


def _failsafe(search: Search, t_ns: int, _mind: Mind | None) -> _Parts:
    entry = search.last(ROVER_FAILSAFE, t_ns)
    if entry is not None:
        lines = (_since(entry, t_ns), *_conditions(entry.message))
        yield f"failsafe {entry.message.state}", lines
        yield "what led to it", tuple(_because(search, entry))
        before = search.last(ROVER_FAILSAFE, entry.t_ns - 1)
        if before is not None:
            yield "before that", (f"{sentence(before.entry)} (since {time_text(before.t_ns)})",)
    yield "when the ground learned of it", tuple(_told(search, t_ns, FailsafeChanged, entry))
    yield "what the ground thought then", tuple(ground_at(search, t_ns))


def _since(entry: Found[Any], t_ns: int) -> str:
    text = f"{sentence(entry.entry)}, since {time_text(entry.t_ns)}"
    return text + (f", for {seconds(t_ns - entry.t_ns)}" if t_ns > entry.t_ns else "")


def _conditions(entry: FailsafeEntry) -> Iterator[str]:
    """What was so when the state came about, by the failsafe's own account."""
    causes = ", ".join(entry.causes) or "nothing that it looks for"
    yield f"what was so when that began: {causes}"
    quiet = seconds(to_ns(entry.silence_s))
    yield f"silence by then that the contact plan did not explain: {quiet}"
    if Cause.LOST in entry.causes:
        yield "such silence had used up the countdown, so the link counted as lost"
    else:
        left = seconds(to_ns(entry.countdown_s))
        yield f"another {left} of such silence would have counted as the loss of the link"


def _told(search: Search, t_ns: int, kind: type[Any], entry: Found[Any] | None) -> Iterator[str]:
    """When the word of a change reached the ground; as the ground, the last that did by then."""
    if entry is None:
        learned = search.last(GROUND_EVENT, t_ns, lambda one: isinstance(one.event.what, kind))
        if learned is not None:
            yield f"{time_text(learned.t_ns)}: {sentence(learned.entry)}"
        return
    told = search.first(
        GROUND_EVENT,
        lambda one: isinstance(one.event.what, kind) and one.event.time_ns == entry.t_ns,
        start_ns=entry.t_ns,
    )
    if told is not None:
        age = seconds(told.t_ns - entry.t_ns)
        yield f"at {time_text(told.t_ns)}, {age} later (event {told.message.event.number})"
    elif entry.t_ns > 0:
        yield "never, within this log"


def _silence(search: Search, t_ns: int, _mind: Mind | None) -> _Parts:
    if not search.log.is_as_ground:
        yield "on board", tuple(silence_on(search, Role.ROVER, t_ns))
    yield "at the ground", tuple(silence_on(search, Role.GROUND, t_ns))
    yield "what the ground thought then", tuple(ground_at(search, t_ns))


_ASPECTS: Mapping[Aspect, Callable[[Search, int, Mind | None], _Parts]] = {
    Aspect.ACTION: _action,
    Aspect.MODE: _mode,
    Aspect.FAILSAFE: _failsafe,
    Aspect.SILENCE: _silence,
}
