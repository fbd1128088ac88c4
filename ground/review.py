"""Path review: what a reviewer looks at before a path is agreed to."""

from collections.abc import Sequence

import msgspec

from farside.ground.config import AgeRule, AvoidsRule, CostRule, ProbabilityRule, Rule
from farside.messages import ProposedStep, Tokens
from farside.places import place_token


class PathReview(msgspec.Struct, frozen=True):
    """A path over what the ground knows.

    Attributes:
        goal: where it leads.
        action: its first action.
        path: its steps.
        age_s: how old what it was computed from is.
        cost_to_go: what it is expected to cost.
        probability: that it goes as planned; `None` where that is not known.
        in_step: whether the ground's model is in step with the rover's.
        conflicts: what the ground has learned or sent since it was computed.
        runner_up: the next best action.
        margin: by how much that costs more.
    """

    goal: Tokens
    action: str
    path: tuple[ProposedStep, ...]
    age_s: float
    cost_to_go: float
    probability: float | None = None
    in_step: bool = False
    conflicts: tuple[str, ...] = ()
    runner_up: str | None = None
    margin: float | None = None


def broken_rule(review: PathReview, rules: Sequence[Rule]) -> str | None:
    """The first rule that a path breaks, in words; `None` if it meets all of them."""
    return next((broken for rule in rules if (broken := _broken(review, rule))), None)


def _broken(review: PathReview, rule: Rule) -> str | None:
    match rule:
        case CostRule(below=below) if review.cost_to_go >= below:
            return f"its cost {review.cost_to_go:.1f} is not below {below:g}"
        case ProbabilityRule(above=above):
            if review.probability is None:
                return f"its probability is not known, and must be above {above:g}"
            if review.probability <= above:
                return f"its probability {review.probability:.2f} is not above {above:g}"
        case AvoidsRule(places=places):
            met = {token for step in review.path for token in (*step.sign, *review.goal)}
            for place in places:
                if place_token(place) in met:
                    return f"it leads to {place}"
        case AgeRule(below_s=below_s) if review.age_s >= below_s:
            return f"it is {review.age_s:.1f} s old, not less than {below_s:g} s"
        case _:
            pass
    return None
