"""How each type of message is carried over the link, and what the log says that a frame carries."""

from typing import NamedTuple

import msgspec

from farside.frames import Carried
from farside.messages import (
    Command,
    Downlink,
    Event,
    Heartbeat,
    ModelUpdate,
    Proposal,
    Shown,
    Telemetry,
    Uplink,
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

_decode = msgspec.msgpack.Decoder(Uplink | Downlink).decode


def carried(message: msgspec.Struct) -> Carried:
    """What a frame carries that holds the whole of `message`, one of the link's."""
    number = message.proposal if isinstance(message, Shown) else getattr(message, "number", None)
    kind = str(message.__struct_config__.tag)
    return Carried(kind, number, getattr(message, "time_ns", None))


def carried_in(payload: bytes) -> Carried:
    """What a frame carries that holds the message in `payload`, packed by this end."""
    return carried(_decode(payload))


def part_of(whole: Carried, part: int, parts: int, attempt: int = 1) -> Carried:
    """A part of a message, from 1, as it is sent for the `attempt`-th time."""
    if parts == attempt == 1:
        return whole
    return Carried(whole.kind, whole.number, whole.time_ns, part, parts, attempt)
