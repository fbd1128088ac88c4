"""Every action and every change of mode has a cause that the log names."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hazards import Hazard, fly, hazards
from hypothesis import HealthCheck, Phase, given, settings

from farside.logs import LogFile
from farside.logs.spacetime import words
from farside.logs.story import Cause, Search, causes, outline
from farside.missions import Rehearsal
from farside.node import to_ns
from farside.topics import (
    GROUND_ORDER,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
)

DEEDS = (ROVER_ACTION_STARTED, ROVER_MODE, ROVER_FAILSAFE, ROVER_COMMAND, ROVER_GOAL)

FIRST = {GROUND_ORDER.name, LINK_OUTAGE.name, ROVER_BATTERY.name, LINK_FRAME.name, ""}
"""Where a chain may end: an order, an outage, the battery, a frame that was lost or says that the
ground is there, and what stands in the mission: a goal, a fault, a setting. And at the start."""


def unexplained(log: LogFile, every: int = 1) -> Iterator[str]:
    """The deeds of which no cause is found, or one that nothing can end with."""
    search = Search(log)
    for number, record in enumerate(log.records(DEEDS)):
        if number % every or record.log_time_ns == 0:
            continue
        chain = causes(search, record)
        if not any(cause.is_first for cause in chain):
            yield f"{record}: nothing led to it"
        for cause in chain:
            if cause.is_first and cause.t_ns > 0 and cause.topic not in FIRST:
                yield f"{record}: {cause}"


def test_everything_in_a_blackout_has_a_cause(flown: LogFile) -> None:
    assert list(unexplained(flown, every=4)) == []


@pytest.mark.parametrize(("name", "until_s"), [("shadow", 210.0), ("tether", 240.0)])
def test_everything_in_a_shipped_mission_has_a_cause(
    name: str, until_s: float, tmp_path: Path
) -> None:
    """In `shadow` the rover drives out of reach of the link; in `tether` a sensor fails it."""
    mission = Rehearsal(name, tmp_path, {"duration_s": until_s})
    assert list(unexplained(LogFile(Path(mission.run().result.log)), every=4)) == []


@settings(
    max_examples=3,
    database=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(hazards())
def test_whatever_the_operator_and_the_link_do_everything_has_a_cause(hazard: Hazard) -> None:
    run = fly(hazard)
    assert list(unexplained(LogFile(Path(run.result.log)), every=2)) == []


# --- what the chains say ----------------------------------------------------------------------


def chain_of(log: LogFile, topic: str, t_s: float, text: str = "") -> tuple[Cause, ...]:
    """The causes of the record of this topic and time that has these words in it."""
    (record,) = (
        one
        for one in log.records(start_ns=to_ns(t_s), end_ns=to_ns(t_s))
        if one.topic == topic and text in one.payload.decode()
    )
    return causes(log, record)


def sentences(chain: tuple[Cause, ...]) -> list[str]:
    return [cause.sentence for cause in chain]


def test_an_action_with_consent_goes_back_to_the_order_for_the_goal(flown: LogFile) -> None:
    """From the move over the approval and the proposal, across the link twice, to the goal."""
    chain = chain_of(flown, ROVER_ACTION_STARTED.name, 605.4)
    told = sentences(chain)
    assert told[:3] == [
        "decides on E, goal-directed, towards at:B, by command 91",
        "command 91 (approve proposal 12) begins",
        "command 91 (approve proposal 12) arrives on board",
    ]
    assert told[3].startswith("frame up:1049 with command 91 arrives after 2.00 s")
    assert told[4:7] == [
        "command 91 is given: approve proposal 12",
        "the operator orders: approve proposal 12",
        "the ground receives proposal 12 (E)",
    ]
    firsts = [cause.sentence for cause in chain if cause.is_first]
    assert firsts == [
        "the operator orders: goal at:B, priority 2",
        "the operator orders: mode shared",
    ]


def test_an_action_of_its_own_has_a_goal_and_the_loss_of_the_link_behind_it(
    flown: LogFile,
) -> None:
    chain = chain_of(flown, ROVER_ACTION_STARTED.name, 650)
    assert [cause.sentence for cause in chain if cause.is_first] == [
        "the operator orders: goal at:B, priority 2",
        "uplink: blackout begins",
    ]
    modes = [cause for cause in chain if cause.topic == ROVER_MODE.name]
    assert [(cause.depth, cause.sentence) for cause in modes] == [(2, "mode autonomous: link lost")]


def test_a_mission_goal_comes_on_the_list_by_the_mission_and_the_failsafe(
    flown: LogFile,
) -> None:
    chain = chain_of(flown, ROVER_GOAL.name, 650)
    assert sentences(chain) == [
        "the mission gives the rover the goal at:C",
        "failsafe alone: the link is lost, after 30.0 s of silence",
        "failsafe hold: nothing is heard, after 10.0 s of silence",
        "uplink: blackout begins",
        "mode autonomous: link lost",
    ]


def test_the_failsafe_tells_only_what_its_reason_speaks_of(flown: LogFile) -> None:
    """That the rover is unconfirmed changed as well, and is not why it holds."""
    chain = chain_of(flown, ROVER_FAILSAFE.name, 763.48)
    assert [cause.sentence for cause in chain if cause.depth == 1] == ["goal at:C reached"]


def test_a_chain_is_indented_only_where_it_branches(flown: LogFile) -> None:
    chain = chain_of(flown, ROVER_ACTION_STARTED.name, 650)
    indents = [indent for indent, _ in outline(chain)]
    assert indents[:2] == [0, 1]
    assert set(indents[1:]) == {1}
    assert max(cause.depth for cause in chain) > 4


def test_a_command_that_arrived_at_the_second_attempt_names_the_loss_of_the_first(
    flown: LogFile,
) -> None:
    """The frame that brought it, and then the one that was lost."""
    number = next(
        word.carries.number
        for word in words(flown)
        if word.carries is not None and word.carries.kind == "command" and word.carries.attempt == 2
    )
    taken = f'"number":{number},"stage":"taken"'
    record = next(one for one in flown.records([ROVER_COMMAND]) if taken in one.payload.decode())
    brought, lost = (one for one in causes(flown, record) if one.depth == 1)
    assert f"with command {number}, sent 2 × arrives after" in brought.sentence
    assert f"with command {number} was lost on the way" in lost.sentence
