"""The commands: each with its life on board, and with what the ground was told of it."""

from typing import Any

from farside.control import CommandStage, Verdict
from farside.logs.events import order_text, when_text
from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.report.model import CommandRow, View
from farside.logs.report.thinning import ms
from farside.node import Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_LIFE,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
    LifeEntry,
)

_MOST = 6000
_KNOWN = {Verdict.ON_TIME, Verdict.LATE}


class Orders:
    """A row for each command."""

    topics: tuple[Topic[Any], ...] = (GROUND_COMMAND, GROUND_LIFE, ROVER_COMMAND)

    def __init__(self, log: LogFile) -> None:
        self._as_ground = log.is_as_ground
        self._rows: dict[int, CommandRow] = {}
        self._left_out = 0

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        match entry.message:
            case CommandSent(number=number, order=order, when=when):
                if len(self._rows) >= _MOST:
                    self._left_out += 1
                    return
                text = order_text(order) + when_text(when)
                self._rows[number] = CommandRow(number, text, ms(entry.log_time_ns))
            case CommandEntry(number=number, stage=stage, why=why):
                if (row := self._rows.get(number)) is not None:
                    _come(row, stage, ms(entry.log_time_ns), why)
            case LifeEntry(number=number) as life:
                if (row := self._rows.get(number)) is not None:
                    self._learn(row, life, ms(entry.log_time_ns))

    def _learn(self, row: CommandRow, life: LifeEntry, now: int) -> None:
        if life.stage is None or life.verdict not in _KNOWN:
            return
        row.told.setdefault(_slot(life.stage), now)
        if self._as_ground and life.so_ns is not None:
            _come(row, life.stage, ms(life.so_ns), life.why)

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        view.commands = list(self._rows.values())
        if self._left_out:
            view.notes.append(
                f"Commands: the first {_MOST} are shown, {self._left_out} are left out"
            )


def _slot(stage: CommandStage) -> str:
    return "ended" if stage.is_last else stage


def _come(row: CommandRow, stage: CommandStage, t: int, why: str | None) -> None:
    if stage is CommandStage.TAKEN and row.taken is None:
        row.taken = t
    elif stage is CommandStage.BEGUN and row.begun is None:
        row.begun = t
    elif stage.is_last and not row.end:
        row.ended, row.end, row.why = t, str(stage), why or ""
