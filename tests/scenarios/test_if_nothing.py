"""What the ground says will happen if its operator does nothing is what happens then."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import pytest

from farside.acts import Act, Planned
from farside.control import Mode
from farside.ground.node import Ground
from farside.ground.view.view import Focus
from farside.messages import Drive, SetGoal, SetMode, TakeBack
from farside.missions import load_mission
from farside.missions.build import build_node
from farside.missions.crew.crew import InProcessCrew
from farside.node import NS_PER_S, Role, to_ns
from farside.topics import ROVER_ACTION_STARTED, ActionStarted

AFTER_S = 30.0
"""How long nothing is done: less than a link that fails would take to be lost."""

LESSONS = "NEEWWS" * 2  # from the dock to the goal and back
GOAL = ("at:7,4",)


class Then(NamedTuple):
    """What was said, and what the rover began of its own, and for a command, from then on."""

    said: str
    own: list[str]
    ordered: list[str]
    first_own_s: float


def left_alone(acts: Sequence[Act], consent: str, settle_s: float) -> Then:
    """Drive out and home again, give these acts, and do nothing from `settle_s` later on."""
    changes = {
        "ground.operator": "queued",
        "ground.script": [],
        "expect": [],
        "rover.consent.by": consent,
        "duration_s": 300.0,
    }
    mission = load_mission("blackout", changes).mission
    rover, link, ground = (build_node(role, mission) for role in Role)
    assert isinstance(ground, Ground)
    crew = InProcessCrew(rover, link, ground)
    lessons = [Planned(Drive(action), follows=True) for action in LESSONS]
    crew.advance(to_ns(1), lessons)
    now_ns = to_ns(1)

    def advance(seconds: float, given: Sequence[Act] = ()) -> list[tuple[int, ActionStarted]]:
        nonlocal now_ns
        begun, end_ns = [], now_ns + to_ns(seconds)
        while now_ns < end_ns:
            now_ns += NS_PER_S
            for record in crew.advance(now_ns, given):
                if record.topic == ROVER_ACTION_STARTED.name:
                    message = msgspec.json.decode(record.payload, type=ActionStarted)
                    begun.append((record.log_time_ns, message))
            given = ()
        return begun

    advance(80.0)
    assert ground.look(Focus()).if_nothing == "the rover stands and waits for your orders"
    advance(settle_s, acts)
    said, said_ns = ground.look(Focus()).if_nothing, now_ns
    begun = advance(AFTER_S)
    assert crew.lost_processes == ()
    own = [(at_ns, one.action) for at_ns, one in begun if one.command is None]
    ordered = [one.action for _, one in begun if one.command is not None]
    first_s = (own[0][0] - said_ns) / NS_PER_S if own else 0.0
    return Then(said, [action for _, action in own], ordered, first_s)


SHARED = Planned(SetMode(Mode.SHARED))
ALONE = Planned(SetMode(Mode.AUTONOMOUS))
WANTED = Planned(SetGoal(GOAL, 2.0))


@pytest.mark.parametrize(
    ("acts", "consent", "settle_s", "said", "begun"),
    [
        ([Drive("N")], "approval", 1, "carries out command 13 (N), then stands", (0, ["N"])),
        ([SHARED], "approval", 8, "stands: it has no goal", (0, [])),
        ([SHARED, WANTED], "approval", 8, "stands and waits for your word", (0, [])),
        ([SHARED, WANTED], "veto", 8, "goes N in ", (2, [])),
        ([ALONE], "approval", 8, "stands: it has no goal", (0, [])),
        (
            [ALONE, WANTED],
            "approval",
            1,
            "carries out commands 13 and 14, then goes on to",
            (3, []),
        ),
        ([WANTED], "veto", 8, "stands and waits for your orders", (0, [])),
    ],
)
def test_what_is_said_is_what_happens(
    acts: Sequence[Act], consent: str, settle_s: float, said: str, begun: tuple[int, list[str]]
) -> None:
    then, (own, ordered) = left_alone(acts, consent, settle_s), begun
    assert then.said.startswith(f"the rover {said}")
    assert then.ordered == ordered
    assert len(then.own) >= own if own else then.own == []
    if said.startswith("goes N in "):
        assert then.own[0] == "N"
        earliest_s = float(then.said.removeprefix("the rover goes N in ").split(" s ")[0])
        assert earliest_s <= then.first_own_s < earliest_s + 5


def test_of_more_moves_than_there_is_time_for_it_is_said_which_expire() -> None:
    then = left_alone([Drive(action) for action in "NS" * 12], "veto", 3.0)

    found = re.match(
        r"the rover carries out (\d+) commands, .* then lets (\d+) commands", then.said
    )
    assert found, then.said
    moved, expired = int(found[1]), int(found[2])
    assert moved + expired >= 22
    assert abs(len(then.ordered) - moved) <= 1, (
        "a move may take a little more or less than expected"
    )


def test_a_move_that_is_being_taken_back_is_said_to_be_in_doubt() -> None:
    acts = [Drive("N"), Drive("S"), Drive("N")]
    taken_back = len(LESSONS) + 3
    then = left_alone([*acts, TakeBack(taken_back)], "veto", 1.0)

    assert f"{taken_back} (N; unless {taken_back + 1} takes it back in time)" in then.said
    assert len(then.ordered) == 2
