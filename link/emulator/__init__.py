"""The link alone, on a wall clock, between any Zenoh applications.

`farside.link.emulator.relay` is not imported here, for it needs Zenoh.
"""

from farside.link.emulator.model import HORIZON_S, Delivery, Emulator

__all__ = ["HORIZON_S", "Delivery", "Emulator"]
