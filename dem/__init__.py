"""The Dynamic Expectancy Model (after M. Witkowski): learns what follows from what is done.

It needs no reward. Every prediction `context ∧ action → outcome` is tested against what happens,
whoever chose the action, and when a goal is set, a policy value from every known Sign to it
follows at once from what was learned.
"""

from farside.dem.lists.goals import Goal, InherentGoal
from farside.dem.lists.hypotheses import Hypothesis
from farside.dem.lists.signs import Sign
from farside.dem.memory import UnreadableMemoryError
from farside.dem.model import Choice, DynamicExpectancyModel, Sensed
from farside.dem.parameters import Curiosity, Parameters
from farside.dem.policy.planning import PathStep, PolicyValue, Why
from farside.dem.shadow import Delta, DeltaError, ShadowModel

__all__ = [
    "Choice",
    "Curiosity",
    "Delta",
    "DeltaError",
    "DynamicExpectancyModel",
    "Goal",
    "Hypothesis",
    "InherentGoal",
    "Parameters",
    "PathStep",
    "PolicyValue",
    "Sensed",
    "ShadowModel",
    "Sign",
    "UnreadableMemoryError",
    "Why",
]
