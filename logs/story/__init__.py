"""What a log answers: one thing's life, one moment's reasons, and what led to a record."""

from farside.logs.story.causes import Cause, causes, causes_of
from farside.logs.story.search import Found, Search

__all__ = ["Cause", "Found", "Search", "causes", "causes_of"]
