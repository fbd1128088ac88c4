"""The mission file as a checked object: world, rover, link, ground and expectations."""

from functools import lru_cache
from typing import Annotated

from msgspec import Meta

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
    """The `[world]` table: the yard, drawn; see `farside.places.Chart`.

    Attributes:
        map: one line a row of cells, northernmost first.
        cell_m: side of a cell, 1 cm to 1 km.
    """

    map: str
    cell_m: Annotated[float, Meta(ge=0.01, le=1000)] = 1.0

    def chart(self) -> Chart:
        """The yard as places.

        Raises:
            ValueError: if the drawing is not a walled yard.
        """
        return _chart(self.map, self.cell_m)

    def __post_init__(self) -> None:
        self.chart()


class ReachedExpected(Section, frozen=True, tag="reached", tag_field="what"):
    """The goal `place` is reached, in truth; with `in_blackout`, while both ways are out."""

    place: PlaceName
    in_blackout: bool = False


class AutonomyExpected(Section, frozen=True, tag="autonomy", tag_field="what"):
    """The rover turns autonomous within `within_s` of each loss of the uplink, never otherwise."""

    within_s: Positive


class ObedienceExpected(Section, frozen=True, tag="obedience", tag_field="what"):
    """No command is obeyed that nobody sent, and none twice."""


class NoCrossingExpected(Section, frozen=True, tag="no-crossing", tag_field="what"):
    """No frame is delivered that had to cross an outage."""


class ChargeExpected(Section, frozen=True, tag="charge", tag_field="what"):
    """The state of charge never falls below `at_least`, and the battery never goes flat."""

    at_least: Fraction = 0.0


Expectation = (
    ReachedExpected | AutonomyExpected | ObedienceExpected | NoCrossingExpected | ChargeExpected
)


MAX_TICKS = 10**9
"""The most ticks of a run: more than a year in ticks of 40 ms, and a night of computing (project
default)."""


class MissionFile(Section, frozen=True):
    """A whole mission.

    Attributes:
        name: what the mission is called, in 64 characters at most; names the log.
        about: one line for people.
        seed: the seed of every random stream; `--seed` replaces it.
        duration_s: simulated time from start to end, in `MAX_TICKS` ticks at most.
        tick_s: the grid of physics and decisions.
        world, rover, link, ground: the tables of those names.
        expect: what decides between success and failure.
    """

    name: Annotated[str, Meta(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}\Z")]
    duration_s: Positive
    world: WorldConfig
    rover: RoverConfig
    link: LinkConfig
    ground: GroundConfig
    about: str = ""
    seed: Annotated[int, Meta(ge=0)] = 0
    tick_s: Annotated[float, Meta(ge=0.001, le=0.2)] = 0.04
    expect: tuple[Expectation, ...] = ()

    @property
    def tick_ns(self) -> int:
        """The grid of physics and decisions, in nanoseconds."""
        return to_ns(self.tick_s)

    @property
    def window_ns(self) -> int:
        """The longest window: the link's lookahead in whole ticks, one tick at least."""
        return max(1, self.link.lookahead_ns // self.tick_ns) * self.tick_ns
