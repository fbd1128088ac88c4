"""A run's log: writing and reading it, querying a run, and showing one.

`open` a log to ask about the run in it. `file` writes and reads it, `views` answers queries on a
run; `events` and `picture` say what happened, and `terminal` shows it. A name is imported when it
is first used: who only reads a log does not wait for what draws one.
"""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.logs.events import EventLine, sign_text, time_text
    from farside.logs.file.digest import Digest, digest_of
    from farside.logs.file.packing import Recovered, recover
    from farside.logs.file.parts import Attachment, LogError
    from farside.logs.file.reading import LogEntry, LogFile, decode
    from farside.logs.moments import Moments, picture_at
    from farside.logs.picture import LinkPicture, Picture
    from farside.logs.recording import Recorder
    from farside.logs.result import Outcome, RunResult
    from farside.logs.spans import (
        Believed,
        CommandLife,
        CommandVerdict,
        FailsafeSpan,
        GoalSpan,
        LinkCounters,
        ModeSpan,
        OutageSpan,
    )
    from farside.logs.terminal.replay import replay
    from farside.logs.terminal.screen import screen
    from farside.logs.views.run import RunView, open  # noqa: A004 - see there

_HOMES = {
    "events": ("EventLine", "sign_text", "time_text"),
    "file.digest": ("Digest", "digest_of"),
    "file.packing": ("Recovered", "recover"),
    "file.parts": ("Attachment", "LogError"),
    "file.reading": ("LogEntry", "LogFile", "decode"),
    "recording": ("Recorder",),
    "moments": ("Moments", "picture_at"),
    "picture": ("LinkPicture", "Picture"),
    "result": ("Outcome", "RunResult"),
    "spans": (
        "Believed",
        "CommandLife",
        "CommandVerdict",
        "FailsafeSpan",
        "GoalSpan",
        "LinkCounters",
        "ModeSpan",
        "OutageSpan",
    ),
    "terminal.replay": ("replay",),
    "terminal.screen": ("screen",),
    "views.run": ("RunView", "open"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Attachment",
    "Believed",
    "CommandLife",
    "CommandVerdict",
    "Digest",
    "EventLine",
    "FailsafeSpan",
    "GoalSpan",
    "LinkCounters",
    "LinkPicture",
    "LogEntry",
    "LogError",
    "LogFile",
    "ModeSpan",
    "Moments",
    "OutageSpan",
    "Outcome",
    "Picture",
    "Recorder",
    "Recovered",
    "RunResult",
    "RunView",
    "decode",
    "digest_of",
    "open",
    "picture_at",
    "recover",
    "replay",
    "screen",
    "sign_text",
    "time_text",
]

__getattr__ = lazily(__name__, _HOME)
