"""Transmit queue and transmitter of one direction."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from farside.frames import Fate, OutageReason
from farside.link.channel.chance import UNIMPAIRED, Draw, Impairment
from farside.link.channel.slots import Slotted
from farside.link.profile.config import DropPolicy, OneWay
from farside.link.profile.rate import Rate, Unlimited, transmit_rate
from farside.node import NEVER_NS, NS_PER_S, Frame, to_ns


class Transmission(msgspec.Struct, gc=False):
    """A frame from hand-over until its last bit leaves.

    Attributes:
        frame: the frame.
        jitter_ns, impairment: what it has drawn.
        priority, size_byte: the frame's priority, and the size of its payload.
        latest_ns: when its first bit must leave at the latest.
        start_ns, end_ns: when its first and last bit leave; the hand-over while it waits.
        arrives_ns: when it arrives, of a frame that goes by way of other nodes.
    """

    frame: Frame
    jitter_ns: int
    impairment: Impairment
    priority: int
    size_byte: int
    latest_ns: int
    start_ns: int
    end_ns: int
    arrives_ns: int = 0


def transmissions(frames: Sequence[Frame], draw: Draw, config: OneWay) -> list[Transmission]:
    """Frames as they are handed over, with what they have drawn."""
    impairments = [UNIMPAIRED] * len(frames)
    for index, impairment in draw.impairments.items():
        impairments[index] = impairment
    priorities = [frame.priority for frame in frames]
    sizes_byte = [len(frame.payload) for frame in frames]
    times_ns = [frame.time_ns for frame in frames]
    lifetime_s = config.lifetime_s
    default_ns = NEVER_NS if lifetime_s is None else to_ns(lifetime_s)
    latest_ns = [
        frame.time_ns + (default_ns if frame.lifetime_ns is None else frame.lifetime_ns)
        for frame in frames
    ]
    waiting = priorities, sizes_byte, latest_ns, times_ns, times_ns
    return list(map(Transmission, frames, draw.jitters_ns, impairments, *waiting))


class TransmitQueue:
    """Frames that wait: one FIFO per priority, in order of hand-over.

    For speed, the transmitter puts into the FIFOs and takes from them by itself.

    Attributes:
        fifos: the FIFOs by priority; one that was needed once stays.
        ordered: the same FIFOs, highest priority first.
        frames, bytes: how much waits.
    """

    def __init__(self) -> None:
        self.fifos: dict[int, deque[Transmission]] = {}
        self.ordered: list[deque[Transmission]] = []
        self.frames = 0
        self.bytes = 0

    def fifo(self, priority: int) -> deque[Transmission]:
        """The FIFO of a priority."""
        if priority not in self.fifos:
            self.fifos[priority] = deque()
            self.ordered = [self.fifos[each] for each in sorted(self.fifos, reverse=True)]
        return self.fifos[priority]

    def put(self, transmission: Transmission) -> None:
        """Enqueue a frame that is newer than all others."""
        self.fifo(transmission.priority).append(transmission)
        self.frames += 1
        self.bytes += transmission.size_byte

    def drop(self, policy: DropPolicy) -> Transmission:
        """Remove and give back the frame that `policy` drops."""
        waiting = [fifo for fifo in self.ordered if fifo]
        match policy:
            case DropPolicy.NEWEST:
                dropped = max(waiting, key=lambda fifo: _age(fifo[-1])).pop()
            case DropPolicy.OLDEST:
                dropped = min(waiting, key=lambda fifo: _age(fifo[0])).popleft()
            case DropPolicy.LOWEST:
                dropped = waiting[-1].pop()
        self.frames -= 1
        self.bytes -= dropped.size_byte
        return dropped


def _age(transmission: Transmission) -> tuple[int, int]:
    return transmission.frame.time_ns, transmission.frame.sequence


class Dropped(NamedTuple):
    """A frame that was never sent, or dropped on its way: why, and when that was decided.

    Attributes:
        outage: the reason of the outage that it was lost to.
    """

    transmission: Transmission
    fate: Fate
    time_ns: int
    outage: OutageReason | None = None


class Transmitter:
    """Sends one frame at a time; drops those that do not fit into the queue or have expired.

    Without a rate limit and slots it sends each frame at once, and none ever waits. A frame that is
    larger than the queue needs no room in it if none waits and none is being sent when it is handed
    over.

    Args:
        config: the direction.
        rng: draws the waits for slots.
    """

    def __init__(self, config: OneWay, rng: Generator) -> None:
        self._config = config
        self._rng = rng
        self._rate = self._rate_of(config)
        self._queue = TransmitQueue()
        self._sending: Transmission | None = None
        # Since when it sends at this rate, and how much work was then left of the frame.
        self._work = 0, 0
        self._free_ns = 0
        # When the last bit left of the frame sent before.
        self._idle_ns = 0
        # A frame larger than the queue, handed over while there was no other.
        self._large: Transmission | None = None
        self._sent: list[Transmission] = []
        self._dropped: list[Dropped] = []

    def take(self) -> tuple[list[Transmission], list[Dropped]]:
        """The frames that have left since the last call, in order, and those dropped."""
        taken = self._sent, self._dropped
        self._sent, self._dropped = [], []
        return taken

    @property
    def began_ns(self) -> int | None:
        """When the frame that is being sent began to leave; `None` without one."""
        return None if self._sending is None else self._sending.start_ns

    @property
    def next_ns(self) -> int | None:
        """When the last bit of a frame leaves next, at the earliest; `None` if the queue is idle.

        Holds until something is handed over or changed.
        """
        if self._sending is not None:
            return self._free_ns
        if self._rate is not None and self._queue.frames:
            return self._rate.opens_ns(self._free_ns)
        return None

    def run(self, until_ns: int, frames: Sequence[Frame], draw: Draw) -> None:
        """Take the frames handed over before `until_ns`, in order, and send what leaves by then."""
        handed_over = transmissions(frames, draw, self._config)
        if self._rate is None:
            self._sent += handed_over
            return
        enqueued = self._serve(self._rate, until_ns, handed_over)
        for transmission in handed_over[enqueued:]:
            self._queue.put(transmission)
            is_idle = self._sending is None and self._idle_ns <= transmission.start_ns
            self._drop_excess(transmission, is_idle=is_idle)

    def change(self, now_ns: int, config: OneWay) -> None:
        """Use `config` from `now_ns` on, also for the rest of the frame that is being sent."""
        before, self._config = self._config, config
        if _rate_settings(config) == _rate_settings(before):
            return
        if self._rate is not None:
            left = self._rate.remaining(*self._work, now_ns) if self._sending else 0
            self._work = now_ns, left
        self._rate = self._rate_of(config)
        if self._rate is None:
            self._flush(now_ns)
        elif self._sending:
            self._free_ns = self._rate.end_ns(*self._work)
        else:
            self._free_ns = max(self._free_ns, now_ns)

    def _rate_of(self, config: OneWay) -> Rate | None:
        rate = transmit_rate(config)
        if config.slots is None:
            return rate
        return Slotted(rate or Unlimited(), config.slots, self._rng)

    def _serve(  # noqa: C901, PLR0912, PLR0915 - a call in this loop would double its time
        self, rate: Rate, until_ns: int, handed_over: Sequence[Transmission]
    ) -> int:
        """Send what starts before `until_ns`; returns how many of `handed_over` were enqueued."""
        queue, config, fifos = self._queue, self._config, self._queue.fifos
        max_bytes, max_frames = config.queue_byte, config.queue_frame or NEVER_NS
        overhead_byte, work_per_byte = config.overhead_byte, 8 * NS_PER_S
        constant, sending_ns = rate.constant_bit_s, dict[int, int]()
        leaves = self._sent.append
        sending, free_ns, idle_ns = self._sending, self._free_ns, self._idle_ns
        waiting, waiting_byte = queue.frames, queue.bytes
        enqueued, count = 0, len(handed_over)
        next_ns = handed_over[0].start_ns if handed_over else NEVER_NS
        while free_ns < until_ns:
            if sending is not None:
                sending.end_ns = idle_ns = free_ns
                leaves(sending)
                sending = None
            if not waiting:
                if enqueued == count:
                    break
                free_ns = max(free_ns, next_ns)
            opens_ns = free_ns if constant else rate.opens_ns(free_ns)
            if opens_ns >= until_ns:
                break
            free_ns = opens_ns
            # Whatever has been handed over by then competes for the transmitter.
            while next_ns <= opens_ns:
                newest = handed_over[enqueued]
                enqueued += 1
                next_ns = handed_over[enqueued].start_ns if enqueued < count else NEVER_NS
                priority = newest.priority
                (fifos[priority] if priority in fifos else queue.fifo(priority)).append(newest)
                waiting += 1
                waiting_byte += newest.size_byte
                if waiting_byte > max_bytes or waiting > max_frames:
                    queue.frames, queue.bytes = waiting, waiting_byte
                    self._drop_excess(newest, is_idle=idle_ns <= newest.start_ns)
                    waiting, waiting_byte = queue.frames, queue.bytes
            for fifo in queue.ordered:
                if fifo:
                    break
            else:
                continue
            chosen = fifo.popleft()
            size_byte = chosen.size_byte
            waiting -= 1
            waiting_byte -= size_byte
            if opens_ns > chosen.latest_ns:
                self._dropped.append(Dropped(chosen, Fate.EXPIRED, opens_ns))
            else:
                sending = chosen
                sending.start_ns = opens_ns
                if size_byte in sending_ns:
                    free_ns = opens_ns + sending_ns[size_byte]
                    continue
                work = (size_byte + overhead_byte) * work_per_byte
                free_ns = rate.end_ns(opens_ns, work)
                if constant:
                    sending_ns[size_byte] = free_ns - opens_ns
        if sending is not None and sending is not self._sending:
            self._work = sending.start_ns, (sending.size_byte + overhead_byte) * work_per_byte
        queue.frames, queue.bytes = waiting, waiting_byte
        self._sending, self._free_ns, self._idle_ns = sending, free_ns, idle_ns
        return enqueued

    def _drop_excess(self, newest: Transmission, *, is_idle: bool) -> None:
        """Drop what does not fit into the queue now that `newest` is in it.

        Args:
            newest: what has just been handed over.
            is_idle: whether no frame was being sent then.
        """
        config, queue = self._config, self._queue
        now_ns, policy = newest.start_ns, config.drop
        if newest.size_byte > config.queue_byte:
            if is_idle and queue.frames == 1:
                self._large = newest
            # A frame that would not fit even into an empty queue displaces no other.
            policy = DropPolicy.NEWEST
        most_frames = config.queue_frame or NEVER_NS
        while queue.frames > most_frames or queue.bytes - self._large_byte > config.queue_byte:
            self._dropped.append(Dropped(queue.drop(policy), Fate.QUEUE_FULL, now_ns))

    @property
    def _large_byte(self) -> int:
        """How much of what waits needs no room in the queue."""
        if self._large is None:
            return 0
        fifo = self._queue.fifo(self._large.priority)
        # It was alone when it came, so for as long as it waits it is the first of its priority.
        return self._large.size_byte if fifo and fifo[0] is self._large else 0

    def _flush(self, now_ns: int) -> None:
        """Complete the frame being sent and send all that wait, at once."""
        self._free_ns = now_ns
        self._serve(Unlimited(), now_ns + 1, ())


def _rate_settings(config: OneWay) -> object:
    return config.rate_bit_s, config.rate_table, config.rate_trace, config.slots
