"""The ground station: what it knows of the rover, who decides there, and its end of the link."""

from farside.ground.config import GroundConfig
from farside.ground.node import Ground
from farside.ground.operators.scripted import Operator, ScriptedOperator, Situation

__all__ = ["Ground", "GroundConfig", "Operator", "ScriptedOperator", "Situation"]
