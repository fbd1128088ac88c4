"""What Farside brings keeps to the contracts that it asks of others."""

from collections.abc import Mapping
from typing import ClassVar

from numpy.random import Generator

from farside.dem import Choice, DynamicExpectancyModel, Exploration, Parameters
from farside.missions.testing.contracts import ControllerContract, OperatorContract
from farside.rover import PlainController


class TestTheDem(ControllerContract):
    """The Dynamic Expectancy Model on board, as missions have it by default."""

    controller = "dem"


class TestAQueueOnBoard(ControllerContract):
    """Actions from outside, of which there are none."""

    controller = "queued"


class TestTheScriptedOperator(OperatorContract):
    """The scripted operator, with the script of `blackout` up to the blackout."""

    operator = "scripted"
    duration_s = 300.0


class TestTheGuide(OperatorContract):
    """The tour that teaches."""

    operator = "guide"


class TestTheSupervisor(OperatorContract):
    """Goals and rules, in a yard that the rover does not know yet."""

    operator = "supervisor"
    given: ClassVar = {
        "ground.supervisor.goals": [{"place": "A"}, {"place": "B"}],
        "ground.supervisor.patience_s": 20.0,
        "ground.rules": [{"rule": "cost", "below": 100.0}, {"rule": "age", "below_s": 60.0}],
    }


class TestNobody(OperatorContract):
    """Nobody at the ground."""

    operator = "absent"


class TestAQueue(OperatorContract):
    """Orders from outside, of which there are none."""

    operator = "queued"


class TestARecord(OperatorContract):
    """Orders of a log, whatever the rover does."""

    operator = "recorded"
    given: ClassVar = {
        "ground.recorded.orders": [
            {"time_ns": 10**9, "json": '{"act":{"type":"drive","action":"N"}}'},
            {"time_ns": 9**10, "json": '{"act":{"type":"goal","tokens":["at:A"],"priority":2}}'},
        ]
    }


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
