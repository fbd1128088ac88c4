"""The orders of a log, read into the mission that is to give them again."""

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from farside.ground.config import RecordedConfig, RecordedLine
from farside.missions.schema import MissionFile
from farside.node import Topic
from farside.topics import GROUND_OPERATOR, GROUND_ORDER
from farside.validation import Problem

if TYPE_CHECKING:
    from farside.logs import LogFile

MAX_ORDERS = 100_000
"""The most orders of a log, and the most records of how far its operator had come, that are given
again (project default). All of them go into the mission, and so into memory."""

_KEY = ("ground", "recorded")


class RecordedError(Exception):
    """The orders of a log cannot be had; `problem` says why."""

    def __init__(self, key: tuple[str, ...], text: str) -> None:
        super().__init__(text)
        self.problem = Problem(key, text)


def with_recorded(mission: MissionFile, folder: Path) -> MissionFile:
    """A mission with the orders in it that its recorded operator is to give.

    Resolving it again changes nothing, and where the operator is another one nothing is read.

    Args:
        mission: the mission.
        folder: what the path of the log is relative to.

    Raises:
        RecordedError: if there is no such log, it is damaged, has no orders or too many, or the
            mission names none.
    """
    recorded = mission.ground.recorded
    if mission.ground.operator != "recorded":
        return mission
    if (recorded.log is None) == (recorded.orders is None):
        found = "neither" if recorded.log is None else "both"
        raise RecordedError(_KEY, f"expected either log or orders, found {found}")
    if recorded.log is None:
        return mission
    ground = msgspec.structs.replace(mission.ground, recorded=_read(folder / recorded.log))
    return msgspec.structs.replace(mission, ground=ground)


def _read(path: Path) -> RecordedConfig:
    # Imports the readers of logs, which no other mission needs to be checked.
    from farside.logs import LogError, LogFile  # noqa: PLC0415

    try:
        log = LogFile(path)
        if GROUND_ORDER.name not in {channel.topic for channel in log.index.channels.values()}:
            text = f"expected a log with the orders of its operator, found none in {path}"
            raise RecordedError((*_KEY, "log"), f"{text}: it is older than they are")
        orders, progress = _lines(log, GROUND_ORDER), _lines(log, GROUND_OPERATOR)
    except (LogError, ValueError) as error:
        raise RecordedError((*_KEY, "log"), f"expected a log, found: {error}") from error
    if log.holes:  # orders may be missing
        text = f"expected a whole log, found that {path} is damaged: {log.holes[0]}"
        raise RecordedError((*_KEY, "log"), text)
    return RecordedConfig(orders=orders, progress=progress)


def _lines(log: "LogFile", topic: Topic[Any]) -> tuple[RecordedLine, ...]:
    records = list(islice(log.records([topic]), MAX_ORDERS + 1))
    if len(records) > MAX_ORDERS:
        text = f"expected at most {MAX_ORDERS} messages of {topic.name}, found more in {log.path}"
        raise RecordedError((*_KEY, "log"), text)
    return tuple(
        RecordedLine(time_ns=record.log_time_ns, json=record.payload.decode()) for record in records
    )
