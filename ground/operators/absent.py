"""Nobody at the ground."""

from collections.abc import Sequence

from farside.acts import Act
from farside.ground.operators.operator import Situation
from farside.topics import OperatorEntry


class AbsentOperator:
    """Gives no orders, ever. The ground's heartbeats go on, so the link does not count as lost.

    Attributes:
        progress: see `Operator`; it never changes.
    """

    def __init__(self) -> None:
        self.progress = OperatorEntry(0, 0, None)

    def act(self, situation: Situation) -> Sequence[Act]:  # noqa: ARG002 - it does not look
        """Nothing; see `Operator`."""
        return ()
