"""Orders at set times, given from outside a run."""

from collections.abc import Sequence

from farside.acts import Act
from farside.missions.conductor import Watcher
from farside.node import Record, Role


class TimedOrders(Watcher):
    """A watcher of a run that gives orders; the mission's operator must be `queued`.

    Args:
        orders: each with the simulated time, in seconds, from which on it may be given. It is given
            at the start of the first window that begins then or later.
    """

    def __init__(self, orders: Sequence[tuple[float, Act]]) -> None:
        self._orders = sorted(orders, key=lambda order: order[0])
        self._given = 0

    def orders(self, now_s: float) -> Sequence[Act]:
        """See `Watcher.orders`."""
        first = self._given
        while self._given < len(self._orders) and self._orders[self._given][0] <= now_s:
            self._given += 1
        return [act for _, act in self._orders[first : self._given]]

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`."""

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `Watcher.wait`."""
