"""The rules by which an automatic reviewer agrees to a path."""

from collections.abc import Sequence

from farside.ground.config import (
    AgeRule,
    AvoidsRule,
    ChanceRule,
    ConflictRule,
    CostRule,
    ProbabilityRule,
    Rule,
)
from farside.places import place_token
from farside.topics import PathReview


def broken_rule(review: PathReview, rules: Sequence[Rule]) -> str | None:
    """The first rule that a path breaks, in words; `None` if it meets all of them."""
    return next((broken for rule in rules if (broken := _broken(review, rule))), None)


def _broken(review: PathReview, rule: Rule) -> str | None:
    broken: str | None = None
    match rule:
        case CostRule(below=below) if review.cost_to_go >= below:
            broken = f"its cost {review.cost_to_go:.1f} is not below {below:g}"
        case ProbabilityRule(above=above):
            broken = _too_low("probability", review.probability, above)
        case ChanceRule(above=above):
            broken = _too_low("chance", review.chance, above)
        case AvoidsRule(places=places):
            # Not where it begins: from there it leads away.
            met = {token for step in review.path[1:] for token in step.sign} | {*review.goal}
            found = [place for place in places if place_token(place) in met]
            broken = f"it leads to {found[0]}" if found else None
        case AgeRule(below_s=below_s) if review.age_s >= below_s:
            broken = f"it is {review.age_s:.1f} s old, not less than {below_s:g} s"
        case ConflictRule() if review.conflicts:
            broken = review.conflicts[0]
    return broken


def _too_low(what: str, value: float | None, above: float) -> str | None:
    if value is None:
        return f"its {what} is not known, and must be above {above:g}"
    return None if value > above else f"its {what} {value:.2f} is not above {above:g}"
