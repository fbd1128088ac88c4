"""The Dynamic Expectancy Model (after M. Witkowski): learns what follows from each action.

It needs no reward. Every prediction `context ∧ action → outcome` is tested against what happens,
whoever chose the action. Once a goal is set, the policy value of every known Sign follows at once
from what was learned.
"""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.dem.cycle import Choice, Prediction, Sensed, Trace
    from farside.dem.feed import Delta
    from farside.dem.lists.goals import Aside, Goal
    from farside.dem.lists.hypothesis import Hypothesis
    from farside.dem.lists.inherent import InherentGoal
    from farside.dem.lists.signs import Sign
    from farside.dem.memory import UnreadableMemoryError
    from farside.dem.model import DynamicExpectancyModel
    from farside.dem.parameters import Curiosity, Exploration, Parameters, Values
    from farside.dem.policy.aversions import Aversion
    from farside.dem.policy.planning import PolicyStep, PolicyValue, Why
    from farside.dem.recall import Recall
    from farside.dem.shadow import DeltaError, ShadowModel

__all__ = [
    "Aside",
    "Aversion",
    "Choice",
    "Curiosity",
    "Delta",
    "DeltaError",
    "DynamicExpectancyModel",
    "Exploration",
    "Goal",
    "Hypothesis",
    "InherentGoal",
    "Parameters",
    "PolicyStep",
    "PolicyValue",
    "Prediction",
    "Recall",
    "Sensed",
    "ShadowModel",
    "Sign",
    "Trace",
    "UnreadableMemoryError",
    "Values",
    "Why",
]

__getattr__ = lazily(
    __name__,
    {
        "Aside": "lists.goals",
        "Aversion": "policy.aversions",
        "Choice": "cycle",
        "Curiosity": "parameters",
        "Delta": "feed",
        "DeltaError": "shadow",
        "DynamicExpectancyModel": "model",
        "Exploration": "parameters",
        "Goal": "lists.goals",
        "Hypothesis": "lists.hypothesis",
        "InherentGoal": "lists.inherent",
        "Parameters": "parameters",
        "PolicyStep": "policy.planning",
        "PolicyValue": "policy.planning",
        "Prediction": "cycle",
        "Recall": "recall",
        "Sensed": "cycle",
        "ShadowModel": "shadow",
        "Sign": "lists.signs",
        "Trace": "cycle",
        "UnreadableMemoryError": "memory",
        "Values": "parameters",
        "Why": "policy.planning",
    },
)
