"""What every operator is: asked with a situation, it answers with orders."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from farside.acts import Act
from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.topics import OperatorEntry


class Situation(NamedTuple):
    """What an operator knows when asked for a decision.

    Attributes:
        now_ns: simulated time at the ground.
        belief: what the ground knows of the rover.
        commands: the commands given so far, and what is known of each. The next order of this
            operator becomes number `commands.last_given + 1`.
        silent: whether the rover has not been heard for too long.
    """

    now_ns: int
    belief: Belief
    commands: CommandDesk
    silent: bool

    @property
    def settled(self) -> bool:
        """Whether all commands given so far are known to be over."""
        return self.commands.is_settled


class Operator(Protocol):
    """Decides at the ground. It is asked on every tick."""

    @property
    def progress(self) -> OperatorEntry:
        """How far it has come, as of the last time it was asked, and what it waits for."""
        ...

    def act(self, situation: Situation) -> Sequence[Act]:
        """What to give now, in order; nothing to wait."""
        ...
