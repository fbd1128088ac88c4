"""One direction of the channel: from hand-over to arrival, and the fate of every frame."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from itertools import accumulate, compress, repeat
from operator import add, attrgetter, itemgetter
from typing import NamedTuple

from numpy.random import Generator

from farside.frames import Fate, FrameFate, LinkOutage, OutageReason
from farside.link.channel.agenda import Agenda, PendingRecord
from farside.link.channel.chance import NOTHING_DRAWN, UNIMPAIRED, Impairment, RandomImpairments
from farside.link.channel.lanes import Lane
from farside.link.channel.outages import Outages
from farside.link.channel.queueing import Dropped, Transmission
from farside.link.profile.config import LinkChange, LinkConfig, OneWay
from farside.link.profile.schedule import Outage, outages_of, told_outages_of
from farside.node import Direction, Frame, to_ns

_time = attrgetter("time_ns")


class Departures(NamedTuple):
    """Frames that will arrive, at their time of arrival, and from when on that is known.

    On a direct link that is when the last bit left, on a way by other nodes a light time of the
    whole way before it arrives.
    """

    ends_ns: list[int]
    frames: list[Frame]


class _Outcomes(NamedTuple):
    """What became of some frames, as columns of `FrameFate`."""

    arrivals_ns: Sequence[int | None]
    fates: Sequence[Fate]
    flipped_bits: Sequence[int]
    outages: Sequence[OutageReason | None]

    @classmethod
    def never(cls, dropped: Sequence[Dropped]) -> "_Outcomes":
        """The outcomes of frames that were never sent, or dropped on their way."""
        count = len(dropped)
        outages = [drop.outage for drop in dropped]
        return cls([None] * count, [drop.fate for drop in dropped], [0] * count, outages)


class OneWayChannel:
    """One direction: random impairments, a transmitter, propagation, outages at the rover's end.

    Args:
        direction: which one.
        link: the link, resolved.
        rng: the direction's generator, from which one per purpose is spawned.

    Attributes:
        agenda: the records that are decided but not yet due.
        config: the settings in force.
    """

    def __init__(self, direction: Direction, link: LinkConfig, rng: Generator) -> None:
        self._direction = direction
        self._changes = deque(_changes_of(link, direction))
        self.config = link.way(direction)
        self._impairments = RandomImpairments(rng, self.config)
        (self._rng,) = rng.spawn(1)
        self._delivered = Departures([], [])
        self._outages = Outages(outages_of(link, direction))
        self._told = Outages(told_outages_of(link, direction))
        self._outages_noted = 0
        self.agenda = Agenda()
        self._routing = link.routing
        self._lane = Lane(direction, link, self.config, self._outages, self._rng)
        self._left: list[Lane] = []  # what has taken frames before the way changed
        self._note_outages(told_outages_of(link, direction))

    def advance(self, until_ns: int, frames: Sequence[Frame]) -> Departures:
        """Take the frames handed over before `until_ns`, and apply the changes due by then.

        Returns:
            the frames that left and will arrive.
        """
        begin = 0
        while self._changes and self._changes[0][0] < until_ns:
            at_ns, change = self._changes.popleft()
            end = bisect_left(frames, at_ns, lo=begin, key=_time)
            self._run(at_ns, frames[begin:end])
            self.change(at_ns, change.applied_to(self.config))
            begin = end
        self._run(until_ns, frames[begin:])
        delivered, self._delivered = self._delivered, Departures([], [])
        return delivered

    @property
    def next_ns(self) -> int | None:
        """See `Channel.next_ns`."""
        lanes = (self._lane, *self._left)
        moments = [
            leaves_ns + lane.least_delay_ns
            for lane in lanes
            if (leaves_ns := lane.carrier.next_ns) is not None
        ]
        if moments and self._changes:
            moments.append(self._changes[0][0])
        return min(moments, default=None)

    def outage(self, now_ns: int) -> Outage | None:
        """See `Channel.outage`."""
        return self._outages.at(now_ns) or self._told.at(now_ns)

    def change(self, now_ns: int, config: OneWay) -> None:
        """Use `config` from `now_ns` on; see `Channel.change`."""
        self.config = config
        self._impairments.configure(config)
        self._lane.carrier.change(now_ns, config)
        self._settle()
        self._lane.agree(now_ns, config)

    def adopt(self, now_ns: int, link: LinkConfig) -> None:
        """Be this direction of `link` from `now_ns` on; see `Channel.adopt`."""
        config, changes = link.way(self._direction), _changes_of(link, self._direction)
        self._changes = deque(change for change in changes if change[0] >= now_ns)
        for _, change in changes[: len(changes) - len(self._changes)]:
            config = change.applied_to(config)
        if link.routing != self._routing:
            # What is on its way goes on as it was.
            self._left.append(self._lane)
            self._routing, self.config = link.routing, config
            self._impairments.configure(config)
            self._lane = Lane(self._direction, link, config, self._outages, self._rng)
        elif config != self.config:
            self.change(now_ns, config)
        self.agenda.drop_outages()
        began_ns = [lane.carrier.began_ns for lane in (self._lane, *self._left)]
        since_ns = min((ns for ns in began_ns if ns is not None), default=None)
        self._outages.reschedule(now_ns, outages_of(link, self._direction), since_ns)
        told = told_outages_of(link, self._direction)
        self._note_outages(self._told.reschedule(now_ns, told), since_ns=now_ns)

    def reseed(self, rng: Generator) -> None:
        """Draw from other random streams; see `Channel.reseed`."""
        self._impairments = RandomImpairments(rng, self.config)
        (other,) = rng.spawn(1)
        # In place, for whatever draws from it already.
        self._rng.bit_generator.state = other.bit_generator.state

    def set_out(self, now_ns: int, *, out: bool) -> None:
        """Be out, or as scheduled, from `now_ns` on; see `Channel.set_out`."""
        if out is not self._outages.is_commanded:
            self._outages.toggle(now_ns)
            self.agenda.add([self._outage_record(now_ns, OutageReason.CONTROL, down=out)])

    def _run(self, until_ns: int, frames: Sequence[Frame]) -> None:
        for lane in self._left:
            lane.carrier.run(until_ns, (), NOTHING_DRAWN)
        self._lane.carrier.run(until_ns, frames, self._impairments.draw(frames))
        self._settle()

    def _settle(self) -> None:
        """Decide the fate of the frames that have left, or never will."""
        for lane in self._left:
            self._settle_lane(lane)
        self._left = [lane for lane in self._left if lane.carrier.next_ns is not None]
        self._settle_lane(self._lane)

    def _settle_lane(self, lane: Lane) -> None:
        """Column by column, which is three times as fast as frame by frame."""
        sent, dropped = lane.carrier.take()
        if lane.forwarder is not None:
            self.agenda.add(lane.forwarder.take_hops())
        if dropped:
            frames = [drop.transmission for drop in dropped]
            times_ns = [drop.time_ns for drop in dropped]
            self._note(frames, _Outcomes.never(dropped), times_ns, copy=0)
        if sent:
            self._propagate(lane, sent)

    def _propagate(self, lane: Lane, sent: Sequence[Transmission]) -> None:
        propagated_ns = lane.propagated_ns(sent)
        # For the order of arrival, lost and held-back frames count as if they were neither, and
        # duplicates do not count: so no impairment alters the effect of another.
        jittered_ns = map(add, propagated_ns, [one.jitter_ns for one in sent])
        in_order_ns = list(accumulate(jittered_ns, max, initial=lane.latest_ns))[1:]
        lane.latest_ns = in_order_ns[-1]
        arrivals_ns = in_order_ns.copy()
        impaired = _impaired(sent)
        for index, impairment in impaired:
            arrivals_ns[index] += impairment.hold_ns
        fates = self._decide(lane, sent, impaired, arrivals_ns, copy=0)
        duplicated: list[Transmission] = []
        copies_ns: list[int] = []
        for index, impairment in impaired:
            if impairment.copy_ns is not None and fates[index] is Fate.DELIVERED:
                duplicated.append(sent[index])
                copy_ns = max(propagated_ns[index] + impairment.copy_ns, in_order_ns[index])
                copies_ns.append(copy_ns + impairment.hold_ns)
        if duplicated:
            self._decide(lane, duplicated, _impaired(duplicated), copies_ns, copy=1)

    def _decide(
        self,
        lane: Lane,
        sent: Sequence[Transmission],
        impaired: Sequence[tuple[int, Impairment]],
        arrivals_ns: Sequence[int],
        *,
        copy: int,
    ) -> Sequence[Fate]:
        """Decide and record the fates of frames that would arrive at these times."""
        fates = [Fate.DELIVERED] * len(sent)
        for index, impairment in impaired:
            fates[index] = impairment.loss or Fate.DELIVERED
        known_ns, ends_ns = arrivals_ns, lane.ends_ns(sent)
        if self._direction is Direction.UP:
            reasons = self._outages.reasons(arrivals_ns, arrivals_ns)
        elif lane.forwarder is not None:
            reasons = None  # what left during an outage has come no further
        else:
            reasons = self._outages.reasons([one.start_ns for one in sent], ends_ns)
            if reasons:
                # A downlink frame is known to be lost to an outage as it leaves.
                times_ns = zip(reasons, ends_ns, arrivals_ns, strict=True)
                known_ns = [end if reason else arrival for reason, end, arrival in times_ns]
        for index, reason in enumerate(reasons or ()):
            if reason is not None:
                fates[index] = Fate.OUTAGE
        delivered = [fate is Fate.DELIVERED for fate in fates]
        payloads = [one.frame.payload for one in sent]
        flipped = [0] * len(sent)
        for index, impairment in impaired:
            if impairment.flips and delivered[index]:
                payloads[index] = _flipped(payloads[index], impairment.flips)
                flipped[index] = impairment.flips.bit_count()
        sequences = [one.frame.sequence for one in sent]
        frames = map(Frame, repeat(self._direction), sequences, arrivals_ns, payloads)
        self._delivered.ends_ns.extend(compress(ends_ns, delivered))
        self._delivered.frames.extend(compress(frames, delivered))
        outcomes = _Outcomes(
            [
                time if arrives else None
                for time, arrives in zip(arrivals_ns, delivered, strict=True)
            ],
            fates,
            flipped,
            reasons or [None] * len(sent),
        )
        self._note(sent, outcomes, known_ns, copy)
        return fates

    def _note(
        self,
        transmissions: Sequence[Transmission],
        outcomes: _Outcomes,
        known_ns: Sequence[int],
        copy: int,
    ) -> None:
        frames = [one.frame for one in transmissions]
        sequences = [frame.sequence for frame in frames]
        messages = map(
            FrameFate,
            repeat(self._direction),
            sequences,
            [one.size_byte for one in transmissions],
            [frame.time_ns for frame in frames],
            [one.start_ns for one in transmissions],
            [one.end_ns for one in transmissions],
            outcomes.arrivals_ns,
            outcomes.fates,
            [one.priority for one in transmissions],
            repeat(copy),
            outcomes.flipped_bits,
            outcomes.outages,
        )
        keys = known_ns, repeat(self._direction), sequences, repeat(copy)
        self.agenda.add(list(map(PendingRecord, *keys, messages)))

    def _note_outages(self, outages: Sequence[Outage], since_ns: int = 0) -> None:
        records = []
        for begin_ns, end_ns, reason in outages:
            if begin_ns >= since_ns:
                records.append(self._outage_record(begin_ns, reason, down=True))
            records.append(self._outage_record(end_ns, reason, down=False))
        self.agenda.add(records)

    def _outage_record(self, time_ns: int, reason: OutageReason, *, down: bool) -> PendingRecord:
        # Numbered, so that the end of one outage is recorded before the beginning of the next.
        self._outages_noted += 1
        outage = LinkOutage(self._direction, down=down, reason=reason)
        return PendingRecord(time_ns, self._direction, -1, self._outages_noted, outage)


def _changes_of(link: LinkConfig, direction: Direction) -> list[tuple[int, LinkChange]]:
    """The changes of one direction, each with its time in nanoseconds, in order."""
    own = (change for change in link.changes if change.direction.includes(direction))
    return sorted(((to_ns(change.at_s), change) for change in own), key=itemgetter(0))


def _flipped(payload: bytes, bits: int) -> bytes:
    return (int.from_bytes(payload, "little") ^ bits).to_bytes(len(payload), "little")


def _impaired(transmissions: Sequence[Transmission]) -> list[tuple[int, Impairment]]:
    """Index and impairment of those that meet with more than jitter."""
    impairments = [one.impairment for one in transmissions]
    return [(index, one) for index, one in enumerate(impairments) if one is not UNIMPAIRED]
