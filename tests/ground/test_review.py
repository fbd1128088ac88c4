"""What the ground finds of a path: its age, cost and probability, and what has changed since."""

import math
from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from farside.control import Mode
from farside.ground.foresight import Foresight
from farside.ground.prediction import OnItsWay
from farside.ground.review import Lists, review_path, review_proposal
from farside.messages import (
    Approve,
    Command,
    Drive,
    Order,
    Proposal,
    ProposedStep,
    SetGoal,
    Telemetry,
)
from farside.node import to_ns
from farside.topics import PathReview
from tests.ground.conftest import make_belief, taught, telemetry

MODEL = taught()
LISTS = Lists(MODEL, Foresight(MODEL, lambda: 0), check=7)
PATH = (ProposedStep(("at:1",), "E", 3.0), ProposedStep(("at:2",), "E", 1.5))
OFFER = Proposal(4, to_ns(10.0), ("at:3",), "E", PATH, model_check=7, last_command=8)
STANDS = {"mode": Mode.SHARED, "goals": (("at:3",),), "proposal": 4}


def review(
    offer: Proposal = OFFER,
    *,
    known: Telemetry | None = None,
    newer: Proposal | None = None,
    coming: Sequence[OnItsWay] = (),
    lists: Lists | None = LISTS,
    now_s: float = 12.0,
) -> PathReview:
    belief = make_belief()
    belief.learn(known or telemetry(10.5, "1", **STANDS), to_ns(11.5))
    belief.consider(offer)
    if newer is not None:
        belief.consider(newer)
    return review_proposal(offer, belief, coming, lists, to_ns(now_s))


def sent(order: Order, number: int = 9) -> OnItsWay:
    return OnItsWay(Command(number, 10**18, order), None, to_ns(12.0))


def test_a_review_says_how_old_how_dear_and_how_sure_the_path_is() -> None:
    found = review(now_s=12.5)
    cms = [max(one.cm for one in MODEL.expectations((place,), "E")) for place in ("at:1", "at:2")]

    assert (found.age_s, found.cost_to_go, found.goal) == (2.5, 3.0, ("at:3",))
    assert found.probability == pytest.approx(math.prod(cms))
    assert 0 < found.chance < 1
    assert found.in_step
    assert found.conflicts == ()


def test_the_runner_up_is_the_best_other_action() -> None:
    found = review(
        replace(OFFER, goal=("at:0",), action="W", path=(ProposedStep(("at:1",), "W", 1.0),))
    )

    assert (found.runner_up, found.margin > 0) == ("E", True)


def test_without_a_shadow_there_is_no_probability() -> None:
    found = review(lists=None)

    assert (found.probability, found.chance, found.in_step) == (None, None, False)
    assert found.cost_to_go == 3.0


def test_a_path_that_the_lists_do_not_know_has_no_probability() -> None:
    unknown = replace(OFFER, path=(ProposedStep(("at:1",), "N", 3.0), *PATH[1:]))

    assert review(unknown).probability is None
    assert review(unknown).chance == 0.0


def test_an_action_that_there_is_not_has_no_probability() -> None:
    strange = replace(OFFER, action="jump", path=(ProposedStep(("at:1",), "jump", 3.0), *PATH[1:]))

    assert review(strange).probability is None


def test_a_path_from_other_lists_than_the_shadows_is_out_of_step() -> None:
    assert not review(replace(OFFER, model_check=8)).in_step


@pytest.mark.parametrize(
    ("known", "conflict"),
    [
        (telemetry(11.0, "1", **{**STANDS, "proposal": 5}), "does not stand any more"),
        (telemetry(11.0, "2", **STANDS), "elsewhere"),
        (telemetry(11.0, "1", **{**STANDS, "goals": ()}), "goal is not on the list"),
    ],
)
def test_what_was_learned_since_against_it_is_a_conflict(known: Telemetry, conflict: str) -> None:
    assert any(conflict in text for text in review(known=known).conflicts)


def test_what_was_known_before_it_was_made_is_none() -> None:
    before = telemetry(9.0, "0", mode=Mode.SHARED)

    assert review(known=before).conflicts == ()


def test_a_newer_proposal_is_a_conflict() -> None:
    assert review(newer=replace(OFFER, number=5)).conflicts == ("proposal 5 has come since",)


def test_what_was_sent_since_is_a_conflict_but_not_the_answer_itself() -> None:
    for order in (Drive("N"), SetGoal(("at:0",), 1.0)):
        (text,) = review(coming=[sent(order)]).conflicts
        assert text == "command 9 was sent, which it did not count on"
        assert review(coming=[sent(order, number=8)]).conflicts == ()
    assert review(coming=[sent(Approve(4))]).conflicts == ()


def test_that_the_model_knows_a_better_action_now_is_a_conflict() -> None:
    detour = (ProposedStep(("at:1",), "W", 9.0), ProposedStep(("at:0",), "E", 8.0), *PATH)
    found = review(replace(OFFER, action="W", path=detour, model_check=1))

    assert found.conflicts == ("by what the model knows now, E is the better action",)


def test_the_shadow_knows_ways_that_nobody_proposed() -> None:
    found = review_path(("at:0",), "at:2", LISTS, to_ns(5.0), to_ns(9.0))

    assert [step.action for step in found.path] == ["W", "W"]
    assert (found.age_s, found.in_step, found.proposal) == (4.0, True, None)
    assert 0 < found.probability < 1
    assert review_path(("at:moon",), "at:2", LISTS, 0, 0) is None
