"""One thing's life, from birth to effect, across both sides of the link."""

from collections.abc import Iterator
from typing import NamedTuple

from farside.logs.file.reading import LogFile
from farside.logs.story.lives.commands import command_story
from farside.logs.story.lives.frames import frame_story
from farside.logs.story.lives.goals import goal_story
from farside.logs.story.lives.journey import Line
from farside.logs.story.lives.proposals import event_story, proposal_story
from farside.logs.story.search import Search
from farside.logs.story.subjects import Kind, Subject
from farside.node import to_s
from farside.validation import one_line

_LENGTH = 400


class Story(NamedTuple):
    """What there is to tell of one thing.

    Attributes:
        subject: the thing.
        title: what it is and how it ended.
        lines: what happened, in order of time.
    """

    subject: Subject
    title: str
    lines: tuple[Line, ...]

    @property
    def as_json(self) -> dict[str, object]:
        """The story for programs: its lines with times in seconds."""
        return {
            "subject": str(self.subject),
            "title": self.title,
            "lines": [
                {"t_s": to_s(line.t_ns), "side": line.side.value, "text": line.text}
                for line in self.lines
            ],
        }


def story(log: LogFile, subject: Subject) -> Story:
    """The story of one thing in a run; of a log as the ground had it, what the ground could know.

    Raises:
        SubjectError: if there is no such thing. The message says which there are.
        LogError: if the log is damaged.
    """
    search = Search(log)
    match subject.kind:
        case Kind.COMMAND:
            title, lines = command_story(search, subject.number)
        case Kind.PROPOSAL:
            title, lines = proposal_story(search, subject.number)
        case Kind.EVENT:
            title, lines = event_story(search, subject.number)
        case Kind.GOAL:
            title, lines = goal_story(search, subject.tokens)
        case Kind.FRAME:
            title, lines = frame_story(search, subject.direction, subject.number)
    told = dict.fromkeys(line._replace(text=one_line(line.text, _LENGTH)) for line in lines)
    ordered = sorted(told, key=lambda line: (line.t_ns, line.is_sending))
    return Story(subject, one_line(title, _LENGTH), tuple(ordered))


def story_lines(told: Story) -> Iterator[tuple[str, str, str, str]]:
    """The rows of a story: the time, the time since the row before, the side, and what happened."""
    before_ns: int | None = None
    for line in told.lines:
        since = ""
        if before_ns is not None and line.t_ns > before_ns:
            since = f"+{to_s(line.t_ns - before_ns):.2f}"
        yield f"{to_s(line.t_ns):.2f} s", since, line.side.value, line.text
        before_ns = line.t_ns
