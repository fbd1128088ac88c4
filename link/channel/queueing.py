"""What comes before the way: the queue of one direction, and its transmitter."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from farside.link.channel.chance import CALM, Draw, Luck
from farside.link.profile.config import DropPolicy, OneWay
from farside.link.profile.pace import Pace, Unlimited, pace_of
from farside.node import NEVER_NS, NS_PER_S, Frame, to_ns
from farside.topics import Fate


class Passage(msgspec.Struct, gc=False):
    """A frame between hand-over and its last bit leaving.

    Attributes:
        frame: the frame.
        jitter_ns, luck: what chance has in store for it.
        priority, size_byte: the frame's, and its payload's.
        latest_ns: when it must start to be sent at the latest.
        start_ns, end_ns: first and last bit leaving; the hand-over while it waits.
    """

    frame: Frame
    jitter_ns: int
    luck: Luck
    priority: int
    size_byte: int
    latest_ns: int
    start_ns: int
    end_ns: int


class Queue:
    """Frames that wait: a line for each priority, in order of hand-over.

    The transmitter, which has to be quick, puts and takes by itself.

    Attributes:
        lines: the lines by priority; one that was needed once stays.
        ordered: the same lines, highest priority first.
        frames, bytes: how much waits.
    """

    def __init__(self) -> None:
        self.lines: dict[int, deque[Passage]] = {}
        self.ordered: list[deque[Passage]] = []
        self.frames = 0
        self.bytes = 0

    def line(self, priority: int) -> deque[Passage]:
        """The line of a priority."""
        if priority not in self.lines:
            self.lines[priority] = deque()
            self.ordered = [self.lines[each] for each in sorted(self.lines, reverse=True)]
        return self.lines[priority]

    def put(self, passage: Passage) -> None:
        """Let a frame wait; the newest of all."""
        self.line(passage.priority).append(passage)
        self.frames += 1
        self.bytes += passage.size_byte

    def drop(self, policy: DropPolicy) -> Passage:
        """The frame that has to go."""
        waiting = [line for line in self.ordered if line]
        match policy:
            case DropPolicy.NEWEST:
                passage = max(waiting, key=lambda line: _age(line[-1])).pop()
            case DropPolicy.OLDEST:
                passage = min(waiting, key=lambda line: _age(line[0])).popleft()
            case DropPolicy.LOWEST:
                passage = waiting[-1].pop()
        self.frames -= 1
        self.bytes -= passage.size_byte
        return passage


def _age(passage: Passage) -> tuple[int, int]:
    return passage.frame.time_ns, passage.frame.sequence


class Dropped(NamedTuple):
    """A frame that never left: why, and when that was clear."""

    passage: Passage
    fate: Fate
    time_ns: int


class Transmitter:
    """Sends one frame after the other, and drops what the queue does not hold or time overtakes.

    Without a limit to its rate it sends each frame at once, and none ever waits.
    """

    def __init__(self, config: OneWay) -> None:
        self._config = config
        self._pace = pace_of(config)
        self._queue = Queue()
        self._sending: Passage | None = None
        # Since when it sends at this pace, and how much was then still to be done.
        self._work = 0, 0
        self._free_ns = 0
        self._sent: list[Passage] = []
        self._dropped: list[Dropped] = []

    def take(self) -> tuple[list[Passage], list[Dropped]]:
        """What has left since the last call, in order, and what never will."""
        taken = self._sent, self._dropped
        self._sent, self._dropped = [], []
        return taken

    @property
    def next_ns(self) -> int | None:
        """When the next last bit leaves at the earliest; `None` if nothing waits or is sent.

        Holds as long as nothing else is handed over or changed.
        """
        if self._sending is not None:
            return self._free_ns
        if self._pace is not None and self._queue.frames:
            return self._pace.opens_ns(self._free_ns)
        return None

    def run(self, until_ns: int, frames: Sequence[Frame], draw: Draw) -> None:
        """Take the frames handed over up to `until_ns`, in order, and send what can be by then."""
        passages = self._passages(frames, draw)
        if self._pace is None:
            self._sent += passages
            return
        begun = self._serve(self._pace, until_ns, passages)
        for passage in passages[begun:]:
            self._queue.put(passage)
            self._fit(passage)

    def change(self, now_ns: int, config: OneWay) -> None:
        """From `now_ns` on, go by `config`; so does the rest of the frame that is being sent."""
        before, self._config = self._config, config
        if _rate_of(config) == _rate_of(before):
            return
        if self._pace is not None:
            left = self._pace.left(*self._work, now_ns) if self._sending else 0
            self._work = now_ns, left
        self._pace = pace_of(config)
        if self._pace is None:
            self._flush(now_ns)
        elif self._sending:
            self._free_ns = self._pace.end_ns(*self._work)
        else:
            self._free_ns = max(self._free_ns, now_ns)

    def _passages(self, frames: Sequence[Frame], draw: Draw) -> list[Passage]:
        lucks = [CALM] * len(frames)
        for place, luck in draw.lucks.items():
            lucks[place] = luck
        priorities = [frame.priority for frame in frames]
        sizes_byte = [len(frame.payload) for frame in frames]
        times_ns = [frame.time_ns for frame in frames]
        lifetime_s = self._config.lifetime_s
        usual_ns = NEVER_NS if lifetime_s is None else to_ns(lifetime_s)
        latest_ns = [
            frame.time_ns + (usual_ns if frame.lifetime_ns is None else frame.lifetime_ns)
            for frame in frames
        ]
        waits = priorities, sizes_byte, latest_ns, times_ns, times_ns
        return list(map(Passage, frames, draw.jitters_ns, lucks, *waits))

    def _serve(  # noqa: C901, PLR0912, PLR0915 - a call in this loop takes as long as the rest of it
        self, pace: Pace, until_ns: int, passages: Sequence[Passage]
    ) -> int:
        """Send what can be; gives back how many of `passages` were in the queue by then."""
        queue, config, lines = self._queue, self._config, self._queue.lines
        most_byte, most_frame = config.queue_byte, config.queue_frame or NEVER_NS
        overhead_byte, work_of_byte = config.overhead_byte, 8 * NS_PER_S
        constant, takes_ns = pace.constant_bit_s, dict[int, int]()
        leaves = self._sent.append
        sending, free_ns = self._sending, self._free_ns
        waiting, waiting_byte = queue.frames, queue.bytes
        place, count = 0, len(passages)
        next_ns = passages[0].start_ns if passages else NEVER_NS
        while free_ns < until_ns:
            if sending is not None:
                sending.end_ns = free_ns
                leaves(sending)
                sending = None
            if not waiting:
                if place == count:
                    break
                free_ns = max(free_ns, next_ns)
            opens_ns = free_ns if constant else pace.opens_ns(free_ns)
            if opens_ns >= until_ns:
                break
            free_ns = opens_ns
            # All that is handed over by then is there to choose from.
            while next_ns <= opens_ns:
                passage = passages[place]
                place += 1
                next_ns = passages[place].start_ns if place < count else NEVER_NS
                priority = passage.priority
                (lines[priority] if priority in lines else queue.line(priority)).append(passage)
                waiting += 1
                waiting_byte += passage.size_byte
                if waiting_byte > most_byte or waiting > most_frame:
                    queue.frames, queue.bytes = waiting, waiting_byte
                    self._fit(passage)
                    waiting, waiting_byte = queue.frames, queue.bytes
            for line in queue.ordered:
                if line:
                    break
            else:
                continue
            passage = line.popleft()
            size_byte = passage.size_byte
            waiting -= 1
            waiting_byte -= size_byte
            if opens_ns > passage.latest_ns:
                self._dropped.append(Dropped(passage, Fate.EXPIRED, opens_ns))
            else:
                sending = passage
                sending.start_ns = opens_ns
                if size_byte in takes_ns:
                    free_ns = opens_ns + takes_ns[size_byte]
                    continue
                work = (size_byte + overhead_byte) * work_of_byte
                free_ns = pace.end_ns(opens_ns, work)
                if constant:
                    takes_ns[size_byte] = free_ns - opens_ns
        if sending is not None and sending is not self._sending:
            self._work = sending.start_ns, (sending.size_byte + overhead_byte) * work_of_byte
        queue.frames, queue.bytes = waiting, waiting_byte
        self._sending, self._free_ns = sending, free_ns
        return place

    def _fit(self, newest: Passage) -> None:
        """Drop what the queue does not hold, now that `newest` is in it."""
        config, queue = self._config, self._queue
        now_ns = newest.start_ns
        # What would not fit into an empty queue drives nothing out.
        policy = config.drop if newest.size_byte <= config.queue_byte else DropPolicy.NEWEST
        while queue.bytes > config.queue_byte or queue.frames > (config.queue_frame or NEVER_NS):
            self._dropped.append(Dropped(queue.drop(policy), Fate.QUEUE_FULL, now_ns))

    def _flush(self, now_ns: int) -> None:
        """Send at once what is being sent, and all that waits."""
        self._free_ns = now_ns
        self._serve(Unlimited(), now_ns + 1, ())


def _rate_of(config: OneWay) -> object:
    return config.rate_bit_s, config.rate_table, config.rate_trace
