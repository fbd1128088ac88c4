"""A model as bytes: everything that shapes its future, to be kept and taken up again.

| offset | bytes | what |
|---|---|---|
| 0 | 8 | `FARSIDE` and a zero: a model's memory |
| 8 | 2 | version of the format, least significant byte first, as all numbers here |
| 10 | 8 | length of the rest, below |
| 18 | 4 | CRC-32 of the rest |
| 22 | | `ModelState` as MessagePack, structs as arrays, compressed by zlib |

Nothing in it is ever run: it holds numbers and names.
"""

import json
import struct
import zlib
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.random import Generator

from farside.dem.learning.learner import LearnerState
from farside.dem.lists.goals import GoalsState, InherentGoal
from farside.dem.parameters import Parameters

FORMAT = 1
"""Version of the format that is written, and the only one that is read."""

_MAGIC = b"FARSIDE\0"
_HEADER = struct.Struct("<8sHQI")
_GENERATORS = {
    kind.__name__: kind
    for kind in (
        np.random.MT19937,
        np.random.PCG64,
        np.random.PCG64DXSM,
        np.random.Philox,
        np.random.SFC64,
    )
}

_T = TypeVar("_T")


class UnreadableMemoryError(ValueError):
    """What should be a model's memory is damaged, cut short, of another version, or foreign."""


class ModelState(msgspec.Struct, frozen=True, array_like=True):
    """All that a model is: how it was made, the lists, and where in its cycle it stands.

    Attributes:
        random: state of its bit generator.
        active, awaits_action, chosen, on_course: as the model keeps them.
    """

    action_costs: dict[str, float]
    parameters: Parameters
    inherent: tuple[InherentGoal, ...]
    random: bytes
    learner: LearnerState
    goals: GoalsState
    active: tuple[int, ...]
    awaits_action: bool
    chosen: str | None
    on_course: bool


def random_state(rng: Generator) -> bytes:
    """The state of a generator that is one of numpy's own.

    Raises:
        TypeError: if it is not.
    """
    state = rng.bit_generator.state
    if state["bit_generator"] not in _GENERATORS:
        raise TypeError(
            f"a model is saved with its generator: expected one of {', '.join(_GENERATORS)}, "
            f"found {state['bit_generator']}"
        )
    # Some states hold integers of 128 bits, which MessagePack has not.
    return json.dumps(state, default=np.ndarray.tolist, sort_keys=True).encode()


def restored_generator(state: bytes) -> Generator:
    """A generator of the same kind that goes on as the one of `random_state` would have."""
    saved: dict[str, Any] = json.loads(state)
    bits: Any = _GENERATORS[saved["bit_generator"]](0)
    bits.state = saved
    return Generator(bits)


def compress(value: object) -> bytes:
    """A struct as compressed MessagePack."""
    # A whole number where a fraction is meant takes the form of a fraction when it is read. So
    # that what is read and written again stays the same, that is done beforehand.
    plain = msgspec.msgpack.encode(value)
    return zlib.compress(msgspec.msgpack.encode(msgspec.msgpack.decode(plain, type=type(value))))


def decompress(data: bytes, kind: type[_T]) -> _T:
    """The struct that `compress` was given.

    Raises:
        UnreadableMemoryError: if `data` is anything else.
    """
    try:
        return msgspec.msgpack.decode(zlib.decompress(data), type=kind)
    except (zlib.error, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise UnreadableMemoryError(
            f"a model's memory: expected what format {FORMAT} holds, found: {error}"
        ) from error


def written(state: ModelState) -> bytes:
    """A model as bytes."""
    body = compress(state)
    return _HEADER.pack(_MAGIC, FORMAT, len(body), zlib.crc32(body)) + body


def read(data: bytes) -> ModelState:
    """The model that was `written`.

    Raises:
        UnreadableMemoryError: if `data` is anything else, or not all of it.
    """
    return decompress(_checked_body(data), ModelState)


def _checked_body(data: bytes) -> bytes:
    if data[: len(_MAGIC)] != _MAGIC:
        raise UnreadableMemoryError(
            f"a model's memory: expected it to begin with {_MAGIC!r}, "
            f"found {bytes(data[: len(_MAGIC)])!r}"
        )
    if len(data) < _HEADER.size:
        raise UnreadableMemoryError(
            f"a model's memory: expected {_HEADER.size} bytes at least, found {len(data)}"
        )
    _, version, length, check = _HEADER.unpack_from(data)
    body = data[_HEADER.size :]
    if version != FORMAT:
        raise UnreadableMemoryError(
            f"a model's memory: expected format {FORMAT}, found format {version}"
        )
    if len(body) != length:
        raise UnreadableMemoryError(
            f"a model's memory: expected {length} bytes after the header, found {len(body)}"
        )
    if zlib.crc32(body) != check:
        raise UnreadableMemoryError(
            f"a model's memory is damaged: expected CRC-32 {check:08x}, "
            f"found {zlib.crc32(body):08x}"
        )
    return body
