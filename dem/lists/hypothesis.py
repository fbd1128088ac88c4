"""One hypothesis of the list: what it says, and what of it concerns the policy map."""

from typing import NamedTuple

import msgspec

from farside.dem.lists.signs import Sign


class Hypothesis(msgspec.Struct, frozen=True):
    """A µ-hypothesis: context ∧ action → outcome after `delay` cycles.

    Attributes:
        context, outcome: Signs.
        action: name of the Action.
        delay: cycles from context and action to outcome, 1 or more.
        cm: corroboration measure C_m, 0 to 1.
        credit: the same measure without the successes that a better hypothesis predicted too,
            0 to 1; see `farside.dem.learning.credit`.
        predictions: number of its predictions that have fallen due.
        successes: number of these that came true.
    """

    context: Sign
    action: str
    outcome: Sign
    delay: int
    cm: float
    credit: float
    predictions: int
    successes: int


class CostChange(NamedTuple):
    """A hypothesis was created or removed, or its cost estimate changed.

    Attributes:
        hypothesis: its id, which may have been reused since.
        context, outcome: its Signs.
        old_cost: the cost estimate C_e before; infinite if the hypothesis was created.
    """

    hypothesis: int
    context: int
    outcome: int
    old_cost: float


class HypothesesState(msgspec.Struct, frozen=True, array_like=True):
    """A Hypothesis List as it is saved: `packed` columns, and what does not follow from them."""

    columns: tuple[bytes, ...]
    free: tuple[int, ...]
    cm_sum: float
