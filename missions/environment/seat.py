"""What both seats have: places and goals as numbers, and what an agent is told."""

from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from farside.missions.environment.happening import Happened
from farside.missions.schema import MissionFile
from farside.places import ACTIONS, is_place_token, place_name, place_token

WAIT = "wait"
ACTION_NAMES = (*ACTIONS, WAIT)
"""The actions by number: the moves, then waiting."""

Observation = dict[str, np.int64 | NDArray[Any]]


class Seat(Protocol):
    """Where an agent sits: what it sees from there, and what its actions do."""

    def begin(self) -> bool:
        """Let the run come to the agent's first decision; false if none comes."""
        ...

    def act(self, action: str) -> Happened:
        """Take one of `ACTION_NAMES`, and let the run come to the next decision."""
        ...

    def observe(self) -> Observation:
        """What the agent knows now."""
        ...

    def tell(self) -> dict[str, Any]:
        """What is beside that: words."""
        ...

    @property
    def place(self) -> str | None:
        """The place where the rover is, as far as that is known here."""
        ...

    @property
    def wanted(self) -> tuple[str, ...]:
        """The goals that are not known here to be reached."""
        ...


class Bearings:
    """Numbers the places and the goals of a mission.

    Args:
        mission: the mission.
        goals: the goals by name, in order.

    Attributes:
        places: names of the places by number; one number more means that none is known.
        goals: the goals by name.
        tokens: the Token of each goal.
    """

    def __init__(self, mission: MissionFile, goals: tuple[str, ...]) -> None:
        self.places = tuple(mission.world.chart().places)
        self.goals = goals
        self.tokens = {place_token(goal): goal for goal in goals}
        self._numbers = {name: np.int64(number) for number, name in enumerate(self.places)}

    @property
    def spaces(self) -> dict[str, spaces.Space[Any]]:
        """The spaces of `observe`."""
        return {
            "place": spaces.Discrete(len(self.places) + 1),
            "goals": spaces.MultiBinary(len(self.goals)),
            "battery": spaces.Box(0.0, 1.0, (1,), np.float32),
        }

    def observe(self, place: str | None, wanted: tuple[str, ...], battery: float) -> Observation:
        """Place, goals that are left, and charge, as numbers."""
        unknown = np.int64(len(self.places))
        return {
            "place": unknown if place is None else self._numbers[place],
            "goals": np.array([goal in wanted for goal in self.goals], np.int8),
            "battery": np.array([battery], np.float32),
        }


def place_in(tokens: frozenset[str] | tuple[str, ...]) -> str | None:
    """The name of the place that Tokens tell of; `None` if of none."""
    return next((place_name(token) for token in tokens if is_place_token(token)), None)
