"""A run's log: writing and reading it, querying a run, and showing one.

`recording` and `schemas` write the file and `reading` reads it; `views` answers queries on a run;
`events`, `picture`, `screen` and `replay` show one in a terminal.
"""

from farside.logs.events import EventLine, sign_text, time_text
from farside.logs.picture import LinkPicture, Picture
from farside.logs.reading import Attachment, LogEntry, LogFile, decode
from farside.logs.recording import Digest, LogError, Recorder, digest_of
from farside.logs.replay import replay
from farside.logs.screen import screen
from farside.logs.views import GoalSpan, LinkCounters, ModeSpan, OutageSpan, RunView

__all__ = [
    "Attachment",
    "Digest",
    "EventLine",
    "GoalSpan",
    "LinkCounters",
    "LinkPicture",
    "LogEntry",
    "LogError",
    "LogFile",
    "ModeSpan",
    "OutageSpan",
    "Picture",
    "Recorder",
    "RunView",
    "decode",
    "digest_of",
    "replay",
    "screen",
    "sign_text",
    "time_text",
]
