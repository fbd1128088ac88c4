"""Replaying a log in the terminal."""

import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext

from rich.console import Console
from rich.text import Text

from farside.escaping import printable
from farside.logs.events import EVENT_TOPICS, time_text
from farside.logs.file.following import LOOK_AGAIN_S, followed, start_of
from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.picture import Picture
from farside.node import Record


def _unseen(_words: str) -> AbstractContextManager[None]:
    return nullcontext()


def replay(
    log: LogFile,
    console: Console,
    *,
    speed: float = 1.0,
    start_s: float | None = None,
    follow: bool = False,
    sleep: Callable[[float], None] = time.sleep,
    waiting: Callable[[str], AbstractContextManager[None]] = _unseen,
) -> None:
    """Replay a log on the terminal's screen or, where there is none, print its event lines.

    Returns when the screen is left, or once the lines are printed.

    Args:
        log: the log to replay.
        console: where to show it.
        speed: simulated seconds per wall second; `math.inf` goes straight to the end. Printed
            lines are not paced.
        start_s: simulated time at which to start; by default the beginning or, to follow on the
            screen, what was written last.
        follow: go on as the log grows, until it is whole.
        sleep: waits for a number of wall seconds.
        waiting: is entered, with words on what for, while a person has to wait.

    Raises:
        ValueError: if `speed` is not positive or `start_s` is not within the run.
        LogError: if the log is damaged.
    """
    if not speed > 0:
        raise ValueError(f"expected a speed above 0, found {speed:g}")
    screen = has_screen(console)
    start_ns = start_of(log, start_s, follow=follow and screen)
    try:
        if screen:
            _show(log, speed, start_ns, follow=follow, waiting=waiting)
        else:
            coming = followed(log, EVENT_TOPICS, sleep) if follow else log.records(EVENT_TOPICS)
            _print_lines(log, console, coming, start_ns)
    except KeyboardInterrupt:
        return
    if not log.complete:
        console.print(
            "The log ends here, unfinished: its writer was killed or is still running. To make it "
            f"whole: farside recover {printable(shlex.quote(str(log.path)))}",
            soft_wrap=True,
            markup=False,
            highlight=False,
        )


def has_screen(console: Console) -> bool:
    """Whether a person sits at a terminal that can be drawn on and sends keys."""
    # Textual draws on standard error, and reads keys from standard input.
    ends = (sys.stdin, sys.stderr)
    return console.is_interactive and all(end is not None and end.isatty() for end in ends)


def _show(
    log: LogFile,
    speed: float,
    start_ns: int,
    *,
    follow: bool,
    waiting: Callable[[str], AbstractContextManager[None]],
) -> None:
    with waiting("reading the log up to the start"):
        from farside.logs.terminal.app import ReplayApp  # noqa: PLC0415 - heavy

        refresh = _Following(log) if follow else str
        app = ReplayApp(log, speed=speed, start_ns=start_ns, refresh=refresh)
    app.show()


class _Following:
    """Looks again at a log that is still being written, not more often than it pays."""

    def __init__(self, log: LogFile, now: Callable[[], float] = time.monotonic) -> None:
        self._log, self._now = log, now
        self._looked_s = now()

    def __call__(self) -> str:
        if not self._log.complete and self._now() - self._looked_s >= LOOK_AGAIN_S:
            self._log.refresh()
            self._looked_s = self._now()
        return "the run is over" if self._log.complete else "still being written"


def _print_lines(log: LogFile, console: Console, records: Iterator[Record], start_ns: int) -> None:
    picture = Picture(as_ground=log.is_as_ground)
    for record in records:
        line = picture.apply(LogEntry.of(record))
        if line is not None and line.t_ns >= start_ns:
            text = f"{time_text(line.t_ns):>11}  {line.role:<6}  {line.text}"
            console.print(Text(text), soft_wrap=True)
