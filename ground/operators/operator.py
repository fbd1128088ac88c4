"""What every operator is: asked with a situation, it answers with orders."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from farside.acts import Act
from farside.ground.belief import Belief
from farside.ground.commands import CommandDesk
from farside.ground.review import review_proposal
from farside.messages import Proposal, Tokens
from farside.topics import OperatorEntry, PathReview


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

    def review(self, proposal: Proposal) -> PathReview:
        """The review of a proposal."""
        return review_proposal(proposal, self.belief, (), None, self.now_ns)

    def review_path(self, goal: Tokens) -> PathReview | None:  # noqa: ARG002 - nothing is known yet
        """The review of the way to a goal that the ground knows; `None` where it knows none."""
        return None


class Operator(Protocol):
    """Decides at the ground. It is asked on every tick."""

    @property
    def progress(self) -> OperatorEntry:
        """How far it has come, as of the last time it was asked, and what it waits for."""
        ...

    def act(self, situation: Situation) -> Sequence[Act]:
        """The orders to give now, in order; none to wait."""
        ...
