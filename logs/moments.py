"""Pictures of any moment of a log, and the events about it, read through the log's index."""

from collections.abc import Iterator
from typing import Any, Protocol, cast

from farside.logs.events import EVENT_TOPICS, EventLine
from farside.logs.file.reading import LogEntry, decode
from farside.logs.known import COMMAND_TOPICS
from farside.logs.picture import PICTURE_TOPICS, Picture, recent_since_ns
from farside.logs.playing import Source
from farside.node import NS_PER_S, Record, Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_HELD,
    GROUND_LIFE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_GOAL,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    CommandSent,
)

_ADDING_UP = (ROVER_GOAL, GROUND_HELD, LINK_OUTAGE)
"""Rare, and each message changes what the ones before left: read from the start."""

_TELEMETRY = (GROUND_TELEMETRY, GROUND_STORED_TELEMETRY)
_ACTION = (ROVER_ACTION_STARTED, ROVER_ACTION_ENDED)
_PROPOSAL = (ROVER_PROPOSAL, ROVER_PROPOSAL_ENDED, ROVER_GOAL)

_READ_APART = {
    *_ADDING_UP, *_TELEMETRY, *_ACTION, *_PROPOSAL, GROUND_COMMAND, GROUND_LIFE, LINK_FRAME,
}  # fmt: skip
_LATEST = tuple(topic for topic in PICTURE_TOPICS if topic not in _READ_APART)
"""Of these the last message says it all."""

_NEWS_TOPICS = tuple(dict.fromkeys((*EVENT_TOPICS, *COMMAND_TOPICS)))

_FIRST_STEP_NS = 8 * NS_PER_S
_APART_NS = 10 * NS_PER_S
_BEFORE_NS = 12 * _APART_NS
_KEPT = 256


class Scene(Source, Protocol):
    """What pictures are made of: a `LogFile`."""

    @property
    def is_as_ground(self) -> bool:
        """See `LogFile`."""
        ...


def picture_at(log: Scene, time_ns: int) -> Picture:
    """The picture of a run at a time, of which no more is read than it tells of; as ground, if so.

    That is the last ten minutes, what is older and still so, and the goals and outages from the
    start.

    Raises:
        LogError: if the log is damaged there.
    """
    since_ns = recent_since_ns(time_ns)
    picture = _state_at(log, since_ns - 1) if since_ns > 0 else _blank(log)
    _play(picture, log, PICTURE_TOPICS, since_ns, time_ns)
    picture.settle(time_ns)
    return picture


class Moments:
    """Pictures of a log, at once wherever one was asked for nearby; and the events about a time.

    Pictures are kept on the way, so that time may run backwards. What they need of memory does
    not depend on the length of the log.

    Args:
        log: the log; it may grow.
    """

    def __init__(self, log: Scene) -> None:
        self._log = log
        self._kept: dict[int, Picture] = {}

    def at(self, time_ns: int) -> Picture:
        """The picture at a time, which the caller may move on.

        Raises:
            LogError: if the log is damaged there.
        """
        near = [kept for kept in self._kept if time_ns - _BEFORE_NS <= kept <= time_ns]
        begin_ns = max(near, default=max(0, time_ns - _BEFORE_NS) // _APART_NS * _APART_NS)
        if begin_ns not in self._kept:
            self._keep(begin_ns, picture_at(self._log, begin_ns))
        picture = self._kept[begin_ns].copy()
        for kept_ns in range(begin_ns + _APART_NS, time_ns + 1, _APART_NS):
            _play(picture, self._log, PICTURE_TOPICS, kept_ns - _APART_NS + 1, kept_ns)
            picture.settle(kept_ns)
            self._keep(kept_ns, picture.copy())
            begin_ns = kept_ns
        _play(picture, self._log, PICTURE_TOPICS, begin_ns + 1, time_ns)
        picture.settle(time_ns)
        return picture

    def _keep(self, time_ns: int, picture: Picture) -> None:
        self._kept[time_ns] = picture
        if len(self._kept) > _KEPT:
            del self._kept[next(iter(self._kept))]

    def next_event(self, time_ns: int) -> EventLine | None:
        """The first event after a time that is not routine; `None` without one.

        Raises:
            LogError: if the log is damaged on the way.
        """
        picture = self.at(time_ns)
        lines = _lines(picture, self._log.records(_NEWS_TOPICS, start_ns=time_ns + 1))
        return next(lines, None)

    def previous_event(self, time_ns: int) -> EventLine | None:
        """The last event before a time that is not routine; `None` without one.

        Raises:
            LogError: if the log is damaged on the way.
        """
        for begin_ns, end_ns in _backwards(time_ns - 1):
            picture = _state_at(self._log, begin_ns - 1)
            records = self._log.records(_NEWS_TOPICS, start_ns=begin_ns, end_ns=end_ns)
            if lines := list(_lines(picture, records)):
                return lines[-1]
        return None


def _lines(picture: Picture, records: Iterator[Record]) -> Iterator[EventLine]:
    for record in records:
        line = picture.apply(LogEntry.of(record))
        if line is not None and not line.routine:
            yield line


def _backwards(end_ns: int) -> Iterator[tuple[int, int]]:
    """Stretches from `end_ns` back to 0, each twice as long as the one after it."""
    length_ns = _FIRST_STEP_NS
    while end_ns >= 0:
        begin_ns = max(0, end_ns - length_ns + 1)
        yield begin_ns, end_ns
        end_ns, length_ns = begin_ns - 1, 2 * length_ns


def _play(
    picture: Picture, log: Scene, topics: tuple[Topic[Any], ...], start_ns: int, end_ns: int
) -> None:
    for record in log.records(topics, start_ns=start_ns, end_ns=end_ns):
        picture.apply(LogEntry.of(record))


def _blank(log: Scene) -> Picture:
    return Picture(as_ground=log.is_as_ground)


def _state_at(log: Scene, time_ns: int) -> Picture:
    """What is so at a time, without anything that only happened: track, events, frames."""
    picture = _blank(log)
    latest = _latest(log, (*_LATEST, *_TELEMETRY, _ACTION[0], _PROPOSAL[0]), time_ns)
    proposed_ns = _time_ns(latest, ROVER_PROPOSAL, time_ns + 1)
    _play(picture, log, _ADDING_UP, 0, proposed_ns - 1)
    _play(picture, log, (*_ADDING_UP, *_PROPOSAL), proposed_ns, time_ns)
    if ROVER_ACTION_STARTED.name in latest:
        started_ns = _time_ns(latest, ROVER_ACTION_STARTED, 0)
        _play(picture, log, _ACTION, started_ns, time_ns)
    heard_ns = max((_time_ns(latest, topic, 0) for topic in _TELEMETRY), default=0)
    _play(picture, log, _TELEMETRY, recent_since_ns(heard_ns), time_ns)
    for topic in _LATEST:
        if topic.name in latest:
            picture.apply(LogEntry.of(latest[topic.name]))
    _know_commands(picture, log, time_ns)
    picture.lines.clear()
    picture.visited.clear()
    return picture


def _latest(log: Scene, topics: tuple[Topic[Any], ...], time_ns: int) -> dict[str, Record]:
    """The last record of each topic up to a time, by name, as far as there is one."""
    found: dict[str, Record] = {}
    missing = list(topics)
    for begin_ns, end_ns in _backwards(time_ns):
        found |= {
            record.topic: record
            for record in log.records(missing, start_ns=begin_ns, end_ns=end_ns)
        }
        missing = [topic for topic in missing if topic.name not in found]
        if not missing:
            break
    return found


def _time_ns(latest: dict[str, Record], topic: Topic[Any], default_ns: int) -> int:
    return latest[topic.name].log_time_ns if topic.name in latest else default_ns


def _know_commands(picture: Picture, log: Scene, time_ns: int) -> None:
    """The commands that were not known to be over; all up to a number are, by telemetry."""
    done = picture.telemetry.commands_done if picture.telemetry else 0
    sent_ns = time_ns + 1
    for begin_ns, end_ns in _backwards(time_ns):
        records = list(log.records([GROUND_COMMAND], start_ns=begin_ns, end_ns=end_ns))
        sent = [(cast("CommandSent", decode(record)).number, record) for record in records]
        sent_ns = min(
            (record.log_time_ns for number, record in sent if number > done), default=sent_ns
        )
        if any(number <= done + 1 for number, _ in sent):
            break
    _play(picture, log, (GROUND_COMMAND, GROUND_LIFE), sent_ns, time_ns)
    open_ = picture.commands.open
    for number in [number for number in open_ if number <= done]:
        del open_[number]
    picture.commands.ended.clear()
