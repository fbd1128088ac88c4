"""Every word between ground and rover, as columns for the space-time diagram."""

from typing import Any, NamedTuple

from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Side, View, Words
from farside.logs.report.thinning import Rows, ms, steps
from farside.logs.spacetime import HeardAndSent, UnderWay, Word
from farside.node import Direction, Topic

_MOST = 3000
"""Of one kind in one direction, that arrived or that were lost."""

KINDS = {
    "command": "command",
    "event": "event",
    "proposal": "proposal",
    "shown": "proposal shown",
    "model": "update of the model",
    "telemetry": "telemetry",
    "stored": "stored telemetry",
    "heartbeat": "heartbeat",
    "report": "report of what arrived",
    "other": "other, or a part of a message",
}
"""The kinds of words, those first that are drawn last."""

_ALIKE = {"telemetry", "stored", "heartbeat", "report", "other"}
_NUMBERS = {kind: number for number, kind in enumerate(KINDS)}
_DOWN = 100


class _Sent(NamedTuple):
    """A word; `t` in milliseconds, `flight` in microseconds."""

    t: int
    frame: int
    kind: str
    direction: Direction
    flight: int | None
    lost: str
    again: bool
    text: str


class _Flights:
    """How long a word takes that did not arrive, or is not known to: as long as the one before."""

    def __init__(self) -> None:
        self._last: dict[Direction, int] = {}

    def of(self, sent: _Sent) -> int:
        if sent.flight is not None and not sent.lost:
            self._last[sent.direction] = sent.flight
            return sent.flight
        return self.last(sent.direction)

    def last(self, direction: Direction) -> int:
        return self._last.get(direction, self._last.get(direction.opposite, 0))


class Traffic:
    """The words: of what was so, or those that the ground sent and heard."""

    topics: tuple[Topic[Any], ...]

    def __init__(self, side: Side) -> None:
        self._taking = HeardAndSent() if side.is_ground else UnderWay()
        self.topics = self._taking.topics
        self._groups: dict[tuple[Direction, str, bool], Rows[_Sent]] = {}

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        for word in self._taking.take(entry.log_time_ns, entry.message):
            self._add(word)

    def _add(self, word: Word) -> None:
        carries = word.carries
        kind = carries.kind if carries is not None else word.what
        if word.stored and kind == "telemetry":
            kind = "stored"
        if kind not in KINDS:
            kind = "other"
        key = word.direction, kind, word.lost is not None
        if (rows := self._groups.get(key)) is None:
            rows = self._groups[key] = Rows(_MOST)
        if not rows.skip():
            rows.add(_sent(word, kind))

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        for word in self._taking.rest():
            self._add(word)
        kept = (sent for rows in self._groups.values() for sent in rows.rows)
        view.words = _columns(sorted(kept, key=_order))
        for (direction, kind, lost), rows in sorted(self._groups.items()):
            if rows.every > 1:
                what = f"{KINDS[kind]}{', lost' if lost else ''}"
                view.notes.append(f"Words, {direction}, {what}: 1 of {rows.every} is drawn")


def _order(sent: _Sent) -> tuple[int, Direction, int]:
    return sent.t, sent.direction, sent.frame


def _sent(word: Word, kind: str) -> _Sent:
    flight = None if word.arrives_ns is None else (word.arrives_ns - word.sent_ns) // 1000
    again = word.carries is not None and word.carries.attempt > 1
    text = "" if kind in _ALIKE else word.what
    t, frame, direction, lost = ms(word.sent_ns), word.frame, word.direction, word.lost or ""
    return _Sent(t, frame, kind, direction, flight, lost, again, text)


def _columns(kept: list[_Sent]) -> Words:
    flights = _Flights()
    for sent in kept:  # so that the first ones, too, have one before them
        flights.of(sent)
        if flights.last(sent.direction):
            break
    losses = {"": 0}
    numbers = [_NUMBERS[sent.kind] for sent in kept]
    return Words(
        t=steps([sent.t for sent in kept]),
        flight=[flights.of(sent) for sent in kept],
        kind=[
            number + (_DOWN if sent.direction is Direction.DOWN else 0)
            for number, sent in zip(numbers, kept, strict=True)
        ],
        lost=[losses.setdefault(sent.lost, len(losses)) for sent in kept],
        again=[row for row, sent in enumerate(kept) if sent.again],
        unended=[row for row, sent in enumerate(kept) if sent.flight is None and not sent.lost],
        named=[sent.text for sent in kept if sent.kind not in _ALIKE],
        kinds=list(KINDS.values()),
        losses=list(losses),
    )
