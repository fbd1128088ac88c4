"""How each type of message is carried over the link."""

from typing import NamedTuple

import msgspec

from farside.messages import (
    Command,
    Event,
    Heartbeat,
    ModelUpdate,
    Proposal,
    Shown,
    Telemetry,
)
from farside.node import NS_PER_S


class Service(NamedTuple):
    """How a type of message is carried.

    Attributes:
        reliable: in order and until it has arrived; expedited otherwise.
        priority: of its frames in the transmit queue; the highest goes first.
        lifetime_ns: for how long an expedited message is worth sending; `None` for ever.
    """

    reliable: bool
    priority: int
    lifetime_ns: int | None = None


SERVICES: dict[type[msgspec.Struct], Service] = {
    Command: Service(reliable=True, priority=3),
    Heartbeat: Service(reliable=False, priority=2, lifetime_ns=10 * NS_PER_S),
    Shown: Service(reliable=True, priority=3),
    Event: Service(reliable=True, priority=3),
    Proposal: Service(reliable=True, priority=3),
    Telemetry: Service(reliable=False, priority=1, lifetime_ns=2 * NS_PER_S),
    ModelUpdate: Service(reliable=True, priority=2),
}
"""The service of each message (project default)."""
