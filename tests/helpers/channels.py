"""What the tests of the channel have in common."""

import msgspec
import numpy as np

from farside.link import Channel, LinkConfig, OneWay
from farside.node import Direction, Frame, Record, Step, to_ns
from farside.topics import FrameFate

UP, DOWN = Direction.UP, Direction.DOWN


def link(up=None, down=None, **rest):
    perfect = OneWay(delay_s=1.0)
    return LinkConfig(up=up or perfect, down=down or perfect, **rest)


def channel(config, seed=0):
    return Channel(config, {way: np.random.default_rng([seed, way == UP]) for way in Direction})


def frame(direction, sequence, t_s, size_byte=100, priority=0, lifetime_s=None):  # noqa: PLR0917 - as in `Frame`
    lifetime_ns = None if lifetime_s is None else to_ns(lifetime_s)
    payload = bytes(place % 256 for place in range(size_byte))
    return Frame(direction, sequence, to_ns(t_s), payload, priority, lifetime_ns)


def fates(records: list[Record]) -> list[FrameFate]:
    decode = msgspec.json.Decoder(FrameFate).decode
    return [decode(record.payload) for record in records if record.topic == "/link/frame"]


def pass_through(config, frames, until_s=1000.0, seed=0) -> Step:
    return channel(config, seed).advance(to_ns(until_s), frames)


def fate_of(config, frames, until_s=1000.0, seed=0) -> dict[int, FrameFate]:
    """The fate of each frame by its sequence; copies left out."""
    found = fates(pass_through(config, frames, until_s, seed).records)
    return {fate.sequence: fate for fate in found if not fate.copy}
