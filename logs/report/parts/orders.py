"""The commands: each with its life on board, and with what the ground was told of it."""

from collections import Counter
from heapq import heappop, heappush
from typing import Any

from farside.control import CommandStage, Verdict
from farside.logs.events import order_text, when_text
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import CommandRow, Side, View
from farside.logs.report.thinning import Rows, ms
from farside.node import Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_LIFE,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
    LifeEntry,
)

_DONE = 2500
_OTHERS = 1500
_SLOWEST = 20
_KNOWN = {Verdict.ON_TIME, Verdict.LATE}


class Orders:
    """A row for each command; where there are too many, the slowest stay."""

    topics: tuple[Topic[Any], ...] = (GROUND_COMMAND, GROUND_LIFE, ROVER_COMMAND)

    def __init__(self, side: Side) -> None:
        self._as_ground = side.is_ground
        self._open: dict[int, CommandRow] = {}
        self._done: Rows[CommandRow] = Rows(_DONE)
        self._others: Rows[CommandRow] = Rows(_OTHERS)
        self._slowest: list[tuple[int, int, CommandRow]] = []
        self._counts: Counter[str] = Counter()

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        now = ms(entry.log_time_ns)
        match entry.message:
            case CommandSent(number=number, order=order, when=when):
                text = order_text(order) + when_text(when)
                self._open[number] = CommandRow(number, text, now)
            case CommandEntry(number=number, stage=stage, why=why):
                if (row := self._open.get(number)) is not None:
                    _come(row, stage, now, why)
            case LifeEntry(number=number) as life:
                if (row := self._open.get(number)) is not None:
                    self._learn(row, life, now)

    def _learn(self, row: CommandRow, life: LifeEntry, now: int) -> None:
        if life.stage is None or life.verdict not in _KNOWN:
            return
        if self._as_ground and life.so_ns is not None:
            _come(row, life.stage, ms(life.so_ns), life.why)
        if life.stage is CommandStage.TAKEN:
            row.told_taken = now if row.told_taken is None else row.told_taken
        elif life.stage is CommandStage.BEGUN:
            row.told_begun = now if row.told_begun is None else row.told_begun
        elif life.stage.is_last:
            row.told_ended = now
            self._keep(self._open.pop(row.number))

    def _keep(self, row: CommandRow) -> None:
        self._counts[row.end] += 1
        if row.end != CommandStage.DONE:
            self._others.add(row)
            return
        self._done.add(row)
        took = (row.ended or row.sent) - row.sent
        heappush(self._slowest, (took, -row.number, row))
        if len(self._slowest) > _SLOWEST:
            heappop(self._slowest)

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        for row in self._open.values():
            self._keep(row)
        slowest = (row for _, _, row in self._slowest)
        rows = {row.number: row for row in (*self._done.rows, *self._others.rows, *slowest)}
        view.commands = [rows[number] for number in sorted(rows)]
        view.command_counts = dict(self._counts)
        if self._done.every > 1:
            view.notes.append(
                f"Commands that were done: 1 of {self._done.every}, and the {_SLOWEST} slowest"
            )
        if self._others.every > 1:
            view.notes.append(f"Commands that were not done: 1 of {self._others.every}")


def _come(row: CommandRow, stage: CommandStage, t: int, why: str | None) -> None:
    if stage is CommandStage.TAKEN and row.taken is None:
        row.taken = t
    elif stage is CommandStage.BEGUN and row.begun is None:
        row.begun = t
    elif stage.is_last and not row.end:
        row.ended, row.end, row.why = t, str(stage), why or ""
