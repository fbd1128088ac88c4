"""The rules by which an automatic reviewer agrees to a path."""

from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from farside.ground.config import (
    AgeRule,
    AvoidsRule,
    ChanceRule,
    ConflictRule,
    CostRule,
    ProbabilityRule,
    Rule,
)
from farside.ground.rules import broken_rule
from farside.messages import ProposedStep
from farside.topics import PathReview

PATH = (ProposedStep(("at:1",), "E", 3.0), ProposedStep(("at:2",), "E", 1.5))
REVIEW = PathReview(("at:3",), "E", PATH, age_s=4.0, cost_to_go=3.0, probability=0.3, chance=0.8)


def test_without_rules_every_path_is_agreed_to() -> None:
    assert broken_rule(REVIEW, ()) is None


@pytest.mark.parametrize(
    ("rule", "broken"),
    [
        (CostRule(below=3.0), "its cost 3.0 is not below 3"),
        (CostRule(below=3.1), None),
        (ProbabilityRule(above=0.3), "its probability 0.30 is not above 0.3"),
        (ProbabilityRule(above=0.2), None),
        (ChanceRule(above=0.8), "its chance 0.80 is not above 0.8"),
        (ChanceRule(above=0.7), None),
        (AvoidsRule(places=("7", "2")), "it leads to 2"),
        (AvoidsRule(places=("3",)), "it leads to 3"),
        (AvoidsRule(places=("7",)), None),
        (AgeRule(below_s=4.0), "it is 4.0 s old, not less than 4 s"),
        (AgeRule(below_s=5.0), None),
        (ConflictRule(), None),
    ],
)
def test_a_path_meets_a_rule_or_is_told_why_not(rule: Rule, broken: str | None) -> None:
    assert broken_rule(REVIEW, [rule]) == broken


def test_a_rover_that_stands_where_it_must_not_go_may_leave() -> None:
    assert broken_rule(REVIEW, [AvoidsRule(places=("1",))]) is None


def test_what_is_not_known_meets_no_rule_about_it() -> None:
    unknown = replace(REVIEW, probability=None, chance=None)

    assert "not known" in broken_rule(unknown, [ProbabilityRule(above=0.1)])
    assert "not known" in broken_rule(unknown, [ChanceRule(above=0.1)])


def test_what_was_learned_since_breaks_the_rule_against_conflicts() -> None:
    late = replace(REVIEW, conflicts=("proposal 5 has come since",))

    assert broken_rule(late, [ConflictRule()]) == "proposal 5 has come since"


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_first_rule_that_is_broken_is_told(order: Sequence[int]) -> None:
    rules: list[Rule] = [CostRule(below=1.0), AgeRule(below_s=1.0)]
    told = ("its cost 3.0 is not below 1", "it is 4.0 s old, not less than 1 s")

    assert broken_rule(REVIEW, [rules[n] for n in order]) == told[order[0]]
