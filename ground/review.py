"""Reviewing a path at the ground: how old, how dear, how sure, and what has changed since."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from farside.dem import ShadowModel
from farside.ground.belief import Belief
from farside.ground.foresight import Foresight, chance, expectations
from farside.ground.prediction import OnItsWay
from farside.messages import (
    Drive,
    Proposal,
    ProposedStep,
    SetGoal,
    SetMode,
    Tokens,
    WithdrawGoal,
)
from farside.node import to_s
from farside.places import is_place_token
from farside.topics import PathReview


class Lists(NamedTuple):
    """The shadow's lists, for reviewing.

    Attributes:
        model: the lists.
        foresight: what they say of moves.
        check: their hash.
    """

    model: ShadowModel
    foresight: Foresight
    check: int


def review_proposal(
    proposal: Proposal,
    belief: Belief,
    coming: Sequence[OnItsWay],
    lists: Lists | None,
    now_ns: int,
) -> PathReview:
    """What the ground finds of a proposal.

    Args:
        proposal: the proposal.
        belief: what the ground knows.
        coming: the commands not known to be over, in order.
        lists: the shadow's; `None` without a shadow.
        now_ns: the present.
    """
    path, conflicts = proposal.path, tuple(_conflicts(proposal, belief, coming, lists))
    review = PathReview(
        goal=proposal.goal,
        action=proposal.action,
        path=path,
        age_s=to_s(now_ns - proposal.time_ns),
        cost_to_go=path[0].cost_to_go if path else 0.0,
        conflicts=conflicts,
        proposal=proposal.number,
    )
    if lists is None or not path:
        return review
    return _judged(review, lists, in_step=proposal.model_check == lists.check)


def review_path(
    goal: Tokens, start: str, lists: Lists, made_ns: int, now_ns: int
) -> PathReview | None:
    """What the ground finds of the way to a goal that the shadow's lists know.

    Args:
        goal: the goal.
        start: the Token of the place to start from.
        lists: the shadow's.
        made_ns: when the lists were so on board.
        now_ns: the present.

    Returns:
        the review; `None` where no way is known.
    """
    steps = lists.model.policy_path((start,), goal)
    if not steps:
        return None
    path = tuple(ProposedStep(step.sign, step.action, step.cost_to_go) for step in steps)
    age_s = to_s(now_ns - made_ns)
    review = PathReview(goal, path[0].action, path, age_s, path[0].cost_to_go)
    return _judged(review, lists, in_step=True)


def _judged(review: PathReview, lists: Lists, *, in_step: bool) -> PathReview:
    """The review with what the shadow's lists say of its path."""
    signs = [*(step.sign for step in review.path), review.goal]
    steps = [
        (step.sign, step.action, onward)
        for step, (_, onward) in zip(review.path, pairwise(signs), strict=True)
    ]
    probability: float | None = 1.0
    for sign, action, onward in steps:
        cm = max(
            (
                one.cm
                for one in expectations(lists.model, sign, action)
                if set(onward).issubset(one.outcome)
            ),
            default=None,
        )
        probability = None if cm is None or probability is None else probability * cm
    why = lists.model.why(review.path[0].sign, review.goal)
    rival = None if why is None else why.runner_up
    places = [(sign[0], action, onward[0]) for sign, action, onward in steps]
    is_over_places = all(is_place_token(place) for step in places for place in step[::2])
    return PathReview(
        goal=review.goal,
        action=review.action,
        path=review.path,
        age_s=review.age_s,
        cost_to_go=review.cost_to_go,
        probability=probability,
        chance=chance(lists.foresight, places) if is_over_places else None,
        in_step=in_step,
        conflicts=review.conflicts,
        runner_up=None if rival is None else rival.action,
        margin=None if rival is None or why is None else why.margin,
        proposal=review.proposal,
    )


def _conflicts(
    proposal: Proposal, belief: Belief, coming: Sequence[OnItsWay], lists: Lists | None
) -> Iterator[str]:
    """What the ground has learned or sent since a proposal was made, against it."""
    newest = belief.proposal
    if newest is not None and newest.number > proposal.number:
        yield f"proposal {newest.number} has come since"
    yield from _learned(proposal, belief)
    for one in coming:
        order = one.command.order
        if one.command.number > proposal.last_command and isinstance(
            order, Drive | SetMode | SetGoal | WithdrawGoal
        ):
            yield f"command {one.command.number} was sent, which it did not count on"
    if lists is not None and proposal.model_check not in {None, lists.check} and proposal.path:
        why = lists.model.why(proposal.path[0].sign, proposal.goal)
        if why is not None and why.action != proposal.action:
            yield f"by what the model knows now, {why.action} is the better action"


def _learned(proposal: Proposal, belief: Belief) -> Iterator[str]:
    telemetry = belief.telemetry
    if telemetry is None or telemetry.time_ns <= proposal.time_ns:
        return
    if telemetry.proposal != proposal.number:
        yield "it does not stand any more"
    here = set(telemetry.tokens)
    if proposal.path and not here.issuperset(proposal.path[0].sign):
        yield "the rover is elsewhere by now"
    if proposal.goal not in telemetry.goals:
        yield "its goal is not on the list any more"
