"""The rover: its true world, its senses, its drive, and who decides on board."""

from farside.rover.config import RoverConfig
from farside.rover.node import Rover, RoverStreams

__all__ = ["Rover", "RoverConfig", "RoverStreams"]
