"""The progress of what goes through a run, in simulated seconds."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn

from farside.missions.commands.display.bar import Bar


@contextmanager
def going_through(words: str, end_s: float, console: Console) -> Iterator[Callable[[float], None]]:
    """A bar on the terminal while something goes through a run; silent without a terminal.

    Args:
        words: what is done.
        end_s: where it ends.
        console: where to show the bar.

    Yields:
        what to call with the simulated time that it has come to.
    """
    bar = Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.completed:.0f} / {task.total:.0f} s"),
        console=console,
    )
    task = bar.add_task(words, total=end_s)

    def come_to(now_s: float) -> None:
        bar.update(task, completed=now_s)

    with bar:
        yield come_to
