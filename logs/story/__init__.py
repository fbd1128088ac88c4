"""What a log answers: one thing's life, one moment's reasons, and what led to a record."""

from farside.logs.story.causes import Cause, causes, causes_of
from farside.logs.story.journey import Line
from farside.logs.story.search import Found, Search
from farside.logs.story.story import Story, story, story_lines
from farside.logs.story.subjects import Kind, Subject, SubjectError, subject_of

__all__ = [
    "Cause",
    "Found",
    "Kind",
    "Line",
    "Search",
    "Story",
    "Subject",
    "SubjectError",
    "causes",
    "causes_of",
    "story",
    "story_lines",
    "subject_of",
]
