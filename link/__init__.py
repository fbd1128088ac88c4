"""The link between two ends.

`profile` is what a link is, `channel` what it does to frames, `endpoint` what rides on it;
`emulator` puts the channel alone between any Zenoh programs; `check` proves what it does.
"""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.link.channel.node import Channel
    from farside.link.endpoint.endpoint import Endpoint, LinkTerms, ground_endpoint, rover_endpoint
    from farside.link.endpoint.wire import FrameError
    from farside.link.profile.config import Affected, Blackout, LinkConfig, OneWay

__all__ = [
    "Affected",
    "Blackout",
    "Channel",
    "Endpoint",
    "FrameError",
    "LinkConfig",
    "LinkTerms",
    "OneWay",
    "ground_endpoint",
    "rover_endpoint",
]

__getattr__ = lazily(
    __name__,
    {
        "Affected": "profile.config",
        "Blackout": "profile.config",
        "Channel": "channel.node",
        "Endpoint": "endpoint.endpoint",
        "FrameError": "endpoint.wire",
        "LinkConfig": "profile.config",
        "LinkTerms": "endpoint.endpoint",
        "OneWay": "profile.config",
        "ground_endpoint": "endpoint.endpoint",
        "rover_endpoint": "endpoint.endpoint",
    },
)
