"""Foxglove's play bar: what a viewer asks of playback, and what is sent to it."""

import math
from collections.abc import Iterable
from enum import StrEnum
from itertools import islice
from typing import NamedTuple, Protocol

from farside.logs.playing import Player, Source
from farside.node import Record

MOST_AT_ONCE = 1000
"""Messages sent for one tick; the rest follows with the next ones, so that a viewer on the same
machine loses none however fast the playback is (project default; tried at 2,000 a tick)."""

_TICKS_HELD = 2


class Feed(Source, Protocol):
    """What a play bar plays."""

    def latest_each(self, time_ns: int, names: Iterable[str] | None = None) -> list[Record]:
        """The last record of each topic by a time, in log order.

        Args:
            time_ns: greatest log time.
            names: of these topics; of all by default.
        """
        ...


class Status(StrEnum):
    """What playback is doing. `BUFFERING` is a run on its way to a time that was asked for."""

    PLAYING = "playing"
    PAUSED = "paused"
    BUFFERING = "buffering"
    ENDED = "ended"


class BarState(NamedTuple):
    """What the play bar shows.

    Attributes:
        status: see `Status`.
        time_ns: simulated time of the position.
        speed: simulated seconds per wall second.
        did_seek: whether the viewer has to forget what it got.
    """

    status: Status
    time_ns: int
    speed: float
    did_seek: bool = False


class Tick(NamedTuple):
    """What goes to the viewers now, in this order.

    Attributes:
        state: of the play bar, where it is news.
        records: in log order.
        time_ns: the time that they bring the viewers to.
    """

    state: BarState | None
    records: list[Record]
    time_ns: int


class PlayBar:
    """Plays a log to viewers as they ask for it.

    After a seek, the last message of each topic before that time is sent, so that every panel is
    right at once; and so it is for a topic that a viewer has newly subscribed to. Nothing that is
    sent has a log time after the position.

    What is played may be a run in progress. Playback then paces the run: the run goes on when
    playback has caught up with it and plays. A seek to a time that the run has not reached makes
    the run hurry there, and shows nothing of the way.

    Args:
        player: plays a `Feed`.
        feed: the same feed.
        end_ns: end of the play bar: of the log, or of the mission that is still running.
        waiting: whether to stand still until the first viewer has subscribed.
    """

    def __init__(self, player: Player, feed: Feed, end_ns: int, *, waiting: bool = False) -> None:
        self._player = player
        self._feed = feed
        self._end_ns = end_ns
        self._waiting = waiting
        self._target_ns: int | None = None
        self._held = 0
        self._subscribed: set[str] = set()
        self._sent_to_ns = player.now_ns
        self._behind = False
        self._told: BarState | None = None

    @property
    def wants_more(self) -> bool:
        """Whether the run in progress has to go on before anything else can be shown."""
        if self._target_ns is not None:
            return self._feed.there_until_ns < self._target_ns
        player = self._player
        return player.playing and player.at_end and not (self._behind or self._held)

    @property
    def state(self) -> BarState:
        """What the play bar shows now."""
        return BarState(self._status, self._time_ns, self._player.speed)

    def request(self, *, playing: bool, speed: float, seek_ns: int | None) -> BarState:
        """Do what a viewer asks for; returns the answer to it.

        Args:
            playing: whether time is to pass.
            speed: simulated seconds per wall second; any that is not above 0 changes nothing.
            seek_ns: time to jump to, or `None`.
        """
        player = self._player
        if speed > 0 and math.isfinite(speed):
            player.set_speed(speed)
        if playing:
            player.play()
        else:
            player.pause()
            if seek_ns is None and self._target_ns is not None:
                seek_ns = self._feed.there_until_ns  # a pause on the way is its end
        if seek_ns is not None:
            self._seek(seek_ns)
        self._told = self.state
        return self._told._replace(did_seek=seek_ns is not None)

    def subscribe(self, name: str) -> None:
        """A viewer has subscribed to a topic."""
        self._subscribed.add(name)
        self._waiting = False

    def finish(self) -> None:
        """The run in progress is over: its log is all that will be played."""
        self._end_ns = self._feed.end_ns
        if self._target_ns is not None:
            self._seek(self._target_ns)

    def advance(self, wall_s: float) -> Tick:
        """Let wall time pass, and say what goes to the viewers.

        Args:
            wall_s: seconds since the last call.

        Raises:
            LogError: if the log is damaged or missing.
        """
        if self._waiting or not self._arrived():
            return Tick(self._news(), [], self._time_ns)
        if self._held:
            # The answer to a seek and messages take different queues of the server's. Held back a
            # moment, what is so after the seek cannot overtake it, and be forgotten with the rest.
            self._held -= 1
            return Tick(self._news(), [], self._time_ns)
        records = self._newly_subscribed() if self._subscribed else []
        played = self._player.advance(wall_s)
        if played.jumped:
            records = self._feed.latest_each(self._player.now_ns)
            self._behind = False
        else:
            due = list(islice(played.records, MOST_AT_ONCE))
            self._behind = len(due) == MOST_AT_ONCE
            records += due
        self._sent_to_ns = (
            records[-1].log_time_ns if self._behind and records else self._player.now_ns
        )
        return Tick(self._news(), records, self._time_ns)

    # --- where it is ---------------------------------------------------------------------------

    @property
    def _time_ns(self) -> int:
        return self._sent_to_ns if self._target_ns is None else self._target_ns

    @property
    def _status(self) -> Status:
        if self._target_ns is not None:
            return Status.BUFFERING
        if self._player.at_end and not self._behind and self._player.now_ns >= self._end_ns:
            return Status.ENDED
        passes = self._player.playing and not self._waiting
        return Status.PLAYING if passes else Status.PAUSED

    def _news(self) -> BarState | None:
        """The state, if it is not what the viewers know, but for the time that passes."""
        state = self.state
        if self._told is not None and state._replace(time_ns=0) == self._told._replace(time_ns=0):
            return None
        self._told = state
        return state

    def _seek(self, time_ns: int) -> None:
        time_ns = max(0, min(time_ns, self._end_ns))
        self._target_ns = time_ns if time_ns > self._feed.there_until_ns else None
        self._player.seek(time_ns)
        self._sent_to_ns = self._player.now_ns
        self._behind = False
        self._held = _TICKS_HELD

    def _arrived(self) -> bool:
        """Whether the run has reached the time that it hurries to, if it does."""
        if self._target_ns is None:
            return True
        if self._feed.there_until_ns < self._target_ns:
            return False
        self._player.seek(self._target_ns)
        self._sent_to_ns = self._player.now_ns
        self._target_ns = None
        return True

    def _newly_subscribed(self) -> list[Record]:
        names, self._subscribed = self._subscribed, set()
        self._told = None  # whoever subscribes may have just come
        return self._feed.latest_each(self._sent_to_ns, names)
