"""The first study: how many actions it takes to know a yard, led by an operator or alone."""

from typing import Any

import numpy as np
from timed import Timed
from yards import (
    CountingModel,
    arcs_of,
    circuit,
    mission_with,
    random_stream,
    simulated,
)

from farside.control import Mode
from farside.dem import Parameters
from farside.ground import Operator, ScriptedOperator
from farside.ground.config import Tour
from farside.messages import SetGoal, SetMode
from farside.places import ACTIONS, place_name

WAYS = ("guided", "curious", "random")
GIVE_UP_S = 60_000.0
GRID = sorted({round(float(count)) for count in np.geomspace(10, 10_000, 46)})
"""The numbers of actions at which the growth of the model is looked at."""


def explored(way: str, seed: int) -> dict[str, Any]:
    """One run of the whole rover until it knows every place and every arc of the yard."""
    mission = mission_with(seed, duration_s=GIVE_UP_S)
    chart = mission.world.chart()
    operator: Operator
    if way == "guided":
        walk = circuit(chart, chart.places["D"], random_stream(seed, 99))
        names = tuple(place_name(chart.tokens[cell]) for cell in walk[1:])
        operator = ScriptedOperator([Tour(places=names)], chart)
    else:
        # A goal that is no place, so that the search for it never ends.
        operator = Timed([(3.0, SetMode(Mode.AUTONOMOUS)), (9.0, SetGoal(("at:nowhere",), 1.0))])
    model = CountingModel(
        dict.fromkeys(ACTIONS, mission.rover.drive.move_cost_s),
        Parameters(exploration="none" if way == "guided" else way),  # type: ignore[arg-type]
        rng=random_stream(seed, 4),
    )
    model.watch(chart)
    simulated(mission, operator, model).run(model, until_complete=True)
    complete = model.is_complete
    assert complete == (len(model.arcs) == len(arcs_of(chart)))
    return {
        "way": way,
        "seed": seed,
        "complete": complete,
        "actions": model.performed,
        "all_places": model.places[-1],
        "all_arcs": model.arcs[-1],
        "arcs_at": [sum(at <= count for at in model.arcs) for count in GRID],
    }
