"""A run's log: writing and reading it, querying a run, and showing one.

`recording` and `schemas` write the file and `reading` reads it; `views` answers queries on a run;
`events` and `picture` say what happened, and `terminal` shows it.
"""

from farside.logs.events import EventLine, sign_text, time_text
from farside.logs.file.digest import Digest, digest_of
from farside.logs.file.index import Attachment, LogError
from farside.logs.file.packing import Recovered, recover
from farside.logs.file.reading import LogEntry, LogFile, decode
from farside.logs.file.recording import Recorder
from farside.logs.moments import Moments, picture_at
from farside.logs.picture import LinkPicture, Picture
from farside.logs.spans import GoalSpan, LinkCounters, ModeSpan, OutageSpan
from farside.logs.terminal.replay import replay
from farside.logs.terminal.screen import screen
from farside.logs.views import RunView

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
    "Moments",
    "OutageSpan",
    "Picture",
    "Recorder",
    "Recovered",
    "RunView",
    "decode",
    "digest_of",
    "picture_at",
    "recover",
    "replay",
    "screen",
    "sign_text",
    "time_text",
]
