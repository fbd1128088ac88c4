"""Why the rover did what it did: every action has a decision in the log, with what is behind it."""

from collections.abc import Callable

import pytest

from farside.control import Chooser
from farside.missions import Rehearsal
from farside.topics import (
    ROVER_ACTION_STARTED,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_PROPOSAL,
    ActionStarted,
    Decision,
)


def test_every_action_was_decided_right_before_it_began(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    last: Decision | None = None
    actions = 0
    for _, message in run.together(ROVER_DECISION, ROVER_ACTION_STARTED):
        if isinstance(message, Decision):
            last = message
        elif isinstance(message, ActionStarted):
            actions += 1
            decided = last.chooser, last.action, last.goal, last.command
            assert decided == (message.chooser, message.action, message.goal, message.command)
    assert actions > 100


def test_a_choice_of_the_map_says_what_is_behind_it_and_what_came_second(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    active: set[tuple[str, ...]] = set()
    found = 0
    for _, message in run.together(ROVER_CYCLE, ROVER_DECISION):
        if not isinstance(message, Decision):
            active = {(token,) for token in message.tokens}  # type: ignore[attr-defined]
            continue
        assert active <= set(message.active)
        if message.chooser is not Chooser.GOAL_DIRECTED:
            continue
        found += 1
        assert message.behind.action == message.action
        assert message.behind.context in message.active
        assert message.behind.cost_to_go > 0
        if message.runner_up is not None:
            assert message.runner_up.action != message.action
            gap = message.runner_up.cost_to_go - message.behind.cost_to_go
            assert message.margin == pytest.approx(gap)
            assert message.margin >= 0
    assert found > 20


def test_a_proposal_is_a_decision_put_before_the_operator(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    proposed = [d for _, d in run.entries(ROVER_DECISION) if d.proposal is not None]
    made = [proposal for _, proposal in run.entries(ROVER_PROPOSAL)]
    assert [(d.proposal, d.action, d.goal) for d in proposed] == [
        (one.number, one.action, one.goal) for one in made
    ]


def test_of_an_operators_move_it_says_what_the_model_expected_of_it(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    guided = [d for _, d in run.entries(ROVER_DECISION) if d.chooser is Chooser.GUIDED]
    assert guided[0].behind is None, "it knew nothing yet"
    assert any(d.behind and d.behind.cm > 0.5 and d.behind.cost_to_go is None for d in guided)
