"""The operators that Farside brings, by name."""

from msgspec.structs import asdict

from farside.ground.config import QUEUED, GroundConfig, Supervise, Teach
from farside.ground.operators.absent import AbsentOperator
from farside.ground.operators.operator import Operator
from farside.ground.operators.queued import QueuedOperator
from farside.ground.operators.recorded import RecordedOperator
from farside.ground.operators.scripted import ScriptedOperator
from farside.places import Chart


def built_in_operator(config: GroundConfig, chart: Chart) -> Operator:
    """The operator that the `[ground]` table names.

    Raises:
        ValueError: if it is none of these.
    """
    match config.operator:
        case "scripted":
            return ScriptedOperator(config.script, chart, config.rules)
        case "guide":
            return ScriptedOperator((Teach(**asdict(config.guide)),), chart, config.rules)
        case "supervisor":
            step = Supervise(**asdict(config.supervisor))
            return ScriptedOperator((step,), chart, config.rules)
        case "absent":
            return AbsentOperator()
        case name if name == QUEUED:
            return QueuedOperator()
        case "recorded":
            return RecordedOperator(config.recorded)
        case name:
            raise ValueError(f"no operator of Farside's own: {name}")
