"""What a log holds of a run that is to be lived again: mission, changes, orders, and its end."""

from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeVar, cast

import msgspec

from farside.acts import Act
from farside.control import Chooser
from farside.logs import LogFile, decode
from farside.logs.result import LostProcessResult
from farside.missions.schema import Change, MissionFile
from farside.node import NEVER_NS, to_ns, to_s
from farside.topics import GROUND_ORDER, ROVER_ACTION_STARTED

if TYPE_CHECKING:
    from farside.topics import OrderGiven

_MISSION, _CHANGES, _RESULT = "mission.json", "changes.json", "result.json"
_TEXT, _OVERRIDES, _FILES = "mission.toml", "overrides.json", "files.json"
_NO_CHANGES: tuple[Change, ...] = ()
_NO_OVERRIDES: tuple[tuple[str, Any], ...] = ()
_PYTHON = "python"

T = TypeVar("T")


class RelivingError(Exception):
    """A run cannot be lived again. The text, meant for people, says of which log and why not."""


class _End(msgspec.Struct, frozen=True):
    """What matters here of a `RunResult`."""

    sim_seconds: Annotated[float, msgspec.Meta(ge=0, le=to_s(NEVER_NS))]
    lost_processes: tuple[LostProcessResult, ...] = ()


class Past(NamedTuple):
    """A run as its log tells it.

    Attributes:
        log: the log.
        text: the mission file.
        overrides: dotted keys and values of what was set otherwise from the start, in order.
        files: the texts of the files that its link names, by that name.
        mission: the mission that it began with, resolved.
        changes: what became of the mission, in order of time.
        end_ns: the simulated time up to which it is recorded; this moment itself is not part of it.
        lost: the processes that ended before the run.
        versions: of Farside, Python and the libraries that it was recorded with, by name.
    """

    log: LogFile
    text: str
    overrides: tuple[tuple[str, Any], ...]
    files: Mapping[str, str]
    mission: MissionFile
    changes: tuple[Change, ...]
    end_ns: int
    lost: tuple[LostProcessResult, ...]
    versions: Mapping[str, str]

    @property
    def until_ns(self) -> int:
        """How far it can be lived again: to its end, or to the loss of its first process."""
        return min([self.end_ns, *(to_ns(lost.since_s) for lost in self.lost)])

    def orders(self) -> Iterator[tuple[int, tuple[Act, ...]]]:
        """What was ordered, by simulated time; read from the log as it is asked for.

        Before the first is given, all are read once: so either error comes at the start.

        Raises:
            LogError: if an order cannot be read.
            RelivingError: if the log is damaged, so that orders may be missing.
        """
        yield from self._whole(self._orders, "orders")

    def actions(self) -> Iterator[tuple[int, str]]:
        """What the rover began of its own choice, by simulated time; see `orders`."""
        yield from self._whole(self._actions, "actions")

    def _whole(self, read: Callable[[], Iterator[T]], what: str) -> Iterator[T]:
        for _ in read():
            pass
        if self.log.holes:
            raise RelivingError(
                f"{self.log.path}: expected a whole log, as the {what} in it are to be given "
                f"again, found that it is damaged: {self.log.holes[0]}"
            )
        yield from read()

    def _actions(self) -> Iterator[tuple[int, str]]:
        for record in self.log.records([ROVER_ACTION_STARTED]):
            started = ROVER_ACTION_STARTED.decode(record.payload)
            if started.chooser in {Chooser.EXPLORATORY, Chooser.GOAL_DIRECTED}:
                yield record.log_time_ns, started.action

    def _orders(self) -> Iterator[tuple[int, tuple[Act, ...]]]:
        records = self.log.records([GROUND_ORDER])
        for time_ns, given in groupby(records, attrgetter("log_time_ns")):
            yield time_ns, tuple(cast("OrderGiven", decode(record)).act for record in given)

    def other_versions(self) -> Iterator[tuple[str, str, str]]:
        """What is installed here in another version than it was recorded with: name, then, now."""
        for name, then in self.versions.items():
            now = _installed(name)
            if now != then:
                yield name, then, now

    def not_whole(self) -> str | None:
        """Why it cannot be lived again to its end, in words; `None` if it can."""
        if not self.lost:
            return None
        lost = self.lost[0]
        return (
            f"its {lost.role} {lost.how} at {lost.since_s:g} s of simulated time, and what makes "
            f"a process end is not in a log"
        )


def read_past(log: LogFile | Path | str) -> Past:
    """The run in a log, which may be open.

    Raises:
        LogError: if the log cannot be read.
        RelivingError: if it holds no mission, or one that this Farside cannot read.
    """
    log = log if isinstance(log, LogFile) else LogFile(Path(log))
    mission = _attached(log, _MISSION, MissionFile)
    changes = _attached(log, _CHANGES, tuple[Change, ...], _NO_CHANGES)
    # A log that nobody finished: what it tells of last happened in a tick that it holds in part.
    last_s = to_s((log.end_ns // mission.tick_ns + 1) * mission.tick_ns)
    duration_s = (changes[-1].mission if changes else mission).duration_s
    end = _attached(log, _RESULT, _End, _End(min(last_s, duration_s)))
    return Past(
        log=log,
        text=_text(log),
        overrides=_attached(log, _OVERRIDES, tuple[tuple[str, Any], ...], _NO_OVERRIDES),
        files=_attached(log, _FILES, dict[str, str], {}),
        mission=mission,
        changes=changes,
        end_ns=to_ns(end.sim_seconds),
        lost=end.lost_processes,
        versions={
            name: text
            for name, text in log.metadata.get("farside.run", {}).items()
            if name not in {"mission", "seed"}
        },
    )


def _text(log: LogFile) -> str:
    """The mission file, empty where there is none."""
    if _TEXT not in log.attachments:
        return ""
    try:
        return log.attachments[_TEXT].data.decode()
    except UnicodeDecodeError as error:
        raise RelivingError(f"{log.path}: expected UTF-8 in {_TEXT}, found: {error}") from error


def _attached(log: LogFile, name: str, kind: type[T], default: T | None = None) -> T:
    attachment = log.attachments.get(name)
    if attachment is None and default is not None:
        return default
    if attachment is None:
        raise RelivingError(
            f"{log.path}: expected a log with its mission in it, found no attachment {name}: "
            f"a run is lived again from that"
        )
    try:
        return msgspec.json.decode(attachment.data, type=kind)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        by = log.metadata.get("farside.run", {}).get("farside", "unknown")
        raise RelivingError(
            f"{log.path}: expected what this Farside can read in {name}, found: {error}; "
            f"the log was written by version {by}"
        ) from error


def _installed(name: str) -> str:
    if name == _PYTHON:
        import platform  # noqa: PLC0415

        return platform.python_version()
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def refuse_beyond(past: Past, until_s: float) -> None:
    """Refuse a moment outside what can be lived again of a run.

    Raises:
        RelivingError: if `until_s` is before its start, after its end, or after the loss of a
            process.
    """
    end_s = to_s(past.until_ns)
    if 0 <= until_s <= end_s:
        return
    why = past.not_whole() if until_s > end_s else None
    raise RelivingError(
        f"{past.log.path}: expected a moment of the run, 0 to {end_s:g} s, found {until_s:g} s"
        + (f": {why}" if why else "")
    )
