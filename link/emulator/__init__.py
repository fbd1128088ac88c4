"""The link alone, on a wall clock, between any Zenoh applications.

`farside.link.emulator.relay` is not imported here, for it needs Zenoh.
"""

from farside.link.emulator.horizon import Ahead, look_ahead
from farside.link.emulator.model import Delivery, Emulator, Kind

__all__ = ["Ahead", "Delivery", "Emulator", "Kind", "look_ahead"]
