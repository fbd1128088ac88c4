"""A run's log: writing and reading it, querying a run, and showing one.

`recording` writes a log, with the pictures of `foxglove`, and `file` reads it; `views` answers
queries on a run; `events` and `picture` say what happened, and `terminal` shows it.
"""

from farside.logs.events import EventLine, sign_text, time_text
from farside.logs.file.digest import Digest, digest_of
from farside.logs.file.index import Attachment, LogError
from farside.logs.file.packing import Recovered, recover
from farside.logs.file.reading import LogEntry, LogFile, decode
from farside.logs.picture import LinkPicture, Picture, picture_at
from farside.logs.recording import Recorder
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
