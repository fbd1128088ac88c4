"""What the tests of the channel have in common."""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from farside.frames import FrameFate
from farside.link import Channel, LinkConfig, OneWay
from farside.node import Direction, Frame, Record, Step, to_ns

UP, DOWN = Direction.UP, Direction.DOWN


def link(up: OneWay | None = None, down: OneWay | None = None, **rest: Any) -> LinkConfig:
    perfect = OneWay(delay_s=1.0)
    return LinkConfig(up=up or perfect, down=down or perfect, **rest)


def channel(config: LinkConfig, seed: int = 0) -> Channel:
    return Channel(config, {way: np.random.default_rng([seed, way == UP]) for way in Direction})


def frame(  # noqa: PLR0917 - as in `Frame`
    direction: Direction,
    sequence: int,
    t_s: float,
    size_byte: int = 100,
    priority: int = 0,
    lifetime_s: float | None = None,
) -> Frame:
    lifetime_ns = None if lifetime_s is None else to_ns(lifetime_s)
    payload = bytes(index % 256 for index in range(size_byte))
    return Frame(direction, sequence, to_ns(t_s), payload, priority, lifetime_ns)


def fates(records: list[Record]) -> list[FrameFate]:
    decode = msgspec.json.Decoder(FrameFate).decode
    return [decode(record.payload) for record in records if record.topic == "/link/frame"]


def pass_through(
    config: LinkConfig, frames: Sequence[Frame], until_s: float = 1000.0, seed: int = 0
) -> Step:
    return channel(config, seed).advance(to_ns(until_s), frames)


def fate_of(
    config: LinkConfig, frames: Sequence[Frame], until_s: float = 1000.0, seed: int = 0
) -> dict[int, FrameFate]:
    """The fate of each frame by its sequence; copies left out."""
    found = fates(pass_through(config, frames, until_s, seed).records)
    return {fate.sequence: fate for fate in found if not fate.copy}
