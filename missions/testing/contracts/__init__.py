"""What every controller and operator must keep to, as tests that a test class inherits.

class TestWalker(ControllerContract):
controller = Walker

class TestCaller(OperatorContract):
operator = Caller
"""

from farside.missions.testing.contracts.controllers import ControllerContract
from farside.missions.testing.contracts.operators import OperatorContract

__all__ = ["ControllerContract", "OperatorContract"]
