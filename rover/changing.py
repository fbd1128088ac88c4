"""A rover whose mission file changes while it is under way."""

from farside.dem import DynamicExpectancyModel
from farside.messages import Tokens
from farside.places import place_token
from farside.rover.config import RoverConfig
from farside.rover.node import Rover
from farside.rover.world.faults import Faults


def change(rover: Rover, config: RoverConfig, now_ns: int) -> None:
    """Go by another `[rover]` table from now on.

    What the rover was told stays: goals that were reached or withdrawn, and what the operator said
    of `on_loss`. A proposal that stands keeps its veto window. The charge is the energy left.

    Args:
        rover: the rover, between two ticks.
        config: equal to `rover.config` but for `goals`, `failsafe`, `consent`, `battery`, `faults`
            and `dem`.
        now_ns: the present.

    Raises:
        ValueError: if a parameter of the model differs that cannot; see
            `farside.dem.DynamicExpectancyModel.change`.
    """
    before, rover.config = rover.config, config
    parts, failsafe = rover.parts, config.failsafe
    parts.journal.now_ns = now_ns
    if config.dem != before.dem and isinstance(rover.controller, DynamicExpectancyModel):
        rover.controller.change(config.dem)
    parts.silence.change(failsafe)
    rover.pilot.change(failsafe)
    parts.proposals.change(config.consent, parts.silence.grace_ns)
    parts.battery.change(config.battery)
    parts.gate.factor = config.battery.reserve
    parts.goals.change_mission(_goals(before), _goals(config))
    rover.faults = Faults(config.faults)


def _goals(config: RoverConfig) -> dict[Tokens, float]:
    return {(place_token(goal.place),): goal.priority for goal in config.goals}
