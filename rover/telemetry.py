"""Telemetry: when it is sent, and what of it waits in the store until it can arrive."""

from collections import deque

from farside.link.endpoint.endpoint import Endpoint, LinkTerms
from farside.link.endpoint.stored import StoreState
from farside.messages import Downlink, Heartbeat, Telemetry, Uplink
from farside.node import NS_PER_S, Journal
from farside.rover.config import HEARTBEATS
from farside.rover.failsafe.silence import Silence
from farside.topics import ROVER_STORE, StoreEntry

_INTERVAL_NS = NS_PER_S
_MARGIN_NS = 4 * NS_PER_S


class Reporting:
    """Sends telemetry, and stores what is not known to have arrived.

    Kept in the store is what was made in silence, and since the last frame before it. Then, every
    heartbeat of the ground says which telemetry has arrived: what lies in a gap of that, or is
    left out for longer than a round trip explains, is kept as well, though the rover hears the
    ground. Single messages lost in between are not missed: the next one says more.

    Args:
        endpoint: the rover's end of the link.
        terms: of the link.
        silence: on the link.
        journal: where the state of the store is noted.
    """

    def __init__(
        self,
        endpoint: Endpoint[Downlink, Uplink],
        terms: LinkTerms,
        silence: Silence,
        journal: Journal,
    ) -> None:
        self._endpoint, self._silence, self._journal = endpoint, silence, journal
        self._usual_ns = terms.round_trip_ns + int(HEARTBEATS * terms.heartbeat_ns) + _MARGIN_NS
        self._unheard: deque[Telemetry] = deque()
        self._heard_ns = 0  # time stamp of the newest telemetry known to be at the ground
        self._next_ns = self._sent_ns = 0
        self._interval_ns = _INTERVAL_NS  # that the rate allows
        self._state = StoreState(0, 0, 0)

    def is_due(self, now_ns: int) -> bool:
        """Whether telemetry is to be sent."""
        return now_ns >= self._next_ns

    def acknowledged(self, heartbeat: Heartbeat, now_ns: int) -> None:
        """The ground says what it has received without a gap."""
        unheard = self._unheard
        while unheard and unheard[0].time_ns <= heartbeat.telemetry_ns:
            told = unheard.popleft()
            if self._heard_ns < told.time_ns < heartbeat.unbroken_ns:
                self._store(told)
        self._heard_ns = max(self._heard_ns, heartbeat.telemetry_ns)
        overdue_ns = now_ns - self._usual_ns - 2 * self._interval_ns
        while unheard and unheard[0].time_ns < overdue_ns:
            self._store(unheard.popleft())

    def report(self, telemetry: Telemetry) -> None:
        """Send telemetry, and store it in silence, also in one that the contact plan foresees."""
        now_ns = self._sent_ns = telemetry.time_ns
        self._endpoint.send(telemetry, now_ns)
        self._interval_ns = max(_INTERVAL_NS, self._endpoint.telemetry_interval_ns(now_ns))
        self._unheard.append(telemetry)
        if self._is_unheard:
            self._store_since(self._silence.heard_ns)
        self.soon(now_ns + _INTERVAL_NS)

    @property
    def _is_unheard(self) -> bool:
        """Whether nothing can be known to arrive: in silence, planned or not."""
        return self._silence.silent or self._silence.expected

    def _store_since(self, time_ns: int) -> None:
        kept: list[Telemetry] = []
        while self._unheard and self._unheard[-1].time_ns >= time_ns:
            kept.append(self._unheard.pop())
        for telemetry in reversed(kept):
            self._store(telemetry)

    def _store(self, telemetry: Telemetry) -> None:
        self._endpoint.store(telemetry, telemetry.time_ns)

    def soon(self, wanted_ns: int) -> None:
        """Send telemetry at `wanted_ns`, or as soon after it as the rate allows.

        In silence it is made for the store first of all, which waits for no rate.
        """
        interval_ns = 0
        if not self._is_unheard:
            interval_ns = self._endpoint.telemetry_interval_ns(self._sent_ns)
        self._next_ns = max(wanted_ns, self._sent_ns + interval_ns)

    def forward(self, now_ns: int) -> None:
        """Send from the store while the ground is heard."""
        if not self._silence.silent:
            self._endpoint.forward(now_ns)

    def note_store(self) -> None:
        """Note the state of the store if it has changed."""
        state = self._endpoint.store_state
        if state != self._state:
            self._state = state
            self._journal.note(ROVER_STORE, StoreEntry(*state))
