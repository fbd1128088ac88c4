"""The failsafe's table: which state follows from what is so, and why.

The table is all there is of it: the program looks up the state in it, `docs/failsafe.html` draws it
and lets a reader toggle the causes. The state is a function of the present causes alone. Nothing is
remembered here, so no order of events can lead to a state that its causes do not justify.

What the rover begins of its own, the column `acts` says. What becomes of the operator's orders is a
shorter table, `ORDERS`.
"""

from collections.abc import Set as AbstractSet
from enum import StrEnum
from typing import NamedTuple

from farside.control import Cause, Failsafe


class Rule(NamedTuple):
    """A row of the table.

    Attributes:
        state: the state.
        when: the causes that must all be so.
        unless: the causes of which none may be so.
        acts: whether the rover may begin anything of its own: in state nominal as its mode says,
            in state alone whatever its mode was before.
        why: the reason, in words.
    """

    state: Failsafe
    when: frozenset[Cause]
    unless: frozenset[Cause]
    acts: bool
    why: str


def _rule(
    state: Failsafe, why: str, *when: Cause, unless: tuple[Cause, ...] = (), acts: bool = False
) -> Rule:
    return Rule(state, frozenset(when), frozenset(unless), acts, why)


TABLE: tuple[Rule, ...] = (
    # What is wrong with the rover itself comes first: it cannot do what it would decide.
    _rule(Failsafe.SAFE, "the rover tilts too much", Cause.TILT),
    _rule(Failsafe.SAFE, "the rover does not know where it is", Cause.SENSOR_DEAD),
    _rule(Failsafe.SAFE, "the rover is stuck", Cause.STUCK),
    # The link is lost.
    _rule(
        Failsafe.HOLD,
        "the link is lost, and autonomy is forbidden then",
        Cause.LOST,
        Cause.FORBIDDEN,
    ),
    _rule(
        Failsafe.ALONE,
        "the link is lost, and the charge just suffices for the way to the dock",
        Cause.LOST,
        Cause.RESERVE,
        unless=(Cause.EXHAUSTED,),
        acts=True,
    ),
    _rule(
        Failsafe.ALONE,
        "the link is lost, and terrain hides the other end",
        Cause.LOST,
        Cause.NO_SIGNAL,
        unless=(Cause.EXHAUSTED,),
        acts=True,
    ),
    _rule(
        Failsafe.ALONE,
        "the link is lost",
        Cause.LOST,
        unless=(Cause.EXHAUSTED,),
        acts=True,
    ),
    _rule(Failsafe.HOLD, "the link is lost, and no goal is left", Cause.LOST),
    # It is not lost yet, or it is back.
    _rule(Failsafe.HOLD, "nothing is heard", Cause.SILENCE),
    _rule(
        Failsafe.HOLD,
        "the link is back, and the operator has not yet said who drives",
        Cause.UNCONFIRMED,
    ),
    # Nothing is wrong.
    _rule(
        Failsafe.NOMINAL,
        "the charge just suffices for the way to the dock",
        Cause.RESERVE,
        acts=True,
    ),
    _rule(
        Failsafe.NOMINAL,
        "nothing is heard, as planned",
        Cause.EXPECTED_SILENCE,
        acts=True,
    ),
    _rule(Failsafe.NOMINAL, "the link is up", acts=True),
)
"""The rules in order: the first that applies counts. The last one always applies."""


class OrdersThen(StrEnum):
    """What becomes of orders: begun; only begun if forced; not begun yet; ended without it."""

    BEGIN = "begun as soon as the rover stands still"
    INSIST = "refused, unless the operator insists"
    WAIT = "kept waiting, since what was ordered before the silence may be wrong by now"
    DROP = "dropped, and the operator told so"


ORDERS: tuple[tuple[Cause | None, OrdersThen], ...] = (
    (Cause.LOST, OrdersThen.DROP),
    (Cause.SILENCE, OrdersThen.WAIT),
    (Cause.TILT, OrdersThen.INSIST),
    (Cause.SENSOR_DEAD, OrdersThen.INSIST),
    # A rover that is stuck may be driven, since that may free it.
    (None, OrdersThen.BEGIN),
)
"""What becomes of the operator's orders: the first whose cause is so, or has none, counts."""


def rule_for(causes: AbstractSet[Cause]) -> Rule:
    """The rule that applies when exactly `causes` are so."""
    return next(rule for rule in TABLE if rule.when <= causes and not rule.unless & causes)


def orders_for(causes: AbstractSet[Cause]) -> OrdersThen:
    """What becomes of the operator's orders when exactly `causes` are so."""
    return next(then for cause, then in ORDERS if cause is None or cause in causes)
