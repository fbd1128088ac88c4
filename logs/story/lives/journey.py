"""The way of messages over the link, as lines of a story: every frame, its waits and its end."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from farside.frames import Carried
from farside.logs.events import time_text
from farside.logs.file.reading import LogFile
from farside.logs.spacetime import Word, words
from farside.logs.story.sentences import frame_text, seconds
from farside.node import Direction, Role

Key = tuple[str, int | None]
"""A message: its kind, as it is tagged on the link, and its number."""


class Line(NamedTuple):
    """A line of a story.

    Attributes:
        t_ns: when it was so.
        side: where.
        text: what happened.
        is_sending: whether it tells that a frame leaves, or is lost at once, which comes after all
            else of its time.
    """

    t_ns: int
    side: Role
    text: str
    is_sending: bool = False


SENDER = {Direction.UP: Role.GROUND, Direction.DOWN: Role.ROVER}
"""Who sends in a direction."""


def journeys(log: LogFile, names: Mapping[Key, str], start_ns: int, end_ns: int) -> Iterator[Line]:
    """The lines of all frames sent in a time that carry one of these messages, or part of one.

    Args:
        log: the log.
        names: the messages, each with what it is called.
        start_ns: when the first of the frames can have been sent.
        end_ns: when the last can have been.

    Raises:
        LogError: if the log is damaged.
    """
    arrived: set[_Part] = set()
    rows: dict[_Part, _Row] = {}
    for word in words(log, start_ns, end_ns):
        carried = word.carries
        if carried is None or (carried.kind, carried.number) not in names:
            continue
        part = carried.kind, carried.number, carried.part
        name = names[carried.kind, carried.number]
        why = word.lost
        if part in arrived:
            why = "though it had arrived"
        elif word.lost is None and word.arrives_ns is not None:
            arrived.add(part)
        row = rows.get(part)
        if row is not None and row.why != why:
            yield from rows.pop(part).lines()
            row = None
        if row is not None:
            row.count, row.last = row.count + 1, word
        elif why is not None:
            rows[part] = _Row(name, why, word, word)
        else:
            yield from word_lines(word, name)
    for row in rows.values():
        yield from row.lines()


_WORTH_TELLING_NS = 5_000_000  # what would be told as 0.00 s is not

_Part = tuple[str, int | None, int]


@dataclass
class _Row:
    """Attempts at the same part of a message that all came to nothing in the same way."""

    name: str
    why: str
    first: Word
    last: Word
    count: int = 1

    def lines(self) -> Iterator[Line]:
        """The first and the last of them, and how many there were."""
        if self.first.lost == self.why:
            yield from word_lines(self.first, self.name)
            self.count -= 1
        sender = SENDER[self.last.direction]
        if self.count == 1:
            needless = self.last.lost != self.why
            yield from word_lines(self.last, self.name, is_needless=needless)
        elif self.count > 1:
            how = f"each time {self.why}" if self.first.lost == self.why else self.why
            until = frame_text(self.last.direction, self.last.frame)
            text = f"{self.name} is sent {self.count} times more, up to {until}, {how}"
            yield Line(self.last.sent_ns, sender, text, is_sending=True)


def word_lines(word: Word, name: str, *, is_needless: bool = False) -> Iterator[Line]:
    """The lines of one frame: that it leaves, and that it arrives or is lost.

    Args:
        word: the frame.
        name: what it carries.
        is_needless: whether that had arrived before.
    """
    sender = SENDER[word.direction]
    receiver = SENDER[word.direction.opposite]
    frame = frame_text(word.direction, word.frame)
    if word.arrives_ns is None or word.fate is not None or word.direction is Direction.UP:
        text = f"{name} leaves in {frame}{_again(word.carries)}{_transmitter(word)}"
        if word.hops and word.hops[0].to is not None:
            text += f" for node {word.hops[0].to}"
        yield Line(word.sent_ns, sender, text, is_sending=True)
    yield from _hops(word, frame)
    if word.lost is not None:
        lost_ns, where = word.sent_ns, Role.LINK
        if word.fate is not None:
            lost_ns = word.fate.sent_end_ns
        if word.hops and word.hops[-1].dropped_ns is not None:
            lost_ns = word.hops[-1].dropped_ns
        if word.arrives_ns is not None:
            lost_ns, where = word.arrives_ns, receiver
        at_once = lost_ns == word.sent_ns
        yield Line(lost_ns, where, f"{frame} is {word.lost}", is_sending=at_once)
    elif word.arrives_ns is not None:
        yield Line(word.arrives_ns, receiver, _arrives(word, frame, is_needless=is_needless))


def _hops(word: Word, frame: str) -> Iterator[Line]:
    """What became of it at the nodes on its way; that it was dropped is told as its end."""
    for before, hop in pairwise(word.hops):
        light = seconds(hop.received_ns - (before.sent_end_ns or hop.received_ns))
        text = f"{frame} is at node {hop.node} after {light} of light time"
        if hop.sent_ns is not None and hop.sent_end_ns is not None:
            waits = []
            if hop.sent_ns - hop.received_ns >= _WORTH_TELLING_NS:
                waits.append(f"{seconds(hop.sent_ns - hop.received_ns)} in its store")
            waits.append(f"{seconds(hop.sent_end_ns - hop.sent_ns)} to send")
            text += f", and leaves for node {hop.to} ({', '.join(waits)})"
        yield Line(hop.received_ns, Role.LINK, text)


def _again(carried: Carried | None) -> str:
    if carried is None:
        return ""
    text = f", part {carried.part} of {carried.parts}" if carried.parts > 1 else ""
    if carried.attempt > 1:
        text += f", sent for the {ordinal(carried.attempt)} time as its arrival was not reported"
    return text


def _transmitter(word: Word) -> str:
    """How long the transmitter took, where the channel says so and the frame has left."""
    fate = word.fate
    if fate is None or fate.sent_end_ns == fate.queued_ns:
        return ""
    waits = []
    if fate.sent_ns - fate.queued_ns >= _WORTH_TELLING_NS:
        waits.append(f"{seconds(fate.sent_ns - fate.queued_ns)} in the transmit queue")
    waits.append(f"{seconds(fate.sent_end_ns - fate.sent_ns)} to send")
    return f" ({', '.join(waits)})"


def _arrives(word: Word, frame: str, *, is_needless: bool) -> str:
    fate = word.fate
    if fate is None or word.arrives_ns is None:
        text = f"{frame} arrives"
    else:
        left_ns = word.hops[-1].sent_end_ns if word.hops else None
        light_ns = word.arrives_ns - (fate.sent_end_ns if left_ns is None else left_ns)
        text = f"{frame} arrives after {seconds(light_ns)} of light time"
        if len(word.hops) > 1:
            text += f" from node {word.hops[-1].node}"
    if word.fate is not None and word.fate.flipped_bits:
        text += f", with {word.fate.flipped_bits} bit errors"
    return f"{text}, with what had arrived before" if is_needless else text


def ordinal(number: int) -> str:
    """`2nd`, `3rd`, `11th`."""
    ending = "th" if number % 100 in {11, 12, 13} else {1: "st", 2: "nd", 3: "rd"}.get(number % 10)
    return f"{number}{ending or 'th'}"


def later(t_ns: int, since_ns: int) -> str:
    """`1.32 s later`, to follow a time; nothing where it is no later."""
    return f", {seconds(t_ns - since_ns)} later" if t_ns > since_ns else ""


def kept_back(lines: Iterable[Line], side: Role, t_ns: int) -> str:
    """What to say of a message used at `t_ns`, if its frames had arrived long before; or nothing.

    Args:
        lines: of its frames only.
        side: of the receiver.
        t_ns: when it was used.
    """
    came_ns = max((one.t_ns for one in lines if one.side is side), default=t_ns)
    if t_ns - came_ns < _TICKS_NS:
        return ""
    return f", {seconds(t_ns - came_ns)} after it arrived: it is delivered after those before it"


_TICKS_NS = 300_000_000  # more than a tick of any mission that ships


def learned_text(what: str, so_ns: int, learned_ns: int) -> str:
    """What the ground learns, when that was so, and how long the word took."""
    return f"the ground learns {what} at {time_text(so_ns)}{later(learned_ns, so_ns)}"
