"""What the rover might say to the ground."""

from typing import Any

from farside.control import Failsafe, Mode
from farside.ground.belief import Belief
from farside.ground.downlink import DownlinkPlan
from farside.link import LinkConfig, LinkTerms, OneWay
from farside.messages import (
    Proposal,
    Telemetry,
)
from farside.node import Journal, to_ns
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


def make_belief(link: LinkConfig | None = None) -> Belief:
    """A belief over this link; by default one of a second of light time, with no limit of rate."""
    link = link or LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0))
    return Belief(DownlinkPlan(LinkTerms.simulated(link, seed=1)), Journal())
