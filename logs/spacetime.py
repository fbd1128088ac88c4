"""Every word between ground and rover: when it was sent, when it arrived, or what it was lost to.

That is what a space-time diagram draws, and what `farside story` tells of a frame. The two ends
say what was in a frame, the channel says what became of it; they are joined here as they are read,
and only what is under way is kept.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, cast

import msgspec

from farside.frames import Carried, Fate, FrameEvent, FrameFate, FrameHop, FrameStage
from farside.logs.events import OUTAGES, time_text
from farside.logs.file.reading import LogFile, decode
from farside.node import NEVER_NS, Direction
from farside.topics import GROUND_FRAME, LINK_FRAME, LINK_HOP, ROVER_FRAME

_TOPICS = (ROVER_FRAME, LINK_HOP, LINK_FRAME, GROUND_FRAME)
_SENDS = {ROVER_FRAME.name: Direction.DOWN, GROUND_FRAME.name: Direction.UP}

_NAMES = {
    "command": "command {}",
    "proposal": "proposal {}",
    "event": "event {}",
    "shown": "word that proposal {} was shown",
    "model": "update {} of the model",
}

_LOST = {
    Fate.LOST: "lost on the way",
    Fate.QUEUE_FULL: "dropped, since the transmit queue was full",
    Fate.EXPIRED: "dropped, since it waited too long in the transmit queue",
    Fate.BIT_ERROR: "lost to bit errors",
    Fate.STORE_FULL: "dropped at a node on its way, since the store was full",
    Fate.NO_ROUTE: "dropped, since no contact leads to the other end any more",
}


class Word(NamedTuple):
    """One frame on its way between ground and rover.

    Attributes:
        direction: which way.
        what: what it carries, in words, such as `command 12` or `event 5, sent 2 ×`.
        sent_ns: when the sender handed it to the channel. Of a frame from the rover, as the ground
            knew it: its arrival less the delay of the last telemetry.
        arrives_ns: when its last bit arrived; `None` if it did not, or not within the log, or if
            the ground cannot know.
        lost: what it was lost to, or why it was refused, in words; `None` if it was used, or is on
            its way at the end of the log, or if the ground cannot know.
        frame: its sequence number in its direction.
        priority: as the sender set it; 0 where the log does not say.
        carries: the message, or part of one, that it carries; `None` of a report, and where the
            log does not say.
        stored: whether it is of the stored stream.
        fate: what the channel says of it; `None` where it says nothing.
        hops: what became of it at each node, on a way by other nodes.
    """

    direction: Direction
    what: str
    sent_ns: int
    arrives_ns: int | None
    lost: str | None
    frame: int
    priority: int
    carries: Carried | None = None
    stored: bool = False
    fate: FrameFate | None = None
    hops: tuple[FrameHop, ...] = ()


def words(log: LogFile, start_ns: int = 0, end_ns: int = NEVER_NS) -> Iterator[Word]:
    """The words sent from `start_ns` to `end_ns`, each as soon as the log tells what became of it.

    So they come roughly in the order of their ends, and those still under way at the end of the log
    last. A duplicate that the channel made is no word of its own. Of a log as the ground had it:
    what the ground sent, and what it heard.

    Raises:
        LogError: if the log is damaged.
    """
    taking = HeardAndSent(end_ns) if log.is_as_ground else UnderWay(start_ns, end_ns)
    for record in log.records(taking.topics, start_ns=start_ns):
        if record.log_time_ns > end_ns and taking.is_done:
            return
        yield from taking.take(record.log_time_ns, decode(record))
    yield from taking.rest()


class UnderWay:
    """The words whose end is not known yet: for who reads other topics in the same pass.

    Args:
        start_ns, end_ns: see `words`.

    Attributes:
        topics: the topics to take from.
        words: those, by direction and sequence number.
    """

    topics = _TOPICS

    def __init__(self, start_ns: int = 0, end_ns: int = NEVER_NS) -> None:
        self.words: dict[tuple[Direction, int], Word] = {}
        self._start_ns, self._end_ns = start_ns, end_ns
        # Used by the receiver at this time, but the channel has not said when they arrived: at the
        # same log time the rover's records come first.
        self._used: dict[tuple[Direction, int], tuple[int, Word]] = {}

    @property
    def is_done(self) -> bool:
        """Whether no word is under way."""
        return not (self.words or self._used)

    def take(self, now_ns: int, message: msgspec.Struct) -> Sequence[Word]:
        """Take the next message of `topics`; gives the words whose end it tells."""
        settled = self.settle_used(now_ns) if self._used else []
        ended = None
        if isinstance(message, FrameHop):
            self.hop(message)
        elif isinstance(message, FrameFate):
            if message.queued_ns <= self._end_ns:
                ended = self.fate(message)
        elif isinstance(message, FrameEvent) and not (
            now_ns > self._end_ns and message.stage is FrameStage.MADE
        ):
            ended = self.event(now_ns, message)
        if ended is None:
            return settled
        return [*settled, ended] if settled else (ended,)

    def event(self, now_ns: int, event: FrameEvent) -> Word | None:
        """An end made a frame, lost it to terrain shadow, refused it or used it."""
        key = event.direction, event.sequence
        if event.stage is FrameStage.MADE:
            self.words[key] = _made(now_ns, event)
            return None
        word = self.words.pop(key, None)
        if word is None:
            return None  # sent before the start; or nothing that the other end made
        if event.stage is FrameStage.SHADOWED:
            return word._replace(lost="lost in terrain shadow")
        if event.stage is FrameStage.REFUSED:
            # A duplicate is refused after the frame itself was used, and so is gone from here.
            return word._replace(lost=f"refused by the receiver: {event.what}")
        if word.arrives_ns is None:
            self._used[key] = now_ns, word
            return None
        return word

    def hop(self, hop: FrameHop) -> None:
        """A node tells what became of a frame there."""
        key = hop.direction, hop.sequence
        if (word := self.words.get(key)) is not None:
            self.words[key] = word._replace(hops=(*word.hops, hop))

    def fate(self, fate: FrameFate) -> Word | None:
        """The channel tells what became of a frame."""
        if fate.copy or fate.queued_ns < self._start_ns:
            return None
        key = fate.direction, fate.sequence
        word = self.words.pop(key, None)
        if word is not None:
            lost = lost_to(fate)
            word = word._replace(
                arrives_ns=fate.arrival_ns, lost=lost, priority=fate.priority, fate=fate
            )
            if lost is not None:
                return word
            self.words[key] = word
            return None
        if key in self._used:
            _, used = self._used.pop(key)
            return used._replace(arrives_ns=fate.arrival_ns, priority=fate.priority, fate=fate)
        return Word(
            fate.direction,
            "a frame",
            fate.queued_ns,
            fate.arrival_ns,
            lost_to(fate),
            fate.sequence,
            fate.priority,
            fate=fate,
        )

    def settle_used(self, now_ns: int) -> list[Word]:
        """Those used before `now_ns` whose fate the log lacks, as if they arrived when used."""
        settled = []
        while self._used:
            key = next(iter(self._used))
            used_ns, word = self._used[key]
            if used_ns >= now_ns:
                break
            del self._used[key]
            settled.append(word._replace(arrives_ns=used_ns))
        return settled

    def rest(self) -> Iterator[Word]:
        """Those under way at the end, in the order of sending."""
        yield from self.settle_used(NEVER_NS)
        yield from self.words.values()


class HeardAndSent:
    """The words that the ground sent, and those that it heard.

    Attributes:
        topics: the topics to take from.
    """

    topics = (GROUND_FRAME,)
    is_done = False  # what it hears after a time may have been sent before

    def __init__(self, end_ns: int = NEVER_NS) -> None:
        self._end_ns, self._delay_ns = end_ns, 0

    def take(self, now_ns: int, message: msgspec.Struct) -> Sequence[Word]:
        """Take the next message of `topics`; gives the word that it tells of."""
        event = cast("FrameEvent", message)
        if event.direction is Direction.UP:
            is_sent = event.stage is FrameStage.MADE and now_ns <= self._end_ns
            return (_made(now_ns, event),) if is_sent else ()
        carries = event.carries[0] if event.carries else None
        if carries is not None and carries.kind == "telemetry" and not event.stored:
            self._delay_ns = now_ns - (now_ns if carries.time_ns is None else carries.time_ns)
        if now_ns - self._delay_ns > self._end_ns:
            return ()
        lost = None
        if event.stage is not FrameStage.USED:
            lost = f"refused by the receiver: {event.what}"
        return (_made(now_ns - self._delay_ns, event, arrives_ns=now_ns, lost=lost),)

    def rest(self) -> Iterator[Word]:
        """None: what was heard was heard."""
        return iter(())


def _made(
    sent_ns: int, event: FrameEvent, arrives_ns: int | None = None, lost: str | None = None
) -> Word:
    carries = event.carries[0] if event.carries else None
    what = cargo_text(event)
    sequence, stored = event.sequence, event.stored
    return Word(event.direction, what, sent_ns, arrives_ns, lost, sequence, 0, carries, stored)


def lost_to(fate: FrameFate) -> str | None:
    """What the channel lost a frame to, in words; `None` if it was delivered."""
    if fate.fate is Fate.OUTAGE:
        return "lost to an outage" if fate.outage is None else f"lost to the {OUTAGES[fate.outage]}"
    return _LOST.get(fate.fate)


def cargo_text(event: FrameEvent) -> str:
    """What a frame carries, in words: `command 12`, `telemetry`, `proposal 3, part 1 of 2`."""
    if not event.carries:
        return "part of a message" if event.what == "segment" else event.what
    return ", ".join(carried_text(one, stored=event.stored) for one in event.carries)


def carried_text(carried: Carried, *, stored: bool = False) -> str:
    """A message, or the part of one, in a frame; see `cargo_text`."""
    text, name = carried.kind, _NAMES.get(carried.kind)
    if name is not None and carried.number is not None:
        text = name.format(carried.number)
    if stored and carried.kind == "telemetry" and carried.time_ns is not None:
        text = f"stored telemetry of {time_text(carried.time_ns)}"
    if carried.parts > 1:
        text += f", part {carried.part} of {carried.parts}"
    if carried.attempt > 1:
        text += f", sent {carried.attempt} ×"
    return text
