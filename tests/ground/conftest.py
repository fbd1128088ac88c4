"""What the rover might say to the ground."""

from typing import Any

import numpy as np

from farside.control import Failsafe, Mode
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel
from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.moves import MoveTerms, MoveTimes
from farside.ground.outlook import EnergyTerms, Outlook, RoverTerms
from farside.link import LinkConfig, LinkTerms, OneWay
from farside.messages import (
    Proposal,
    Telemetry,
)
from farside.node import Journal, to_ns
from farside.places import ACTIONS, Chart
from tests.dem.conftest import eventful, live  # noqa: F401 - fixtures here too

PLACES = ("at:0", "at:1", "at:2", "at:3")
MOVES = MoveTerms(cell_m=1.0, speed_m_s=1.0, turn_rate_rad_s=1e12)  # 2 s each
ROVER = RoverTerms(
    MOVES,
    least_move_ns=0,
    hold_after_ns=to_ns(10.0),
    alone_after_ns=to_ns(30.0),
    explores=False,
    energy=EnergyTerms(capacity_j=1e5, driving_w=50.0, idle_w=10.0, reserve=1.5, move_cost_s=2.0),
)
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


def make_desk(
    link: LinkConfig | None = None,
    valid_ns: int = 1000,
    least_s: float = 1.0,
    journal: Journal | None = None,
) -> CommandDesk:
    """A desk over this link; by default one of no delay, with no limit of rate.

    A move is expected to take 2 s. Nothing is ever queued but what the desk itself gives.
    """
    link = link or LinkConfig(up=OneWay(delay_s=0.0), down=OneWay(delay_s=0.0))
    return CommandDesk(
        LinkTerms.simulated(link, seed=1).schedule,
        valid_ns=valid_ns,
        times=MoveTimes(MOVES),
        least_move_ns=to_ns(least_s),
        action_of=lambda order: getattr(order, "action", None),
        journal=journal or Journal(),
        queued_until_ns=lambda now_ns: now_ns,
    )


def taught(lessons: int = 8, bumps: int = 0) -> ShadowModel:
    """The shadow of a model that was driven up and down a corridor of four places."""
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 1.0), Parameters(), rng=np.random.default_rng(1)
    )
    model.record_changes()
    shadow = ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters())
    model.sense([PLACES[0]])
    for _ in range(lessons):
        for action, places in (("E", PLACES[1:]), ("W", PLACES[-2::-1])):
            for place in places:
                model.perform(action)
                model.sense([place])
    for _ in range(bumps):
        model.perform("W")
        model.sense([PLACES[0]])
    shadow.apply(model.take_delta())
    return shadow


def make_outlook(belief: Belief, desk: CommandDesk) -> Outlook:
    """An outlook without a shadow, on a rover that is heard."""
    link = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0))
    plan = DownlinkPlan(LinkTerms.simulated(link, seed=1))
    silence, times = GroundSilence(plan, to_ns(6.0), to_ns(1.0)), MoveTimes(MOVES)
    return Outlook(belief, desk, silence, shadow=None, times=times, alone_after_ns=to_ns(30.0))
