"""The progress display of a run."""

from collections.abc import Sequence
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn

from farside.logs import LogEntry, Picture
from farside.missions.commands.display.bar import Bar
from farside.missions.conductor import Watcher
from farside.missions.schema import MissionFile
from farside.node import Record, Role
from farside.topics import LINK_OUTAGE, ROVER_FAILSAFE, ROVER_MODE

_SHOWN = {topic.name for topic in (ROVER_MODE, ROVER_FAILSAFE, LINK_OUTAGE)}


class ProgressDisplay(Watcher):
    """A progress bar with simulated time, mode, failsafe and link; silent without a terminal.

    A context manager and a `Watcher`.

    Args:
        mission: the mission of the run.
        console: where to show the bar.
    """

    def __init__(self, mission: MissionFile, console: Console) -> None:
        self._picture = Picture()
        self._progress = Bar(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.completed:.0f} / {task.total:.0f} s"),
            TextColumn("{task.fields[state]}"),
            console=console,
        )
        self._duration_s = mission.duration_s
        self._task = self._progress.add_task(mission.name, total=mission.duration_s, state="")

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `farside.missions.conductor.Watcher`."""
        for record in records:
            if record.topic in _SHOWN:
                self._picture.apply(LogEntry.of(record))
        state = self._state() if now_s < self._duration_s else "finishing the log"
        self._progress.update(self._task, completed=now_s, state=state)

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `farside.missions.conductor.Watcher`. Shown without a terminal, too."""
        self._progress.console.print(
            f"waiting for {', '.join(roles)}, {waited_s:.0f} s", style="yellow", soft_wrap=True
        )

    def _state(self) -> str:
        picture = self._picture
        out = [direction for direction, side in picture.link.items() if side.down]
        link = f"[red]out: {', '.join(sorted(out))}[/]" if out else "[green]ok[/]"
        return f"{picture.mode or ''}, failsafe {picture.failsafe or ''}, link {link}"

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()
