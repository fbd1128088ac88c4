"""The Dynamic Expectancy Model (DEM): learns what actions do, and plans by it.

    model = DynamicExpectancyModel({"N": 2.66, "S": 2.66}, rng=numpy.random.default_rng(7))
    model.set_goal(["at:B"], priority=1.0)
    while not model.sense(world.tokens()).reached:
        model.perform(world.do(model.choose().action))

A library: no I/O, no clock, and no randomness but the generator that it is given.
"""

from farside.dem.lists import Goal, Hypothesis, Sign
from farside.dem.model import Choice, DynamicExpectancyModel, Sensed
from farside.dem.parameters import Parameters
from farside.dem.policy import PathStep, PolicyValue

__all__ = [
    "Choice",
    "DynamicExpectancyModel",
    "Goal",
    "Hypothesis",
    "Parameters",
    "PathStep",
    "PolicyValue",
    "Sensed",
    "Sign",
]
