"""What a step of an environment came to, and what that is worth."""

from collections.abc import Callable
from typing import NamedTuple

GOAL_BONUS_S = 100.0
"""What a goal is worth by default, in seconds (project default)."""


class Happened(NamedTuple):
    """What a step came to, as it was known where the agent sits.

    Attributes:
        seconds: simulated time that it took.
        energy_j: energy that it took; less than 0 where the rover was charged.
        reached: the goals reached, by name.
        blocked: how many moves ended blocked.
        refused: how many moves were not begun.
        lost: whether the rover is lost: its battery is flat.
        left_s: simulated time left until the end of the mission.
    """

    seconds: float
    energy_j: float
    reached: tuple[str, ...]
    blocked: int
    refused: int
    lost: bool
    left_s: float


Reward = Callable[[Happened], float]
"""What a step is worth."""


def minus_time(happened: Happened) -> float:
    """The reward by default: minus the seconds, plus 100 for each goal reached.

    Who loses the rover pays for all the time that is left: or else that would be the quickest way
    to save it.
    """
    spent_s = happened.seconds + (happened.left_s if happened.lost else 0.0)
    return GOAL_BONUS_S * len(happened.reached) - spent_s
