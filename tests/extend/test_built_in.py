"""What Farside brings keeps to the contracts that it asks of others."""

from collections.abc import Mapping

from numpy.random import Generator

from farside.dem import Choice, DynamicExpectancyModel, Exploration, Parameters
from farside.missions.testing.contracts import ControllerContract, OperatorContract
from farside.rover import PlainController


class TestTheDem(ControllerContract):
    """The Dynamic Expectancy Model on board, as missions have it by default."""

    controller = "dem"


class TestTheScriptedOperator(OperatorContract):
    """The scripted operator, with the script of `blackout` up to the blackout."""

    operator = "scripted"
    duration_s = 300.0


class Wanderer(PlainController):
    """Goes anywhere, as long as it is wanted somewhere."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        if not (self.goals and explore):
            return None
        return Choice(self.actions[self.rng.integers(len(self.actions))])


class TestAWanderer(ControllerContract):
    """The least that derives from the plain controller."""

    controller = Wanderer


class Wrapped:
    """The DEM with something of one's own around it, which hands on what it does not have."""

    def __init__(self, action_costs: Mapping[str, float], *, rng: Generator) -> None:
        parameters = Parameters(exploration=Exploration.NONE)
        self._model = DynamicExpectancyModel(action_costs, parameters, rng=rng)

    def __getattr__(self, name: str) -> object:
        return getattr(self._model, name)
