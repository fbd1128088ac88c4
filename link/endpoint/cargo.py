"""Which message a frame carries, in the words of the log."""

import msgspec

from farside.frames import Carried
from farside.messages import Downlink, Shown, Uplink

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
