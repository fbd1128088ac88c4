"""The schema of a mission file: world, rover, link, ground and expectations."""

from typing import Annotated

from msgspec import Meta

from farside.ground.config import GroundConfig
from farside.link.profile.config import LinkConfig
from farside.node import to_ns
from farside.places import Chart
from farside.rover.config import RoverConfig
from farside.settings import PlaceName, Positive, Section


class WorldConfig(Section, frozen=True):
    """The yard, drawn.

    Attributes:
        map: the yard drawn as `farside.places.Chart` reads it, a line for each row of cells,
            northernmost first.
        cell_m: side of a cell; project default.
    """

    map: str
    cell_m: Positive = 1.0

    def chart(self) -> Chart:
        """The chart of the yard.

        Raises:
            ValueError: if the drawing is not a walled yard.
        """
        return Chart(tuple(self.map.strip().splitlines()), self.cell_m)

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

    Only changes by the failsafe count, not those that the operator orders.

    Attributes:
        within_s: the time.
    """

    within_s: Positive


class ObedienceExpected(Section, frozen=True, tag="obedience", tag_field="what"):
    """Every command obeyed was sent, and none is obeyed twice."""


class NoCrossingExpected(Section, frozen=True, tag="no-crossing", tag_field="what"):
    """No frame is delivered that passes the rover's end of the link during an outage."""


Expectation = ReachedExpected | AutonomyExpected | ObedienceExpected | NoCrossingExpected


class MissionFile(Section, frozen=True):
    """A mission file.

    Attributes:
        name: name of the mission and of its logs.
        duration_s: simulated time from start to end.
        world: the yard.
        rover: the rover.
        link: the link.
        ground: the ground station.
        about: one line for people.
        seed: seed of every random stream; `--seed` replaces it.
        tick_s: time step of physics and decisions; project default.
        expect: the expectations that decide between success and failure.
    """

    name: Annotated[str, Meta(pattern=r"^[a-z0-9][a-z0-9_-]*\Z")]
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
