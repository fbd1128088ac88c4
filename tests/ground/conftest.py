"""What the rover might say to the ground."""

from typing import Any

from farside.control import Failsafe, Mode
from farside.messages import (
    Proposal,
    Telemetry,
)
from farside.node import to_ns
from farside.places import Chart

CHART = Chart(("######", "#A..B#", "######"), 1.0)


def telemetry(t_s: float = 0.0, place: str = "A", **changes: Any) -> Telemetry:
    values = {
        "time_ns": to_ns(t_s),
        "tokens": (f"at:{place}",),
        "x_m": 0.0,
        "y_m": 0.0,
        "heading_rad": 0.0,
        "battery": 1.0,
        "mode": Mode.GUIDED,
        "failsafe": Failsafe.NOMINAL,
        "action": None,
        "goals": (),
        "commands_done": 0,
    }
    return Telemetry(**{**values, **changes})


def proposal(number: int, action: str = "E") -> Proposal:
    return Proposal(number, 0, ("at:B",), action, ())
