"""Pictures of any moment of a log, and the events about it, read through the log's index."""

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from typing import Any, Protocol, TypeVar, cast

from farside.logs.events import EVENT_TOPICS, EventLine
from farside.logs.file.reading import LogEntry, decode
from farside.logs.known import COMMAND_TOPICS
from farside.logs.picture import PICTURE_TOPICS, Picture, recent_since_ns
from farside.logs.playing import Source
from farside.messages import Tokens
from farside.node import NS_PER_S, Direction, Record, Topic
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
    GoalChange,
)

K = TypeVar("K", bound=Hashable)

_TELEMETRY = (GROUND_TELEMETRY, GROUND_STORED_TELEMETRY)
_ACTION = (ROVER_ACTION_STARTED, ROVER_ACTION_ENDED)
_PROPOSAL = (ROVER_PROPOSAL, ROVER_PROPOSAL_ENDED, ROVER_GOAL)

_READ_APART = {
    *_TELEMETRY, *_ACTION, *_PROPOSAL,
    GROUND_COMMAND, GROUND_HELD, GROUND_LIFE, LINK_FRAME, LINK_OUTAGE,
}  # fmt: skip
_LATEST = tuple(topic for topic in PICTURE_TOPICS if topic not in _READ_APART)
"""Of these the last message says it all."""

_NEWS_TOPICS = tuple(dict.fromkeys((*EVENT_TOPICS, *COMMAND_TOPICS)))

_FIRST_STEP_NS = 16 * NS_PER_S
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

    That is the last ten minutes, and what is older and still so.

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
        if begin_ns in self._kept:
            picture = self._kept[begin_ns].copy()
        else:
            picture = picture_at(self._log, begin_ns)
            self._keep(begin_ns, picture)
        for kept_ns in range(begin_ns + _APART_NS, time_ns + 1, _APART_NS):
            _play(picture, self._log, PICTURE_TOPICS, kept_ns - _APART_NS + 1, kept_ns)
            picture.settle(kept_ns)
            self._keep(kept_ns, picture)
            begin_ns = kept_ns
        _play(picture, self._log, PICTURE_TOPICS, begin_ns + 1, time_ns)
        picture.settle(time_ns)
        return picture

    def _keep(self, time_ns: int, picture: Picture) -> None:
        if time_ns > self._log.there_until_ns:
            return  # more of it may come
        self._kept[time_ns] = picture.copy()
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
        if time_ns <= 0:
            return None
        recent = [line for line in self.at(time_ns - 1).lines if not line.routine]
        if recent:
            return recent[-1]
        for begin_ns, end_ns in _backwards(recent_since_ns(time_ns - 1)):
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
    """Stretches from `end_ns` back to 0, each four times as long as the one after it."""
    length_ns = _FIRST_STEP_NS
    while end_ns >= 0:
        begin_ns = max(0, end_ns - length_ns + 1)
        yield begin_ns, end_ns
        end_ns, length_ns = begin_ns - 1, 4 * length_ns


def _play(
    picture: Picture, log: Scene, topics: Collection[Topic[Any]], start_ns: int, end_ns: int
) -> None:
    for record in log.records(topics, start_ns=start_ns, end_ns=end_ns):
        picture.apply(LogEntry.of(record))


def _blank(log: Scene) -> Picture:
    return Picture(as_ground=log.is_as_ground)


def _state_at(log: Scene, time_ns: int) -> Picture:
    """What is so at a time, without anything that only happened: track, events, frames."""
    picture = _blank(log)
    latest = _latest(log, (*_LATEST, *_TELEMETRY, ROVER_ACTION_STARTED, ROVER_PROPOSAL), time_ns)
    heard_ns = max((_time_ns(latest, topic, 0) for topic in _TELEMETRY), default=0)
    _play(picture, log, _TELEMETRY, recent_since_ns(heard_ns), time_ns)
    for topic in _LATEST:
        if topic.name in latest:
            picture.apply(LogEntry.of(latest[topic.name]))
    _play(picture, log, _ACTION, _time_ns(latest, ROVER_ACTION_STARTED, time_ns + 1), time_ns)
    _play(picture, log, [GROUND_HELD], 0, time_ns)
    _know_goals(picture, log, _time_ns(latest, ROVER_PROPOSAL, time_ns), time_ns)
    _know_outages(picture, log, time_ns)
    _know_commands(picture, log, time_ns)
    picture.lines.clear()
    picture.visited.clear()
    return picture


def _latest(log: Scene, topics: Collection[Topic[Any]], time_ns: int) -> dict[str, Record]:
    """The last record of each topic up to a time, by name, as far as there is one."""
    wanted = {topic.name: topic for topic in topics}
    return _newest(log, wanted, lambda record: record.topic, time_ns)


def _newest(
    log: Scene,
    wanted: Mapping[K, Topic[Any]],
    key_of: Callable[[Record], K | None],
    time_ns: int,
) -> dict[K, Record]:
    """The last record with each key up to a time, as far as there is one.

    Args:
        log: the log.
        wanted: the topic of each key.
        key_of: the key of a record of these topics.
        time_ns: greatest log time.
    """
    found: dict[K, Record] = {}
    for begin_ns, end_ns in _backwards(time_ns):
        topics = {topic for key, topic in wanted.items() if key not in found}
        records = log.records(topics, start_ns=begin_ns, end_ns=end_ns) if topics else ()
        keyed = ((key_of(record), record) for record in records)
        found = {key: record for key, record in keyed if key is not None and key in wanted} | found
        if len(found) == len(wanted):
            break
    return found


def _time_ns(latest: Mapping[str, Record], topic: Topic[Any], default_ns: int) -> int:
    return latest[topic.name].log_time_ns if topic.name in latest else default_ns


def _know_goals(picture: Picture, log: Scene, proposed_ns: int, time_ns: int) -> None:
    """The Goal List: as telemetry had it, and what changed since; and the proposal that stands.

    Args:
        picture: with the telemetry.
        log: the log.
        proposed_ns: when the last proposal was made.
        time_ns: the time in question.
    """
    if log.is_as_ground:
        return  # it has them from what it believes
    heard, since_ns = picture.telemetry, 0
    if heard is not None:
        since_ns = heard.time_ns
        listed = dict.fromkeys(heard.goals, ROVER_GOAL)
        for record in _newest(log, listed, _sign_set, since_ns).values():
            picture.apply(LogEntry.of(record))
    _play(picture, log, _PROPOSAL, min(since_ns, proposed_ns), time_ns)


def _sign_set(record: Record) -> Tokens | None:
    goal = ROVER_GOAL.decode(record.payload)
    return goal.tokens if goal.change is GoalChange.SET else None


def _know_outages(picture: Picture, log: Scene, time_ns: int) -> None:
    wanted = dict.fromkeys(Direction, LINK_OUTAGE)
    for record in _newest(log, wanted, _direction_of, time_ns).values():
        picture.apply(LogEntry.of(record))


def _direction_of(record: Record) -> Direction:
    return LINK_OUTAGE.decode(record.payload).direction


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
