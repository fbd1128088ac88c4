"""The rover: its true world, its senses, its drive, and who decides on board."""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.rover.config import RoverConfig
    from farside.rover.controller import Controller
    from farside.rover.node import Rover, RoverStreams
    from farside.rover.plain import PlainController

__all__ = ["Controller", "PlainController", "Rover", "RoverConfig", "RoverStreams"]

__getattr__ = lazily(
    __name__,
    {
        "Controller": "controller",
        "PlainController": "plain",
        "Rover": "node",
        "RoverConfig": "config",
        "RoverStreams": "node",
    },
)
