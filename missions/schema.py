"""The schema of a mission file: world, rover, link, ground and expectations."""

from functools import lru_cache
from typing import Annotated, Any

from msgspec import Meta, Struct

from farside.ground.config import GroundConfig
from farside.link.profile.config import LinkConfig
from farside.node import to_ns
from farside.places import Chart
from farside.rover.config import RoverConfig
from farside.settings import Fraction, PlaceName, Positive, Section


@lru_cache(maxsize=2)
def _chart(drawing: str, cell_m: float) -> Chart:
    # Asked for by every check of a mission; a large yard takes a good part of a second to read.
    return Chart(tuple(drawing.strip().splitlines()), cell_m)


class WorldConfig(Section, frozen=True):
    """The yard, drawn.

    Attributes:
        map: the yard drawn as `farside.places.Chart` reads it, a line for each row of cells,
            northernmost first.
        cell_m: side of a cell, 1 cm to 1 km; project default.
    """

    map: str
    cell_m: Annotated[float, Meta(ge=0.01, le=1000)] = 1.0

    def chart(self) -> Chart:
        """The chart of the yard.

        Raises:
            ValueError: if the drawing is not a walled yard.
        """
        return _chart(self.map, self.cell_m)

    def __post_init__(self) -> None:
        self.chart()


class ReachedExpected(Section, frozen=True, tag="reached", tag_field="what"):
    """A goal is truly reached.

    Attributes:
        place: the goal.
        in_blackout: it is reached while both directions are down.
    """

    place: PlaceName
    in_blackout: bool = False


class AutonomyExpected(Section, frozen=True, tag="autonomy", tag_field="what"):
    """The rover turns autonomous within a time of each loss of the uplink, never otherwise.

    Only changes by the failsafe count, not those that the operator orders. An outage that the
    contact plan foresees is no loss.

    Attributes:
        within_s: the time.
    """

    within_s: Positive


class ObedienceExpected(Section, frozen=True, tag="obedience", tag_field="what"):
    """The rover does what it is ordered to, and nothing of its own against it.

    Every command begun was sent, no command is begun twice or after it expired, and every one that
    was taken comes to an end. Of its own the rover acts only towards a goal: alone, in autonomous
    mode, or by consent; and after it took over not before the operator has said who drives.
    """


class NoCrossingExpected(Section, frozen=True, tag="no-crossing", tag_field="what"):
    """No frame is delivered that passes the rover's end of the link during an outage."""


class ChargeExpected(Section, frozen=True, tag="charge", tag_field="what"):
    """The state of charge never falls below `at_least`, and the battery never goes flat.

    Attributes:
        at_least: the least state of charge, 0 to 1.
    """

    at_least: Fraction = 0.0


Expectation = (
    ReachedExpected | AutonomyExpected | ObedienceExpected | NoCrossingExpected | ChargeExpected
)


MAX_TICKS = 10**9
"""The most ticks of a run: more than a year in ticks of 40 ms, and a night of computing (project
default)."""


class MissionFile(Section, frozen=True):
    """A mission file.

    Attributes:
        name: name of the mission and of its logs, in 64 characters at most.
        duration_s: simulated time from start to end, in 10⁹ ticks at most.
        world: the yard.
        rover: the rover.
        link: the link.
        ground: the ground station.
        about: one line for people.
        seed: seed of every random stream; `--seed` replaces it.
        tick_s: time step of physics and decisions; project default.
        expect: the expectations that decide between success and failure.
    """

    name: Annotated[str, Meta(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}\Z")]
    duration_s: Positive
    world: WorldConfig
    rover: RoverConfig
    link: LinkConfig
    ground: GroundConfig = GroundConfig()
    about: str = ""
    seed: Annotated[int, Meta(ge=0)] = 0
    tick_s: Annotated[float, Meta(ge=0.001, le=0.2)] = 0.04
    expect: tuple[Expectation, ...] = ()

    @property
    def tick_ns(self) -> int:
        """`tick_s` in nanoseconds."""
        return to_ns(self.tick_s)

    @property
    def window_ns(self) -> int:
        """The longest window in nanoseconds: the link's lookahead in whole ticks, at least one."""
        return max(1, self.link.lookahead_ns // self.tick_ns) * self.tick_ns


class Change(Struct, frozen=True):
    """From a moment of a run on, it goes by another mission.

    Attributes:
        at_ns: the moment in simulated time, on a tick.
        overrides: dotted keys and values of what is changed then, in order.
        mission: the mission from then on, resolved.
    """

    at_ns: int
    overrides: tuple[tuple[str, Any], ...]
    mission: MissionFile
