"""The channel: what the link does to frames, decided from the frames and their times alone."""

import math
from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Mapping, Sequence
from itertools import accumulate, compress, groupby, repeat
from operator import add, attrgetter, itemgetter
from typing import NamedTuple

from numpy.random import Generator

from farside.link.channel.agenda import Agenda, Entry
from farside.link.channel.chance import CALM, Chance, Luck
from farside.link.channel.queueing import Passage, Transmitter
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.schedule import Delay, Outage, outages_of
from farside.node import NEVER_NS, Direction, Frame, Journal, Step, to_ns
from farside.topics import LINK_FRAME, LINK_OUTAGE, Fate, FrameFate, LinkOutage, OutageReason

_sequence = attrgetter("sequence")
_time = attrgetter("time_ns")
_kind = attrgetter("what.__class__")


class _Departures(NamedTuple):
    """Frames on their way that will arrive, and for each when its last bit left."""

    ends_ns: list[int]
    frames: list[Frame]


class Channel:
    """The link between the two endpoints, as a `Node` whose arrivals are the frames sent into it.

    In each direction a frame waits in the queue for the transmitter, which takes the highest
    priority first, is sent (rate, overhead), propagates, and is delayed by jitter on top. Nothing
    overtakes, except what is held back, comes twice, or was sent before the delay was changed.
    Chance decides its luck when it is handed over; see `farside.link.channel.chance`.

    A frame is lost to an outage if it is at the rover's end during one: an uplink frame when it
    would arrive, a downlink frame when any of it is sent. What already passed arrives.

    A frame is decided upon when its last bit leaves. Until then it has no fate, and what is
    changed about the link holds for it: the rate, the delay, outages.

    Args:
        config: the link, resolved. Its `changes` take place on their own.
        rngs: a generator for each direction, from which one for each purpose is spawned.
    """

    def __init__(self, config: LinkConfig, rngs: Mapping[Direction, Generator]) -> None:
        self._journal = Journal()
        self._now_ns = 0
        # In the order of records, and of frames, of the same time.
        self._ways = {
            direction: _Way(direction, config, rngs[direction])
            for direction in (Direction.DOWN, Direction.UP)
        }

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Take the frames sent up to `until_ns`; give back those that will arrive, at their time.

        They are in the order in which they were sent, which is not that of their arrival.

        Raises:
            ValueError: if a frame was sent before this window or after it.
        """
        # Two sorts by a number each are faster than one by both.
        frames = sorted(arrivals, key=_sequence)
        frames.sort(key=_time)
        self._expect_in_window(frames, until_ns)
        ends_ns: list[int] = []
        sent: list[Frame] = []
        entries: list[Entry] = []
        for direction, way in self._ways.items():
            own = [frame for frame in frames if frame.direction is direction]
            departures = way.advance(until_ns, own)
            ends_ns += departures.ends_ns
            sent += departures.frames
            entries += way.agenda.due(until_ns)
        entries.sort()
        self._note(entries)
        self._now_ns = until_ns
        places = sorted(range(len(sent)), key=ends_ns.__getitem__)
        return Step([sent[place] for place in places], self._journal.take())

    def _note(self, entries: Sequence[Entry]) -> None:
        """Record what came to be known, in runs of one topic: there are few outages."""
        for _, group in groupby(entries, _kind):
            run = list(group)
            times_ns = [entry.time_ns for entry in run]
            fates = [entry.what for entry in run if isinstance(entry.what, FrameFate)]
            if fates:
                self._journal.note_all(LINK_FRAME, fates, times_ns)
                continue
            outages = [entry.what for entry in run if isinstance(entry.what, LinkOutage)]
            self._journal.note_all(LINK_OUTAGE, outages, times_ns)

    def change(self, direction: Direction, one_way: OneWay) -> None:
        """From the present on, `direction` is as `one_way` says.

        Chance goes by it for the frames handed over from now on, all else for those not yet sent.
        """
        self._ways[direction].change(self._now_ns, one_way)

    def set_out(self, direction: Direction, out: bool) -> None:  # noqa: FBT001 - a state to be in
        """From the present on, `direction` is out, or as scheduled again.

        An uplink frame that was given back already arrives even so.
        """
        self._ways[direction].set_out(self._now_ns, out=out)

    @property
    def next_ns(self) -> int | None:
        """When a frame not given back yet can arrive at the earliest; `None` if there is none.

        For whoever advances on a wall clock: no later than this, nothing is late. It holds until
        something is sent or changed.
        """
        moments = [way.next_ns for way in self._ways.values()]
        return min((ns for ns in moments if ns is not None), default=None)

    def settings(self, direction: Direction) -> OneWay:
        """What `direction` is like at present."""
        return self._ways[direction].config

    def outage(self, direction: Direction) -> Outage | None:
        """The outage of `direction` at present; `None` if it is in service."""
        return self._ways[direction].outage(self._now_ns)

    def _expect_in_window(self, frames: Sequence[Frame], until_ns: int) -> None:
        for frame in (*frames[:1], *frames[-1:]):
            if not self._now_ns <= frame.time_ns < until_ns:
                raise ValueError(
                    f"expected {frame.direction} frame {frame.sequence} to be sent in the window "
                    f"[{self._now_ns}, {until_ns}) ns, found {frame.time_ns} ns"
                )


class _Ends(NamedTuple):
    """What became of some frames: a column for each of the last fields of `FrameFate`."""

    arrivals_ns: Sequence[int | None]
    fates: Sequence[Fate]
    flipped_bits: Sequence[int]
    outages: Sequence[OutageReason | None]

    @classmethod
    def never(cls, fates: Sequence[Fate]) -> "_Ends":
        """The ends of frames that never left."""
        none = [None] * len(fates)
        return cls(none, fates, [0] * len(fates), none)


class _Outages:
    """When one direction is out: as scheduled, and as told during the run."""

    def __init__(self, scheduled: Sequence[Outage]) -> None:
        self._begins_ns = [outage.begin_ns for outage in scheduled]
        self._ends_ns = [outage.end_ns for outage in scheduled]
        self._reasons = [outage.reason for outage in scheduled]
        self._told: list[tuple[int, float]] = []

    @property
    def told_out(self) -> bool:
        """Whether the direction is out because it was told so."""
        return bool(self._told) and self._told[-1][1] == math.inf

    def tell(self, now_ns: int) -> None:
        """Tell it to be out, or as scheduled again."""
        if self.told_out:
            self._told[-1] = self._told[-1][0], now_ns
        else:
            self._told.append((now_ns, math.inf))

    def reasons(
        self, starts_ns: Sequence[int], ends_ns: Sequence[int]
    ) -> Sequence[OutageReason | None] | None:
        """For each span, why the direction is out at any moment of it; `None` if it never is."""
        if self._reason(min(starts_ns), max(ends_ns)) is None:
            return None
        return list(map(self._reason, starts_ns, ends_ns))

    def at(self, now_ns: int) -> Outage | None:
        """The outage at `now_ns`; it ends never, as far as is known, if it was told."""
        if self.told_out:
            return Outage(self._told[-1][0], NEVER_NS, OutageReason.CONTROL)
        first = bisect_right(self._ends_ns, now_ns)
        if first < len(self._ends_ns) and self._begins_ns[first] <= now_ns:
            return Outage(self._begins_ns[first], self._ends_ns[first], self._reasons[first])
        return None

    def _reason(self, start_ns: int, end_ns: int) -> OutageReason | None:
        first = bisect_right(self._ends_ns, start_ns)
        if first < len(self._ends_ns) and self._begins_ns[first] <= end_ns:
            return self._reasons[first]
        if any(begin_ns <= end_ns and start_ns < stop_ns for begin_ns, stop_ns in self._told):
            return OutageReason.CONTROL
        return None


class _Way:
    """One direction: chance, a transmitter, a distance, and the outages at the rover's end.

    Attributes:
        agenda: the records to be made.
        config: what it is like at present.
    """

    def __init__(self, direction: Direction, link: LinkConfig, rng: Generator) -> None:
        self._direction = direction
        self._changes = deque(
            sorted(
                (
                    (to_ns(change.at_s), change)
                    for change in link.changes
                    if change.direction.includes(direction)
                ),
                key=itemgetter(0),
            )
        )
        self.config = link.way(direction)
        self._least_delay_ns = self.config.least_delay_ns
        self._chance = Chance(rng, self.config)
        self._transmitter = Transmitter(self.config)
        self._delay = Delay(self.config)
        self._latest_ns = 0
        self._delivered = _Departures([], [])
        self._outages = _Outages(scheduled := outages_of(link, direction))
        self._outages_noted = 0
        self.agenda = Agenda()
        for begin_ns, end_ns, reason in scheduled:
            self._note_outage(begin_ns, reason, down=True)
            self._note_outage(end_ns, reason, down=False)

    def advance(self, until_ns: int, frames: Sequence[Frame]) -> _Departures:
        """Take the frames handed over up to `until_ns`, and the changes on the way.

        Returns:
            the frames that will arrive.
        """
        begin = 0
        while self._changes and self._changes[0][0] < until_ns:
            at_ns, change = self._changes.popleft()
            end = bisect_left(frames, at_ns, lo=begin, key=_time)
            self._run(at_ns, frames[begin:end])
            self.change(at_ns, change.applied_to(self.config))
            begin = end
        self._run(until_ns, frames[begin:])
        delivered, self._delivered = self._delivered, _Departures([], [])
        return delivered

    @property
    def next_ns(self) -> int | None:
        """See `Channel.next_ns`."""
        leaves_ns = self._transmitter.next_ns
        if leaves_ns is None:
            return None
        arrives_ns = leaves_ns + self._least_delay_ns
        return min(arrives_ns, self._changes[0][0]) if self._changes else arrives_ns

    def outage(self, now_ns: int) -> Outage | None:
        """See `Channel.outage`."""
        return self._outages.at(now_ns)

    def change(self, now_ns: int, config: OneWay) -> None:
        """From `now_ns` on, be as `config` says."""
        before, self.config = self.config, config
        self._least_delay_ns = config.least_delay_ns
        self._chance.configure(config)
        self._transmitter.change(now_ns, config)
        self._settle()
        if (config.delay_s, config.delay_table) != (before.delay_s, before.delay_table):
            self._delay = Delay(config)
            # What is sent from now on may be there before what went another way.
            self._latest_ns = 0

    def set_out(self, now_ns: int, *, out: bool) -> None:
        """From `now_ns` on, be out, or as scheduled."""
        if out is not self._outages.told_out:
            self._outages.tell(now_ns)
            self._note_outage(now_ns, OutageReason.CONTROL, down=out)

    def _run(self, until_ns: int, frames: Sequence[Frame]) -> None:
        self._transmitter.run(until_ns, frames, self._chance.draw(frames))
        self._settle()

    def _settle(self) -> None:
        """Decide what becomes of the frames that have left, or never will.

        All at once, column by column: that is three times as fast as frame by frame.
        """
        sent, dropped = self._transmitter.take()
        if dropped:
            passages = [drop.passage for drop in dropped]
            fates = [drop.fate for drop in dropped]
            self._note(passages, _Ends.never(fates), [drop.time_ns for drop in dropped], copy=0)
        if sent:
            self._propagate(sent)

    def _propagate(self, sent: Sequence[Passage]) -> None:
        there_ns = self._propagated_ns([passage.end_ns for passage in sent])
        # A frame that is lost or held back holds up others as if it were not, and a copy does not:
        # so no impairment shows in what another one does.
        jittered_ns = map(add, there_ns, [passage.jitter_ns for passage in sent])
        in_order_ns = list(accumulate(jittered_ns, max, initial=self._latest_ns))[1:]
        self._latest_ns = in_order_ns[-1]
        arrivals_ns = in_order_ns.copy()
        unusual = _unusual(sent)
        for place, luck in unusual:
            arrivals_ns[place] += luck.hold_ns
        fates = self._decide(sent, unusual, arrivals_ns, copy=0)
        twice: list[Passage] = []
        copies_ns: list[int] = []
        for place, luck in unusual:
            if luck.copy_ns is not None and fates[place] is Fate.DELIVERED:
                twice.append(sent[place])
                copy_ns = max(there_ns[place] + luck.copy_ns, in_order_ns[place])
                copies_ns.append(copy_ns + luck.hold_ns)
        if twice:
            self._decide(twice, _unusual(twice), copies_ns, copy=1)

    def _propagated_ns(self, ends_ns: Sequence[int]) -> list[int]:
        if self.config.delay_table:
            return [end_ns + self._delay.at(end_ns) for end_ns in ends_ns]
        delay_ns = self._least_delay_ns
        return [end_ns + delay_ns for end_ns in ends_ns]

    def _decide(
        self,
        sent: Sequence[Passage],
        unusual: Sequence[tuple[int, Luck]],
        arrivals_ns: Sequence[int],
        copy: int,
    ) -> Sequence[Fate]:
        """The fates of frames that would arrive at these times; notes them, and what arrives."""
        fates = [Fate.DELIVERED] * len(sent)
        for place, luck in unusual:
            fates[place] = luck.loss or Fate.DELIVERED
        known_ns, ends_ns = arrivals_ns, [passage.end_ns for passage in sent]
        if self._direction is Direction.UP:
            reasons = self._outages.reasons(arrivals_ns, arrivals_ns)
        else:
            reasons = self._outages.reasons([passage.start_ns for passage in sent], ends_ns)
            if reasons:
                # A downlink frame is known to be lost to an outage as it leaves.
                times_ns = zip(reasons, ends_ns, arrivals_ns, strict=True)
                known_ns = [end if reason else arrival for reason, end, arrival in times_ns]
        for place, reason in enumerate(reasons or ()):
            if reason is not None:
                fates[place] = Fate.OUTAGE
        delivered = [fate is Fate.DELIVERED for fate in fates]
        payloads = [passage.frame.payload for passage in sent]
        flipped = [0] * len(sent)
        for place, luck in unusual:
            if luck.flips and delivered[place]:
                payloads[place] = _flipped(payloads[place], luck.flips)
                flipped[place] = len(luck.flips)
        sequences = [passage.frame.sequence for passage in sent]
        frames = map(Frame, repeat(self._direction), sequences, arrivals_ns, payloads)
        self._delivered.ends_ns.extend(compress(ends_ns, delivered))
        self._delivered.frames.extend(compress(frames, delivered))
        ends = _Ends(
            [
                time if arrives else None
                for time, arrives in zip(arrivals_ns, delivered, strict=True)
            ],
            fates,
            flipped,
            reasons or [None] * len(sent),
        )
        self._note(sent, ends, known_ns, copy)
        return fates

    def _note(
        self, passages: Sequence[Passage], ends: "_Ends", known_ns: Sequence[int], copy: int
    ) -> None:
        frames = [passage.frame for passage in passages]
        sequences = [frame.sequence for frame in frames]
        notes = map(
            FrameFate,
            repeat(self._direction),
            sequences,
            [passage.size_byte for passage in passages],
            [frame.time_ns for frame in frames],
            [passage.start_ns for passage in passages],
            [passage.end_ns for passage in passages],
            ends.arrivals_ns,
            ends.fates,
            [passage.priority for passage in passages],
            repeat(copy),
            ends.flipped_bits,
            ends.outages,
        )
        entries = map(Entry, known_ns, repeat(self._direction), sequences, repeat(copy), notes)
        self.agenda.add(list(entries))

    def _note_outage(self, time_ns: int, reason: OutageReason, *, down: bool) -> None:
        # Counted, so that the end of one outage stays before the begin of the next.
        self._outages_noted += 1
        outage = LinkOutage(self._direction, down=down, reason=reason)
        self.agenda.add([Entry(time_ns, self._direction, -1, self._outages_noted, outage)])


def _flipped(payload: bytes, bits: Sequence[int]) -> bytes:
    flipped = bytearray(payload)
    for bit in bits:
        flipped[bit // 8] ^= 1 << bit % 8
    return bytes(flipped)


def _unusual(passages: Sequence[Passage]) -> list[tuple[int, Luck]]:
    """Those that meet with more than jitter, by their place."""
    lucks = [passage.luck for passage in passages]
    return [(place, luck) for place, luck in enumerate(lucks) if luck is not CALM]
