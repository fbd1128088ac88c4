"""What every operator is: asked with a situation, it answers with orders."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from farside.acts import Act
from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.ground.outlook import Outlook
from farside.messages import Proposal, Tokens
from farside.topics import OperatorEntry, PathReview, Prediction


class Situation(NamedTuple):
    """What an operator knows when asked for a decision.

    Attributes:
        now_ns: simulated time at the ground.
        belief: what the ground knows of the rover.
        commands: the commands given so far, and what is known of each. The next order of this
            operator becomes number `commands.last_given + 1`.
        silent: whether the rover has not been heard for too long, though something was due.
        outlook: what follows from it: where the rover is by now, and its paths.
    """

    now_ns: int
    belief: Belief
    commands: CommandDesk
    silent: bool
    outlook: Outlook

    @property
    def settled(self) -> bool:
        """Whether all commands given so far are known to be over."""
        return self.commands.is_settled

    def predicted(self) -> Prediction | None:
        """Where the rover is by now; `None` before anything was heard of it."""
        return self.outlook.predicted(self.now_ns)

    def predicted_after(self) -> tuple[Prediction, ...]:
        """Where the rover will be after each command on its way that asks for an action."""
        return self.outlook.predicted_after(self.now_ns)

    def review(self, proposal: Proposal) -> PathReview:
        """What the ground finds of a proposal."""
        return self.outlook.review(proposal, self.now_ns)

    def review_path(self, goal: Tokens) -> PathReview | None:
        """What the ground finds of the way to a goal from where the rover will be.

        That is where it most probably is after all that is on its way; `None` where that is not
        known, or the shadow knows no way from there.
        """
        return self.outlook.review_path(goal, self.now_ns)


class Operator(Protocol):
    """Decides at the ground. It is asked on every tick."""

    @property
    def progress(self) -> OperatorEntry:
        """How far it has come, as of the last time it was asked, and what it waits for."""
        ...

    def act(self, situation: Situation) -> Sequence[Act]:
        """The orders to give now, in order; none to wait."""
        ...
