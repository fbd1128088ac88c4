"""What carries frames across in one direction: a transmitter, or nodes that forward them."""

from collections.abc import Sequence

from numpy.random import Generator

from farside.link.channel.forwarding import Forwarder
from farside.link.channel.outages import Outages
from farside.link.channel.queueing import Transmission, Transmitter
from farside.link.profile.config import DELAY_KEYS, LinkConfig, OneWay
from farside.link.profile.schedule import Delay
from farside.node import Direction


class Lane:
    """A carrier, what it adds to the time at which the last bit leaves, and the order of arrival.

    Args:
        direction: which one.
        link: the link, resolved.
        config: the settings of the direction.
        outages: those at the rover's end.
        rng: the random stream of a transmitter.

    Attributes:
        carrier: takes frames and gives them back when they have left or are dropped.
        forwarder: the carrier, if it forwards frames by way of other nodes.
        latest_ns: when the latest frame so far arrives, which none may overtake.
        least_delay_ns: how long after it has left a frame arrives at the earliest; of a way by
            other nodes, the light time of the shortest one.
    """

    def __init__(
        self,
        direction: Direction,
        link: LinkConfig,
        config: OneWay,
        outages: Outages,
        rng: Generator,
    ) -> None:
        self.latest_ns = 0
        self.forwarder: Forwarder | None = None
        if link.routing is not None:
            self.forwarder = Forwarder(direction, link.routing, config, outages)
        self.carrier = self.forwarder or Transmitter(config, rng)
        self._configure(config)

    def _configure(self, config: OneWay) -> None:
        self._delay = Delay(config)
        self._delays = _delays_of(config)
        self.least_delay_ns = config.least_delay_ns
        if self.forwarder is not None:
            self.least_delay_ns = self.forwarder.least_delay_ns

    def agree(self, now_ns: int, config: OneWay) -> None:
        """Delay as in `config` what leaves from now on."""
        if _delays_of(config) == self._delays:
            return
        before = self._delay
        self._configure(config)
        if self._delay.at(now_ns) != before.at(now_ns):
            # What is sent from now on may overtake what was sent before.
            self.latest_ns = 0

    def propagated_ns(self, sent: Sequence[Transmission]) -> list[int]:
        """When frames that have left arrive, without jitter."""
        if self.forwarder is not None:
            return [one.arrives_ns for one in sent]
        ends_ns = [one.end_ns for one in sent]
        if not self._delay.is_constant:
            return [end_ns + self._delay.at(end_ns) for end_ns in ends_ns]
        delay_ns = self.least_delay_ns
        return [end_ns + delay_ns for end_ns in ends_ns]

    def ends_ns(self, sent: Sequence[Transmission]) -> list[int]:
        """From when on it is known when frames arrive: of a transmitter, the ends of sending.

        They are given back in this order.
        """
        if self.forwarder is not None:
            return [one.arrives_ns - self.least_delay_ns for one in sent]
        return [one.end_ns for one in sent]


def _delays_of(config: OneWay) -> list[object]:
    return [getattr(config, key) for key in DELAY_KEYS]
