"""The channel: what the link does to frames, decided from the frames and their times alone."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import attrgetter

from numpy.random import Generator

from farside.frames import FrameFate, FrameHop, LinkOutage
from farside.link.channel.agenda import PendingRecord
from farside.link.channel.one_way import OneWayChannel
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.schedule import Outage
from farside.node import Direction, Frame, Journal, Step
from farside.topics import LINK_FRAME, LINK_HOP, LINK_OUTAGE

_sequence = attrgetter("sequence")
_time = attrgetter("time_ns")
_kind = attrgetter("message.__class__")


class Channel:
    """The link between the two endpoints, as a `Node` whose arrivals are the frames sent into it.

    In each direction a frame waits in the transmit queue, the highest priority first, is sent
    (rate, overhead), propagates, and is delayed by jitter on top. Frames arrive in order, except
    those held back, duplicates, and those sent before the delay was changed. Random impairments
    are drawn when a frame is handed over; see `farside.link.channel.chance`.

    A frame is lost to an outage if it is at the rover's end during one: an uplink frame when it
    would arrive, a downlink frame while any of it is sent. What has already passed arrives.

    On a way by other nodes (`LinkConfig.routing`) frames are stored and forwarded instead, see
    `farside.link.channel.forwarding`; all else happens to them once, where they arrive.

    The fate of a frame is decided when its last bit leaves. Changes of rate, delay and outages
    before that apply to it.

    Args:
        config: the link, resolved. Its `changes` are applied at their times.
        rngs: a generator per direction, from which one per purpose is spawned.
    """

    def __init__(self, config: LinkConfig, rngs: Mapping[Direction, Generator]) -> None:
        self._journal = Journal()
        self._now_ns = 0
        # In this order, records and frames of the same time are given back.
        self._ways = {
            direction: OneWayChannel(direction, config, rngs[direction])
            for direction in (Direction.DOWN, Direction.UP)
        }

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Take the frames sent before `until_ns`; give back those that will arrive, at their time.

        They are in the order in which they left, not in that of arrival.

        Raises:
            ValueError: if a frame was sent before or after this window.
        """
        # Two stable sorts by one key each are faster than one by both.
        frames = sorted(arrivals, key=_sequence)
        frames.sort(key=_time)
        self._expect_in_window(frames, until_ns)
        ends_ns: list[int] = []
        sent: list[Frame] = []
        due: list[PendingRecord] = []
        for direction, way in self._ways.items():
            own = [frame for frame in frames if frame.direction is direction]
            departures = way.advance(until_ns, own)
            ends_ns += departures.ends_ns
            sent += departures.frames
            due += way.agenda.due(until_ns)
        due.sort()
        self._note(due)
        self._now_ns = until_ns
        order = sorted(range(len(sent)), key=ends_ns.__getitem__)
        return Step([sent[index] for index in order], self._journal.take())

    def _note(self, due: Sequence[PendingRecord]) -> None:
        """Record what is due, in runs of one topic: there are few outages."""
        for _, group in groupby(due, _kind):
            run = list(group)
            times_ns = [one.time_ns for one in run]
            fates = [one.message for one in run if isinstance(one.message, FrameFate)]
            if fates:
                self._journal.note_all(LINK_FRAME, fates, times_ns)
                continue
            hops = [one.message for one in run if isinstance(one.message, FrameHop)]
            if hops:
                self._journal.note_all(LINK_HOP, hops, times_ns)
                continue
            outages = [one.message for one in run if isinstance(one.message, LinkOutage)]
            self._journal.note_all(LINK_OUTAGE, outages, times_ns)

    def change(self, direction: Direction, one_way: OneWay) -> None:
        """From now on, `direction` uses the settings `one_way`.

        Random impairments change for frames handed over from now on, all else for those whose last
        bit has not left.
        """
        self._ways[direction].change(self._now_ns, one_way)

    def adopt(self, config: LinkConfig) -> None:
        """From now on, be the link `config`, with its outages, and its changes that are to come.

        As by `change`, what has left keeps its fate. What both ends agreed on beforehand, such as
        foreseen outages and light times, is not the channel's, and stays.
        """
        for way in self._ways.values():
            way.adopt(self._now_ns, config)

    def reseed(self, rngs: Mapping[Direction, Generator]) -> None:
        """From now on, draw from other random streams, from their beginning."""
        for direction, way in self._ways.items():
            way.reseed(rngs[direction])

    def set_out(self, direction: Direction, out: bool) -> None:  # noqa: FBT001 - a state to be in
        """From now on, `direction` is out, or as scheduled again.

        An uplink frame that has already been given back still arrives.
        """
        self._ways[direction].set_out(self._now_ns, out=out)

    @property
    def next_ns(self) -> int | None:
        """When the next frame not yet given back can arrive at the earliest; `None` without one.

        Whoever advances on a wall clock by this time is never late. Holds until something is sent
        or changed.
        """
        moments = [way.next_ns for way in self._ways.values()]
        return min((ns for ns in moments if ns is not None), default=None)

    def settings(self, direction: Direction) -> OneWay:
        """The settings of `direction` now in force."""
        return self._ways[direction].config

    def outage(self, direction: Direction) -> Outage | None:
        """The outage of `direction` now; `None` if it is in service."""
        return self._ways[direction].outage(self._now_ns)

    def _expect_in_window(self, frames: Sequence[Frame], until_ns: int) -> None:
        for frame in (*frames[:1], *frames[-1:]):
            if not self._now_ns <= frame.time_ns < until_ns:
                raise ValueError(
                    f"expected {frame.direction} frame {frame.sequence} to be sent in the window "
                    f"[{self._now_ns}, {until_ns}) ns, found {frame.time_ns} ns"
                )
