"""The rover: its true world, its senses, its drive, and who decides on board."""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.rover.config import RoverConfig
    from farside.rover.node import Rover, RoverStreams

__all__ = ["Rover", "RoverConfig", "RoverStreams"]

__getattr__ = lazily(
    __name__,
    {
        "Rover": "node",
        "RoverConfig": "config",
        "RoverStreams": "node",
    },
)
