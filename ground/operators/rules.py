"""The rules of an automatic reviewer."""

from collections.abc import Sequence

from farside.ground.config import AgeRule, AvoidsRule, CostRule, ProbabilityRule, Rule
from farside.places import place_token
from farside.topics import PathReview


def broken_rule(review: PathReview, rules: Sequence[Rule]) -> str | None:
    """The first rule that a path breaks, in words; `None` if it meets all of them."""
    return next((broken for rule in rules if (broken := _broken(review, rule))), None)


def _broken(review: PathReview, rule: Rule) -> str | None:
    match rule:
        case CostRule(below=below) if review.cost_to_go >= below:
            return f"its cost of {review.cost_to_go:.1f} is not below {below:g}"
        case ProbabilityRule(above=above) if review.probability is None:
            return f"its probability is not known, and should be above {above:g}"
        case ProbabilityRule(above=above) if review.probability is not None:
            if review.probability <= above:
                return f"its probability of {review.probability:.2f} is not above {above:g}"
        case AvoidsRule(places=places):
            onward = {token for step in review.path[1:] for token in step.sign}
            for place in places:
                if place_token(place) in onward | {*review.goal}:
                    return f"it leads by {place}"
        case AgeRule(below_s=below_s) if review.age_s >= below_s:
            return f"it is {review.age_s:.1f} s old, and should be younger than {below_s:g} s"
        case _:
            pass
    return None
