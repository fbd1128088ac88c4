"""What a log answers: one thing's life, one moment's reasons, and what led to a record."""

from farside.logs.story.causes.chain import Cause, causes, causes_of, outline
from farside.logs.story.lives.journey import Line
from farside.logs.story.moments.why import Aspect, Mind, Reasons, Section, why
from farside.logs.story.search import Found, Search
from farside.logs.story.subjects import Kind, Subject, SubjectError, subject_of
from farside.logs.story.telling import Story, story, story_lines

__all__ = [
    "Aspect",
    "Cause",
    "Found",
    "Kind",
    "Line",
    "Mind",
    "Reasons",
    "Search",
    "Section",
    "Story",
    "Subject",
    "SubjectError",
    "causes",
    "causes_of",
    "outline",
    "story",
    "story_lines",
    "subject_of",
    "why",
]
