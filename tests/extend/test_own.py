"""The examples of docs/extend.md keep to the contracts: what a user's test looks like."""

from typing import ClassVar

from caller import Caller
from pathfinder import Pathfinder

from farside.missions.testing.contracts import ControllerContract, OperatorContract


class TestPathfinder(ControllerContract):
    """The example of a controller."""

    controller = Pathfinder


class TestCaller(OperatorContract):
    """The example of an operator."""

    operator = Caller
    options: ClassVar = {"places": ["A", "B"]}
