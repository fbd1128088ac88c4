"""The orders of another run, given once more."""

from collections.abc import Sequence

from farside.acts import Act
from farside.ground.config import RecordedConfig
from farside.ground.operators.operator import Situation
from farside.topics import GROUND_OPERATOR, GROUND_ORDER, OperatorEntry


class RecordedOperator:
    """Gives the orders of a log, each at its time, whatever the rover does.

    With the mission and the seed of that log the run is the same: to whoever gave the orders first,
    the ground looks just as it did then. Its progress is that of the recorded operator, too.

    Args:
        recorded: what was given, and how far the operator had come, in order of time.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, recorded: RecordedConfig) -> None:
        self._orders = [
            (line.time_ns, GROUND_ORDER.decode(line.json.encode()).act)
            for line in recorded.orders or ()
        ]
        self._steps = [
            (line.time_ns, GROUND_OPERATOR.decode(line.json.encode())) for line in recorded.progress
        ]
        self._given = self._shown = 0
        self.progress = OperatorEntry(0, self._steps[0][1].of if self._steps else 0, None)
        if self._steps and self._steps[0][1] == self.progress:
            # A change is what the ground notes, and the first one was noted.
            self.progress = OperatorEntry(0, self.progress.of, "the first order")

    def act(self, situation: Situation) -> Sequence[Act]:
        """The orders whose time has come; see `Operator`."""
        steps, orders, now_ns = self._steps, self._orders, situation.now_ns
        while self._shown < len(steps) and steps[self._shown][0] <= now_ns:
            self.progress = steps[self._shown][1]
            self._shown += 1
        first = self._given
        while self._given < len(orders) and orders[self._given][0] <= now_ns:
            self._given += 1
        return [act for _, act in orders[first : self._given]]
