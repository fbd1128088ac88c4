"""The progress bar of every command."""

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.progress import Progress, ProgressColumn

_CTRL_C_WIDTH = 6


class _WithRoom:
    """Leaves room on the right for what the terminal shows of Ctrl-C, pressed three times.

    At the end of a full line that would go to the next one, and the bar would be erased there.
    """

    def __init__(self, inside: RenderableType) -> None:
        self._inside = inside

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        narrower = options.update_width(max(options.max_width - _CTRL_C_WIDTH, 1))
        yield from console.render(self._inside, narrower)


class Bar(Progress):
    """A progress bar that leaves nothing on the screen, also after Ctrl-C; none without a terminal.

    Args:
        columns: what it shows.
        console: where.
    """

    def __init__(self, *columns: ProgressColumn, console: Console) -> None:
        super().__init__(*columns, console=console, transient=True, disable=not console.is_terminal)

    def get_renderable(self) -> RenderableType:
        """See `rich.progress.Progress`."""
        return _WithRoom(super().get_renderable())
