"""The ground station: what it knows of the rover, its operators, and its end of the link."""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.ground.config import GroundConfig
    from farside.ground.node import Ground
    from farside.ground.operators.operator import Operator, Situation
    from farside.ground.operators.scripted import ScriptedOperator

__all__ = ["Ground", "GroundConfig", "Operator", "ScriptedOperator", "Situation"]

__getattr__ = lazily(
    __name__,
    {
        "Ground": "node",
        "GroundConfig": "config",
        "Operator": "operators.operator",
        "ScriptedOperator": "operators.scripted",
        "Situation": "operators.operator",
    },
)
