"""A model as bytes: its whole state, to be saved and loaded.

| offset | bytes | content |
|---|---|---|
| 0 | 8 | magic number: `FARSIDE` and a zero byte |
| 8 | 2 | version of the format; this and all other numbers are little-endian |
| 10 | 8 | length of the body |
| 18 | 4 | CRC-32 of the body |
| 22 | | body: `ModelState` as MessagePack, structs as arrays, compressed with zlib |

Loading never executes anything from the data, which holds only numbers and names.
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

FORMAT = 2
"""Version of the format that is written; no other is read."""

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
    """The data is not a saved model, or is damaged, truncated, or of another version."""


class ModelState(msgspec.Struct, frozen=True, array_like=True):
    """The state of a model: its constructor's arguments, its lists, and its point in the cycle.

    Attributes:
        random: state of the random generator, see `random_state`.
        active, awaits_action, chosen, on_course: the private attributes of these names.
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
    """The state of a random generator, as bytes.

    Raises:
        TypeError: if its bit generator is not one of numpy's own.
    """
    state = rng.bit_generator.state
    if state["bit_generator"] not in _GENERATORS:
        raise TypeError(
            "a model is saved with its random generator: expected one of "
            f"{', '.join(_GENERATORS)}, found {state['bit_generator']}"
        )
    # Some states hold 128-bit integers, which MessagePack does not support.
    return json.dumps(state, default=np.ndarray.tolist, sort_keys=True).encode()


def restored_generator(state: bytes) -> Generator:
    """A generator that continues the stream of the one that `random_state` was given."""
    saved: dict[str, Any] = json.loads(state)
    bits: Any = _GENERATORS[saved["bit_generator"]](0)
    bits.state = saved
    return Generator(bits)


def compress(value: object) -> bytes:
    """A struct as compressed MessagePack."""
    # An int in a float field becomes a float on decoding. It is converted before encoding too, so
    # that a value that is decoded and encoded again gives the same bytes.
    plain = msgspec.msgpack.encode(value)
    return zlib.compress(msgspec.msgpack.encode(msgspec.msgpack.decode(plain, type=type(value))))


def decompress(data: bytes, kind: type[_T]) -> _T:
    """The struct that `compress` was given.

    Raises:
        UnreadableMemoryError: if `data` is not such a struct.
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
        UnreadableMemoryError: if `data` is not the whole of such a model.
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
            f"a model's memory: expected at least {_HEADER.size} bytes, found {len(data)}"
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
