"""Replaying a log in the terminal."""

import math
import shlex
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from rich.console import Console, RenderableType
from rich.live import Live
from rich.text import Text

from farside.escaping import printable
from farside.logs.events import EVENT_TOPICS, time_text
from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.picture import PICTURE_TOPICS, Picture, picture_at
from farside.logs.terminal.screen import screen
from farside.node import to_ns, to_s

_UPDATE_S = 0.1
"""Wall time between two screen updates: smooth to the eye, and light on a slow terminal."""


def _unseen(_words: str) -> AbstractContextManager[None]:
    return nullcontext()


def replay(
    log: LogFile,
    console: Console,
    *,
    speed: float = 1.0,
    start_s: float = 0.0,
    sleep: Callable[[float], None] = time.sleep,
    now: Callable[[], float] = time.monotonic,
    waiting: Callable[[str], AbstractContextManager[None]] = _unseen,
) -> None:
    """Replay a log on a terminal screen or, where output is not a terminal, print its event lines.

    Returns at the end of the log, leaving the last screen on the terminal, or on Ctrl-C.

    Args:
        log: the log to replay.
        console: where to show it.
        speed: simulated seconds per wall second; `math.inf` goes straight to the end. Printed
            lines are not paced.
        start_s: simulated time at which to start.
        sleep: waits for a number of wall seconds.
        now: wall time in seconds, from any origin.
        waiting: is entered, with words on what for, while a person has to wait.

    Raises:
        ValueError: if `speed` is not positive or `start_s` is not within the run.
        LogError: if the log is damaged.
    """
    if not speed > 0:
        raise ValueError(f"expected a speed above 0, found {speed:g}")
    if not 0 <= start_s <= to_s(log.end_ns):
        raise ValueError(
            f"expected a start within the run, 0 to {to_s(log.end_ns)} s, found {start_s} s"
        )
    try:
        if console.is_interactive:
            with waiting("reading the log up to the start"):
                playing = _Replay(log, console, speed, to_ns(start_s))
            playing.show(sleep, now)
        else:
            _print_lines(log, console, to_ns(start_s))
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


def _print_lines(log: LogFile, console: Console, start_ns: int) -> None:
    picture = Picture(as_ground=log.is_as_ground)
    for record in log.records(EVENT_TOPICS):
        line = picture.apply(LogEntry.of(record))
        if line is not None and line.t_ns >= start_ns:
            text = f"{time_text(line.t_ns):>11}  {line.role:<6}  {line.text}"
            console.print(Text(text), soft_wrap=True)


class _Replay:
    """A replay in progress: the picture so far and the entries still to come."""

    def __init__(self, log: LogFile, console: Console, speed: float, start_ns: int) -> None:
        self._log = log
        self._console = console
        self._speed = speed
        self._now_ns = self._start_ns = start_ns
        self._picture = picture_at(log, start_ns)
        coming = log.records(PICTURE_TOPICS, start_ns=start_ns + 1)
        self._remaining = map(LogEntry.of, coming)
        self._next = next(self._remaining, None)

    def show(self, sleep: Callable[[float], None], now: Callable[[], float]) -> None:
        began_s = now()
        with Live(console=self._console, auto_refresh=False, screen=True) as live:
            self._run_to(self._start_ns)
            while self._now_ns < self._log.end_ns:
                live.update(self._screen(self._console.height), refresh=True)
                sleep(_UPDATE_S)
                self._run_to(self._due_ns(now() - began_s))
        # On the ordinary screen this one stays, with a row free for the prompt.
        self._console.print(self._screen(self._console.height - 1))

    def _due_ns(self, wall_s: float) -> int:
        if math.isinf(self._speed):
            return self._log.end_ns
        return min(self._start_ns + to_ns(wall_s * self._speed), self._log.end_ns)

    def _run_to(self, time_ns: int) -> None:
        while self._next is not None and self._next.log_time_ns <= time_ns:
            self._picture.apply(self._next)
            self._next = next(self._remaining, None)
        self._now_ns = time_ns

    def _screen(self, height: int) -> RenderableType:
        speed = "max" if math.isinf(self._speed) else f"×{self._speed:g}"
        return screen(
            self._picture,
            self._now_ns,
            width=self._console.width,
            height=height,
            title=f"{self._log.path.name}  {speed}",
            end_ns=self._log.end_ns,
        )
