"""The link: what crosses it, what it does to frames, and the names that both its ends use.

`farside.link.transport`, which brings Zenoh with it, is imported by those who need it.
"""

from farside.link.channel import Channel
from farside.link.config import Affected, Blackout, LinkConfig, OneWay
from farside.link.endpoint import Endpoint, LinkTerms, ground_endpoint, rover_endpoint
from farside.link.node import Direction, Frame, Node, Record, Role, Step, to_ns, to_s
from farside.link.places import ACTIONS, Cell, Chart
from farside.link.records import TOPICS, Fate, FrameFate, Journal
from farside.link.wire import FrameError

__all__ = [
    "ACTIONS",
    "TOPICS",
    "Affected",
    "Blackout",
    "Cell",
    "Channel",
    "Chart",
    "Direction",
    "Endpoint",
    "Fate",
    "Frame",
    "FrameError",
    "FrameFate",
    "Journal",
    "LinkConfig",
    "LinkTerms",
    "Node",
    "OneWay",
    "Record",
    "Role",
    "Step",
    "ground_endpoint",
    "rover_endpoint",
    "to_ns",
    "to_s",
]
