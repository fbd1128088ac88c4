"""A run's log: writing it, reading it, asking it and playing it back.

From the bottom up: `recorder` and `schemas` write the file, `reader` reads it, `view` answers
questions about a run, and `story`, `picture`, `screen` and `replay` show one.
"""

from farside.logs.digest import Digest, digest_of
from farside.logs.index import Attachment, LogError
from farside.logs.packing import Recovered, recover
from farside.logs.picture import LinkPicture, Picture, picture_at
from farside.logs.reading import LogEntry, LogFile, decode, decoded
from farside.logs.recording import Recorder
from farside.logs.replay import play
from farside.logs.screen import screen
from farside.logs.story import StoryLine, clock
from farside.logs.views import GoalStory, LinkCounters, ModeSpan, OutageSpan, RunView

__all__ = [
    "Attachment",
    "Digest",
    "GoalStory",
    "LinkCounters",
    "LinkPicture",
    "LogEntry",
    "LogError",
    "LogFile",
    "ModeSpan",
    "OutageSpan",
    "Picture",
    "Recorder",
    "Recovered",
    "RunView",
    "StoryLine",
    "clock",
    "decode",
    "decoded",
    "digest_of",
    "picture_at",
    "play",
    "recover",
    "screen",
]
