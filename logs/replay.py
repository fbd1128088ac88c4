"""Playing a log back in the terminal."""

import math
import shlex
import time
from collections.abc import Callable

from rich.console import Console, RenderableType
from rich.live import Live
from rich.text import Text

from farside.logs.picture import SHOWN, Picture, picture_at
from farside.logs.reading import LogFile, decoded
from farside.logs.screen import screen
from farside.logs.story import TOLD, clock
from farside.node import to_ns, to_s

_FRAME_S = 0.1
"""Wall time between two pictures: smooth to the eye, and little to send over a slow terminal."""


def play(
    log: LogFile,
    console: Console,
    *,
    speed: float = 1.0,
    start_s: float = 0.0,
    sleep: Callable[[float], None] = time.sleep,
    now: Callable[[], float] = time.monotonic,
) -> None:
    """Show a log as a moving picture; where no terminal looks on, as one line for each event.

    Ends with the log, leaving its last picture on the terminal, or quietly on Ctrl-C.

    Args:
        log: the run.
        console: where to show it.
        speed: simulated seconds in a wall second; `math.inf` shows the end at once. Lines are
            not paced.
        start_s: simulated time to begin at.
        sleep: waits for so many seconds.
        now: wall time in seconds from any origin.

    Raises:
        ValueError: if `speed` is not positive or `start_s` is not within the run.
        LogError: if the log is damaged.
    """
    if not speed > 0:
        raise ValueError(f"speed must be more than 0, not {speed:g}")
    if not 0 <= start_s <= to_s(log.end_ns):
        raise ValueError(f"the start must be within the run, 0 to {to_s(log.end_ns)} s: {start_s}")
    try:
        if console.is_interactive:
            _Film(log, console, speed, to_ns(start_s)).show(sleep, now)
        else:
            _print_lines(log, console, to_ns(start_s))
    except KeyboardInterrupt:
        return
    if not log.complete:
        console.print(
            "The log ends here unfinished: the process that wrote it was cut off, or is still at "
            f"work. To make it whole: farside recover {shlex.quote(str(log.path))}",
            soft_wrap=True,
            markup=False,
            highlight=False,
        )


def _print_lines(log: LogFile, console: Console, start_ns: int) -> None:
    picture = Picture()
    for record in log.records(TOLD):
        line = picture.apply(decoded(record))
        if line is not None and line.t_ns >= start_ns:
            text = f"{clock(line.t_ns):>10}  {line.who:<6}  {line.text}"
            console.print(Text(text), soft_wrap=True)


class _Film:
    """A log in motion: the picture so far, and the entries to come."""

    def __init__(self, log: LogFile, console: Console, speed: float, start_ns: int) -> None:
        self._log = log
        self._console = console
        self._speed = speed
        self._now_ns = self._start_ns = start_ns
        self._picture = picture_at(log, start_ns)
        self._coming = map(decoded, log.records(SHOWN, start_ns=start_ns + 1))
        self._next = next(self._coming, None)

    def show(self, sleep: Callable[[float], None], now: Callable[[], float]) -> None:
        began_s = now()
        with Live(console=self._console, auto_refresh=False, screen=True) as live:
            self._run_to(self._start_ns)
            while self._now_ns < self._log.end_ns:
                live.update(self._screen(self._console.height), refresh=True)
                sleep(_FRAME_S)
                self._run_to(self._due_ns(now() - began_s))
        # Left on the ordinary screen, with a row free for the prompt.
        self._console.print(self._screen(self._console.height - 1))

    def _due_ns(self, wall_s: float) -> int:
        if math.isinf(self._speed):
            return self._log.end_ns
        return min(self._start_ns + to_ns(wall_s * self._speed), self._log.end_ns)

    def _run_to(self, time_ns: int) -> None:
        while self._next is not None and self._next.log_time_ns <= time_ns:
            self._picture.apply(self._next)
            self._next = next(self._coming, None)
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
