"""From a mission file to a mission that an agent can be seated in."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from farside.ground.config import QUEUED as QUEUED_OPERATOR
from farside.missions.loading import LoadedMission, load_mission
from farside.missions.schema import MissionFile, ReachedExpected
from farside.rover.config import QUEUED as QUEUED_CONTROLLER
from farside.validation import did_you_mean, shown

ROVER, GROUND = "rover", "ground"
"""The seats: on board, in the controller's place, or at the ground, in the operator's."""


class Prepared(NamedTuple):
    """A mission with an agent's seat in it.

    Attributes:
        loaded: the mission, with nobody but the agent to decide.
        goals: the places to be reached, by name.
    """

    loaded: LoadedMission
    goals: tuple[str, ...]


def prepare(
    mission: str | Path,
    seat: str,
    goals: Sequence[str] | None,
    overrides: Mapping[str, object],
) -> Prepared:
    """Load a mission, and take out whoever would decide in the agent's place.

    Args:
        mission: see `farside.missions.load_mission`.
        seat: `rover` or `ground`.
        goals: places; `None` for those that the mission expects to be reached, or else those that
            are loaded on board before the start.
        overrides: values by dotted key, in place of the mission file's.

    Raises:
        MissionError: if the mission cannot be loaded.
        ValueError: if there is no such seat, no goal, a goal is no place that the rover can drive
            to, or what the seat itself sets is set.
    """
    seats = (ROVER, GROUND)
    if seat not in seats:
        hint = did_you_mean(seat, seats)
        raise ValueError(f"seat: expected {' or '.join(seats)}, found {shown(seat)}{hint}")
    for key in overrides:
        if any(key == own or key.startswith(f"{own}.") for own in _on_board(())):
            raise ValueError(
                f"overrides: expected none of what the seat sets ({', '.join(_on_board(()))}), "
                f"found {shown(key)}"
            )
    # What the mission's own operator would have done matters no more, so it need not fit either.
    found = load_mission(mission, {**overrides, **_AT_GROUND})
    wanted = _goals(found.mission, goals)
    if seat == GROUND:
        return Prepared(found, wanted)
    return Prepared(load_mission(mission, {**overrides, **_on_board(wanted)}), wanted)


def _on_board(goals: Sequence[str]) -> Mapping[str, object]:
    """The operator leaves the rover to the agent, with all goals at once, and says no more."""
    wanted = [
        {"place": goal, "priority": float(len(goals) - number)} for number, goal in enumerate(goals)
    ]
    return {
        "rover.controller": QUEUED_CONTROLLER,
        "rover.controller_options": {},
        "ground.operator": "scripted",
        "ground.operator_options": {},
        "ground.script": [{"do": "leave", "goals": wanted}],
    }


_AT_GROUND: Mapping[str, object] = {
    "ground.operator": QUEUED_OPERATOR,
    "ground.operator_options": {},
    "ground.script": [],
}


def _goals(mission: MissionFile, goals: Sequence[str] | None) -> tuple[str, ...]:
    if goals is None:
        expected = [one.place for one in mission.expect if isinstance(one, ReachedExpected)]
        goals = expected or [goal.place for goal in mission.rover.goals]
    if not goals:
        raise ValueError(
            'goals: expected one place at least, as in an expectation "reached" of the mission, in '
            "rover.goals, or in goals=, found none"
        )
    chart = mission.world.chart()
    start = chart.places[mission.rover.start]
    reachable = chart.reachable(start) - {start}
    for goal in goals:
        if chart.places.get(goal) not in reachable:
            raise ValueError(
                f"goals: expected places that can be reached from the start, "
                f"{mission.rover.start}, found {shown(goal)}{chart.like(goal)}"
            )
    return tuple(dict.fromkeys(goals))
