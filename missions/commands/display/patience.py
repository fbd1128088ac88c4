"""Says what a command does where it takes long."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from threading import Timer

PATIENCE_S = 2.0
"""Who waits for longer than this is told what for (project default)."""


@contextmanager
def patience(words: str) -> Iterator[None]:
    """Within this, a line on the terminal says `words`, once it takes longer than `PATIENCE_S`."""
    if not sys.stderr.isatty():
        yield
        return
    with ExitStack() as shown:
        timer = Timer(PATIENCE_S, _show, [words, shown])
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            timer.join()


def _show(words: str, shown: ExitStack) -> None:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn

    from farside.missions.commands.display.bar import Bar

    bar = Bar(TextColumn(words), BarColumn(), console=Console(stderr=True))
    bar.add_task("", total=None)
    shown.enter_context(bar)
