"""The operators that Farside brings, by name."""

from farside.ground.config import QUEUED, GroundConfig
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
    if config.operator == "absent":
        return AbsentOperator()
    if config.operator == QUEUED:
        return QueuedOperator()
    if config.operator == "recorded":
        return RecordedOperator(config.recorded)
    if config.steps is None:
        raise ValueError(f"no operator of Farside's own: {config.operator}")
    return ScriptedOperator(config.steps, chart, config.rules)
