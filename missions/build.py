"""Building the three nodes of a run from its mission, each with random streams of its own."""

from enum import IntEnum, unique

import numpy as np
from numpy.random import Generator

from farside.dem import DynamicExpectancyModel, Exploration, ShadowModel
from farside.ground.moves import MoveTerms
from farside.ground.node import Ground
from farside.ground.operators.built_in import built_in_operator
from farside.ground.operators.operator import Operator
from farside.ground.outlook import EnergyTerms, RoverTerms
from farside.link.channel.node import Channel
from farside.link.endpoint.endpoint import LinkTerms
from farside.missions.extensions.finding import find_class
from farside.missions.extensions.kinds import CONTROLLER, NONE, OPERATOR, Extensions
from farside.missions.extensions.making import make_controller, make_operator
from farside.missions.schema import MissionFile
from farside.node import Direction, Node, Role, to_ns
from farside.places import ACTIONS
from farside.rover.config import HEARTBEATS, QUEUED, RoverConfig
from farside.rover.control.queued import QueuedController
from farside.rover.controller import Controller
from farside.rover.node import Rover, RoverStreams


@unique
class _Purpose(IntEnum):
    """Purpose of a random stream. Its number is part of the meaning of a seed: never reuse one."""

    UPLINK = 0
    DOWNLINK = 1
    SOIL = 2
    SENSORS = 3
    LEARNING = 4
    OPERATOR = 5


def build_node(role: Role, mission: MissionFile, extensions: Extensions = NONE) -> Node:
    """The node that plays `role` in `mission`, at time 0.

    Args:
        role: the role.
        mission: the mission.
        extensions: the controller and operator of one's own; what is not there and not built in is
            found by its name.

    Raises:
        ExtensionError: if it is not found.
    """
    match role:
        case Role.ROVER:
            return build_rover(mission, extensions)
        case Role.LINK:
            return build_channel(mission)
        case Role.GROUND:
            return build_ground(mission, build_operator(mission, extensions))


def build_rover(mission: MissionFile, extensions: Extensions = NONE) -> Rover:
    """The rover of a mission; see `build_node`."""

    def controller(rover: RoverConfig, rng: Generator) -> Controller:
        return build_controller(rover, rng, extensions)

    return Rover(
        mission.rover,
        mission.world.chart(),
        tick_ns=mission.tick_ns,
        terms=_terms(mission),
        controller=controller,
        streams=RoverStreams(
            soil=_stream(mission.seed, _Purpose.SOIL),
            sensors=_stream(mission.seed, _Purpose.SENSORS),
            learning=_stream(mission.seed, _Purpose.LEARNING),
        ),
    )


def build_controller(
    rover: RoverConfig, rng: Generator, extensions: Extensions = NONE
) -> Controller:
    """The controller that the `[rover]` table names; see `build_node`."""
    costs = _action_costs(rover)
    if rover.controller == QUEUED:
        return QueuedController(costs, rng=rng)
    if rover.controller in CONTROLLER.built_in:
        return DynamicExpectancyModel(costs, rover.dem, rng=rng)
    kind = extensions.controller or find_class(CONTROLLER, rover.controller)
    return make_controller(kind, costs, rng, rover.controller_options)


def _action_costs(rover: RoverConfig) -> dict[str, float]:
    return dict.fromkeys(ACTIONS, rover.drive.move_cost_s)


def _terms(mission: MissionFile) -> LinkTerms:
    heartbeat_ns = to_ns(mission.ground.heartbeat_s)
    return LinkTerms.simulated(mission.link, mission.seed, heartbeat_ns)


def build_channel(mission: MissionFile) -> Channel:
    """The channel of a mission."""
    seed = mission.seed if mission.link.seed is None else mission.link.seed
    rngs = {
        Direction.UP: _stream(seed, _Purpose.UPLINK),
        Direction.DOWN: _stream(seed, _Purpose.DOWNLINK),
    }
    return Channel(mission.link, rngs)


def build_ground(mission: MissionFile, operator: Operator) -> Ground:
    """The ground station of a mission, with `operator` at it."""
    rover = mission.rover
    shadow = ShadowModel(_action_costs(rover), rover.dem) if rover.is_shadowed else None
    return Ground(
        mission.ground,
        operator,
        tick_ns=mission.tick_ns,
        terms=_terms(mission),
        rover=rover_terms(mission),
        chart=mission.world.chart(),
        shadow=shadow,
    )


def rover_terms(mission: MissionFile) -> RoverTerms:
    """What the ground knows of the rover beforehand."""
    rover, cell_m = mission.rover, mission.world.cell_m
    drive, failsafe, battery = rover.drive, rover.failsafe, rover.battery
    return RoverTerms(
        MoveTerms(cell_m, drive.speed_m_s, drive.turn_rate_rad_s),
        least_move_ns=to_ns(drive.least_move_s(cell_m)),
        hold_after_ns=to_ns(max(failsafe.hold_after_s, HEARTBEATS * mission.ground.heartbeat_s)),
        alone_after_ns=to_ns(failsafe.lost_after_s),
        explores=rover.dem.exploration is not Exploration.NONE,
        energy=EnergyTerms(
            capacity_j=battery.capacity_j,
            driving_w=battery.idle_w + battery.drive_w,
            idle_w=battery.idle_w,
            reserve=battery.reserve,
            move_cost_s=drive.move_cost_s,
        ),
    )


def build_operator(mission: MissionFile, extensions: Extensions = NONE) -> Operator:
    """The operator that the `[ground]` table names; see `build_node`."""
    ground, chart = mission.ground, mission.world.chart()
    if ground.operator in OPERATOR.built_in:
        return built_in_operator(ground, chart)
    kind = extensions.operator or find_class(OPERATOR, ground.operator)
    rng = _stream(mission.seed, _Purpose.OPERATOR)
    return make_operator(kind, chart, rng, ground.operator_options)


def _stream(seed: int, purpose: _Purpose) -> Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(purpose,)))
