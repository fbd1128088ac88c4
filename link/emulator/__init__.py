"""The link alone, on a wall clock, between any Zenoh applications.

`farside.link.emulator.relay`, which brings Zenoh with it, is imported by those who need it.
"""

from farside.link.emulator.model import Delivery, Emulator

__all__ = ["Delivery", "Emulator"]
