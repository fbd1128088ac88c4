"""No nasty surprise: what must hold whatever the mission, the link and the operator do."""

from pathlib import Path
from typing import cast

import pytest
from hazards import Hazard, fly, hazards
from hypothesis import HealthCheck, given, settings

from farside.control import Chooser, CommandStage
from farside.messages import CommandReached, Proposal
from farside.missions import FinishedRun
from farside.missions.surprises import surprises
from farside.node import to_ns, to_s
from farside.topics import (
    GROUND_EVENT,
    ROVER_ACTION_STARTED,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ProposalEnded,
)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hazards")


@settings(
    max_examples=30,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(hazard=hazards())
def test_nothing_surprises_whoever_orders_what_over_whatever_link(
    logs: Path, hazard: Hazard
) -> None:
    run = fly(hazard, logs)
    try:
        assert list(surprises(run)) == []
        telemetry_tells_of_commands_as_they_are(run)
        every_stage_is_told(run)
        one_proposal_stands_at_a_time(run)
        nothing_explores_unless_the_mission_says_so(run, hazard)
    finally:
        run.log.unlink()


def telemetry_tells_of_commands_as_they_are(run: FinishedRun) -> None:
    """Done is when the work is done: never before, and never of one that waits."""
    ended = {entry.number: t_s for t_s, entry in run.command_stages if entry.stage.is_last}
    for _, telemetry in run.telemetry:
        made_s = to_s(telemetry.time_ns)
        for number in range(1, telemetry.commands_done + 1):
            assert ended[number] <= made_s
        for number in (*telemetry.waiting, *filter(None, [telemetry.begun])):
            assert ended.get(number, made_s + 1) > made_s


def every_stage_is_told(run: FinishedRun) -> None:
    """Once, with the time at which it was so, if the link lets it, and nothing else."""
    told = [
        (entry.event.time_ns, entry.event.what.number, entry.event.what.stage)
        for _, entry in run.entries(GROUND_EVENT)
        if isinstance(entry.event.what, CommandReached)
    ]
    stages = [
        (to_ns(t_s), entry.number, entry.stage)
        for t_s, entry in run.command_stages
        if entry.stage is not CommandStage.WAITING
    ]
    more = {(t_ns, number) for t_ns, number, stage in stages if stage is not CommandStage.TAKEN}
    expected = [one for one in stages if one[2] is not CommandStage.TAKEN or one[:2] not in more]
    # At one moment what was only taken is told last.
    expected.sort(key=lambda one: (one[0], one[2] is CommandStage.TAKEN))
    assert told == expected[: len(told)]


def one_proposal_stands_at_a_time(run: FinishedRun) -> None:
    standing: int | None = None
    for _, message in run.together(ROVER_PROPOSAL, ROVER_PROPOSAL_ENDED):
        number = cast("Proposal | ProposalEnded", message).number
        if type(message) is ROVER_PROPOSAL.kind:
            assert standing is None
            standing = number
        else:
            assert standing == number
            standing = None


def nothing_explores_unless_the_mission_says_so(run: FinishedRun, hazard: Hazard) -> None:
    if hazard.values["rover.dem.exploration"] == "none":
        choosers = {action.chooser for _, action in run.entries(ROVER_ACTION_STARTED)}
        assert Chooser.EXPLORATORY not in choosers
