"""The rover: its true world, its senses, its drive, and who decides on board."""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.rover.config import RoverConfig
    from farside.rover.control.controller import Controller
    from farside.rover.control.plain import PlainController
    from farside.rover.node import Rover, RoverStreams

__all__ = ["Controller", "PlainController", "Rover", "RoverConfig", "RoverStreams"]

__getattr__ = lazily(
    __name__,
    {
        "Controller": "control.controller",
        "PlainController": "control.plain",
        "Rover": "node",
        "RoverConfig": "config",
        "RoverStreams": "node",
    },
)
