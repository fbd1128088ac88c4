"""Building the three nodes of a run from its mission, each with random streams of its own."""

from enum import IntEnum, unique

import numpy as np
from numpy.random import Generator

from farside.dem import DynamicExpectancyModel
from farside.ground.node import Ground
from farside.ground.operators.scripted import ScriptedOperator
from farside.link.channel.node import Channel
from farside.link.endpoint.endpoint import LinkTerms
from farside.missions.schema import MissionFile
from farside.node import Direction, Node, Role, to_ns
from farside.places import ACTIONS
from farside.rover.config import RoverConfig
from farside.rover.node import Rover, RoverStreams


@unique
class _Purpose(IntEnum):
    """Purpose of a random stream. Its number is part of the meaning of a seed: never reuse one."""

    UPLINK = 0
    DOWNLINK = 1
    SOIL = 2
    SENSORS = 3
    LEARNING = 4


def build_node(role: Role, mission: MissionFile) -> Node:
    """The node that plays `role` in `mission`, at time 0."""
    match role:
        case Role.ROVER:
            return _rover(mission)
        case Role.LINK:
            return _channel(mission)
        case Role.GROUND:
            return _ground(mission)


def _rover(mission: MissionFile) -> Rover:
    return Rover(
        mission.rover,
        mission.world.chart(),
        tick_ns=mission.tick_ns,
        terms=_terms(mission),
        controller=_model,
        streams=RoverStreams(
            soil=_stream(mission.seed, _Purpose.SOIL),
            sensors=_stream(mission.seed, _Purpose.SENSORS),
            learning=_stream(mission.seed, _Purpose.LEARNING),
        ),
    )


def _model(rover: RoverConfig, rng: Generator) -> DynamicExpectancyModel:
    costs = dict.fromkeys(ACTIONS, rover.drive.move_cost_s)
    return DynamicExpectancyModel(costs, rover.dem, rng=rng)


def _terms(mission: MissionFile) -> LinkTerms:
    heartbeat_ns = to_ns(mission.ground.heartbeat_s)
    return LinkTerms.simulated(mission.link, mission.seed, heartbeat_ns)


def _channel(mission: MissionFile) -> Channel:
    seed = mission.seed if mission.link.seed is None else mission.link.seed
    rngs = {
        Direction.UP: _stream(seed, _Purpose.UPLINK),
        Direction.DOWN: _stream(seed, _Purpose.DOWNLINK),
    }
    return Channel(mission.link, rngs)


def _ground(mission: MissionFile) -> Ground:
    return Ground(
        mission.ground,
        ScriptedOperator(mission.ground.script, mission.world.chart()),
        tick_ns=mission.tick_ns,
        terms=_terms(mission),
    )


def _stream(seed: int, purpose: _Purpose) -> Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(purpose,)))
