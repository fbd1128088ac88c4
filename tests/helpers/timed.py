"""An operator who gives orders by the clock, whatever happens."""

from collections.abc import Sequence

from farside.ground import Situation
from farside.messages import Order
from farside.node import to_ns
from farside.topics import OperatorEntry


class Timed:
    """Gives each order at its time, in seconds; several at one time in their order."""

    def __init__(self, orders: Sequence[tuple[float, Order]]) -> None:
        self._orders = [(to_ns(t_s), order) for t_s, order in orders]
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Order]:
        due = [order for t_ns, order in self._orders if t_ns <= situation.now_ns]
        self._orders = self._orders[len(due) :]
        return due
