"""The ground station: what it knows of the rover, its operators, and its end of the link."""

from farside.ground.config import GroundConfig
from farside.ground.node import Ground
from farside.ground.operators.operator import Operator, Situation
from farside.ground.operators.scripted import ScriptedOperator

__all__ = ["Ground", "GroundConfig", "Operator", "ScriptedOperator", "Situation"]
