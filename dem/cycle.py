"""What a model reports of a cycle: what it sensed and learned, and what it would do."""

import msgspec

from farside.dem.lists.goals import Goal
from farside.dem.lists.hypothesis import Hypothesis
from farside.dem.lists.signs import Sign


class Sensed(msgspec.Struct, frozen=True):
    """What was sensed and learned in a cycle. Signs are in order of age, oldest first.

    Attributes:
        tokens: what was sensed, sorted.
        active: the active Signs S*.
        novel: the active Signs that were never active before.
        unexpected: the other active Signs that no credible prediction due now named; see
            `farside.dem.learning.credit`.
        succeeded, failed: number of due predictions that came true, or did not.
        created, removed: number of hypotheses created, or removed as ineffective.
        reached: goals satisfied and removed, highest first; also those that were satisfied as they
            were set, since the last cycle was sensed.
        suspended: goals put aside since the last cycle was sensed, or for another reason than then,
            highest first; see `farside.dem.Aside`.
        recovered: goals that were aside when the last cycle was sensed and are no longer, highest
            first. Goals that were reached or withdrawn are not among them.
    """

    tokens: Sign
    active: tuple[Sign, ...]
    novel: tuple[Sign, ...]
    unexpected: tuple[Sign, ...]
    succeeded: int
    failed: int
    created: int
    removed: int
    reached: tuple[Goal, ...]
    suspended: tuple[Goal, ...]
    recovered: tuple[Sign, ...]


class Prediction(msgspec.Struct, frozen=True):
    """An open prediction: a member of P, and of P* while it is due.

    Attributes:
        outcome: the Sign that is predicted.
        due_in: cycles until it is settled, 1 for the next `sense`.
        hypothesis: whose prediction it is.
    """

    outcome: Sign
    due_in: int
    hypothesis: Hypothesis


class Trace(msgspec.Struct, frozen=True):
    """The activation trace of a past cycle: what hypotheses can be made of.

    Attributes:
        active: the Signs that were active, oldest first.
        action: the action performed then, `None` for none.
    """

    active: tuple[Sign, ...]
    action: str | None


class Choice(msgspec.Struct, frozen=True):
    """The action that the model would take, and why.

    Attributes:
        action: its name.
        goal: the Sign of the goal pursued, `None` where the choice is exploratory.
        sign: the active Sign to act from, `None` where the choice is random.
        cost_to_go: policy value P_v of `sign`, `None` where the choice is random.
    """

    action: str
    goal: Sign | None = None
    sign: Sign | None = None
    cost_to_go: float | None = None
