"""Sealers from any sequence number on, and refusals, for tests of the wire."""

import zlib

import pytest

from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.wire import (
    SEQUENCE_LIMIT,
    FrameError,
    Opener,
    Refusal,
    Sealer,
)
from farside.node import Direction

UP, DOWN = Direction.UP, Direction.DOWN
KEY = simulated_key(7)


class From:
    """Numbers from a certain one on, as after a restart; remembers what was asked for."""

    def __init__(self, first: int, ahead: int = SEQUENCE_LIMIT) -> None:
        self.first, self.ahead, self.asked = first, ahead, list[int]()

    def reserve(self, sequence: int) -> int:
        self.asked.append(sequence)
        return sequence + self.ahead


def sealer(direction: Direction = UP, *, first: int = 0, key: bytes = KEY) -> Sealer:
    return Sealer(key, direction, From(first))


def with_crc(content: bytes) -> bytes:
    return content + zlib.crc32(content).to_bytes(4, "little")


def refusal(opener: Opener, wire: bytes) -> Refusal:
    with pytest.raises(FrameError) as caught:
        opener.open(wire)
    return caught.value.reason
