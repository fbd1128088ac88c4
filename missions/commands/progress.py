"""What a run shows while it goes on."""

from collections.abc import Sequence
from types import TracebackType
from typing import Self

import msgspec
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from farside.missions.schema import MissionFile
from farside.node import Record
from farside.topics import FailsafeEntry, LinkOutage, ModeEntry

_decode_mode = msgspec.json.Decoder(ModeEntry).decode
_decode_failsafe = msgspec.json.Decoder(FailsafeEntry).decode
_decode_outage = msgspec.json.Decoder(LinkOutage).decode


class ProgressDisplay:
    """A bar with simulated time, mode, failsafe and link; nothing where there is no terminal.

    A context manager and a `Watcher`.
    """

    def __init__(self, mission: MissionFile, console: Console) -> None:
        self._mode, self._failsafe = "", ""
        self._outages: set[str] = set()
        self._progress = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.completed:.0f} / {task.total:.0f} s"),
            TextColumn("{task.fields[state]}"),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._progress.add_task(mission.name, total=mission.duration_s, state="")

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `farside.missions.conductor.Watcher`."""
        for record in records:
            self._take(record)
        self._progress.update(self._task, completed=now_s, state=self._state())

    def _take(self, record: Record) -> None:
        match record.topic:
            case "/rover/mode":
                self._mode = _decode_mode(record.payload).mode
            case "/rover/failsafe":
                self._failsafe = _decode_failsafe(record.payload).state
            case "/link/outage":
                outage = _decode_outage(record.payload)
                (self._outages.add if outage.down else self._outages.discard)(outage.direction)

    def _state(self) -> str:
        link = (
            f"[red]out: {', '.join(sorted(self._outages))}[/]" if self._outages else "[green]ok[/]"
        )
        return f"{self._mode}, failsafe {self._failsafe}, link {link}"

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
