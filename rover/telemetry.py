"""Telemetry: when it is sent, and what of it waits in the store until it can arrive."""

from collections import deque

from farside.link.endpoint.endpoint import Endpoint, LinkTerms, StoreState
from farside.messages import Downlink, Telemetry, Uplink
from farside.node import NS_PER_S, Journal
from farside.topics import ROVER_STORE, StoreEntry

_INTERVAL_NS = NS_PER_S
_HEARTBEATS = 2.5  # one may be lost
_MARGIN_NS = 4 * NS_PER_S


class Reporting:
    """Sends telemetry, and stores what is not known to have arrived.

    Every heartbeat of the ground says which telemetry is the newest there. When that is older than
    a round trip explains, the ground hears nothing, whatever the rover hears: then all since is
    kept in the store, and forwarded once newer telemetry is known to arrive.

    Args:
        endpoint: the rover's end of the link.
        terms: of the link.
        journal: where the state of the store is noted.
    """

    def __init__(
        self, endpoint: Endpoint[Downlink, Uplink], terms: LinkTerms, journal: Journal
    ) -> None:
        self._endpoint, self._journal = endpoint, journal
        self._usual_ns = terms.round_trip_ns + int(_HEARTBEATS * terms.heartbeat_ns) + _MARGIN_NS
        self._unheard: deque[Telemetry] = deque()
        self._heard_ns = 0  # time stamp of the newest telemetry known to be at the ground
        self._next_ns = self._sent_ns = 0
        self._interval_ns = _INTERVAL_NS  # that the rate allows
        self._state = StoreState(0, 0, 0)

    def is_due(self, now_ns: int) -> bool:
        """Whether telemetry is to be sent."""
        return now_ns >= self._next_ns

    def is_heard(self, now_ns: int) -> bool:
        """Whether the ground is known to have received telemetry lately."""
        return now_ns - self._heard_ns <= self._usual_ns + 2 * self._interval_ns

    def acknowledged(self, time_ns: int) -> None:
        """The newest telemetry at the ground has this time stamp."""
        self._heard_ns = max(self._heard_ns, time_ns)
        while self._unheard and self._unheard[0].time_ns <= self._heard_ns:
            self._unheard.popleft()

    def report(self, telemetry: Telemetry) -> None:
        """Send telemetry, and store it if the ground does not hear the rover."""
        now_ns = self._sent_ns = telemetry.time_ns
        self._endpoint.send(telemetry, now_ns)
        self._interval_ns = max(_INTERVAL_NS, self._endpoint.telemetry_interval_ns(now_ns))
        self._unheard.append(telemetry)
        if not self.is_heard(now_ns):
            while self._unheard:
                kept = self._unheard.popleft()
                self._endpoint.store(kept, kept.time_ns)
        self.soon(now_ns + _INTERVAL_NS)

    def soon(self, wanted_ns: int) -> None:
        """Send telemetry at `wanted_ns`, or as soon after it as the rate allows.

        What is only stored waits for no rate.
        """
        interval_ns = 0
        if self.is_heard(wanted_ns):
            interval_ns = self._endpoint.telemetry_interval_ns(self._sent_ns)
        self._next_ns = max(wanted_ns, self._sent_ns + interval_ns)

    def forward(self, now_ns: int) -> None:
        """Send from the store while the ground hears the rover."""
        if self.is_heard(now_ns):
            self._endpoint.forward(now_ns)

    def note_store(self) -> None:
        """Note the state of the store if it has changed."""
        state = self._endpoint.store_state
        if state != self._state:
            self._state = state
            self._journal.note(ROVER_STORE, StoreEntry(*state))
