"""What every operator is: asked with a situation, it answers with orders."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from farside.ground.belief import Belief
from farside.messages import Order
from farside.topics import OperatorEntry


class Situation(NamedTuple):
    """What an operator knows when asked for a decision.

    Attributes:
        now_ns: simulated time at the ground.
        belief: what the ground knows of the rover.
        settled: whether the rover is known to have finished all commands sent so far.
        silent: whether the rover has not been heard for too long.
    """

    now_ns: int
    belief: Belief
    settled: bool
    silent: bool


class Operator(Protocol):
    """Decides at the ground. It is asked on every tick."""

    @property
    def progress(self) -> OperatorEntry:
        """How far it has come, as of the last time it was asked, and what it waits for."""
        ...

    def act(self, situation: Situation) -> Sequence[Order]:
        """The orders to send now, in order; none to wait."""
        ...
