"""A mission's nodes in this process, to be looked into after they have run."""

from collections.abc import Callable
from typing import NamedTuple

from farside.dem import DynamicExpectancyModel
from farside.ground import Ground
from farside.ground.shadow import Shadow
from farside.missions import MissionFile
from farside.missions.build import build_node
from farside.missions.crew.crew import InProcessCrew
from farside.node import Record, Role, to_ns
from farside.rover import Rover


class Flight(NamedTuple):
    """A run that is over: the model on board, what the ground holds of it, and all records."""

    model: DynamicExpectancyModel
    shadow: Shadow | None
    records: list[Record]


def flown(
    mission: MissionFile, watch: Callable[[DynamicExpectancyModel], object] | None = None
) -> Flight:
    """Run a mission to its end; `watch` is given the model before anything happens."""
    rover, channel, ground = (build_node(role, mission) for role in Role)
    assert isinstance(rover, Rover)
    assert isinstance(ground, Ground)
    crew = InProcessCrew(rover, channel, ground)
    model = rover.controller
    assert isinstance(model, DynamicExpectancyModel)
    if watch is not None:
        watch(model)
    now_ns, end_ns = 0, to_ns(mission.duration_s)
    records: list[Record] = []
    while now_ns < end_ns:
        now_ns = min(now_ns + mission.window_ns, end_ns)
        records += crew.advance(now_ns)
    assert not crew.lost_processes
    records.sort(key=lambda record: record.log_time_ns)
    return Flight(model, ground.shadow, records)
