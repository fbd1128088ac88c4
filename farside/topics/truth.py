"""What was so: the messages of `/truth`."""

from typing import Annotated

import msgspec

from farside.messages import Coordinate
from farside.places import Chart


class Yard(msgspec.Struct, frozen=True):
    """A map, once at the start: the world as it is, or as the ground has it.

    The chart's rows from north to south, and its scale.

    Raises:
        ValueError: if no `Chart` can be made of it, or one without a place.
    """

    rows: tuple[str, ...]
    cell_m: Annotated[float, msgspec.Meta(ge=0.01, le=1000)]

    def __post_init__(self) -> None:
        # So that a log with a map that no rover can be on is refused as it is read.
        if not Chart(self.rows, self.cell_m).places:
            raise ValueError("a map without a place")


class Pose(msgspec.Struct, frozen=True):
    """The true pose, and the true state of charge of the battery (0 to 1).

    Metres east and north of the chart's south-west corner; the heading is 0 towards east and grows
    counter-clockwise, without bound.
    """

    x_m: Coordinate
    y_m: Coordinate
    heading_rad: float
    speed_m_s: float
    place: str
    battery: float


class Bump(msgspec.Struct, frozen=True):
    """The rover hit a wall or a rock at this speed."""

    x_m: Coordinate
    y_m: Coordinate
    speed_m_s: float
