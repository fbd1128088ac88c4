"""A model as bytes: its whole state, to be saved and loaded.

| offset | bytes | content |
|---|---|---|
| 0 | 8 | magic number: `FARSIDE` and a zero byte |
| 8 | 2 | version of the format; this and all other numbers are little-endian |
| 10 | 8 | length of the body |
| 18 | 4 | CRC-32 of the body |
| 22 | | body: `ModelState` as MessagePack, structs as arrays, compressed with zlib |

Loading never executes anything from the data, which holds only numbers and names. All of it is
checked before any of it is used, and it unpacks to no more than `MAX_UNPACKED` bytes, nor to more
than `MAX_RATIO` times its own length beyond the first MiB. Once loaded, a byte of that can take
some 30 bytes.
"""

import json
import struct
import zlib
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.random import Generator

from farside.dem.checking import CheckedLists, check_goal_list
from farside.dem.learning.learner import LearnerState
from farside.dem.lists.actions import ActionList
from farside.dem.lists.given import shown
from farside.dem.lists.goals import GoalsState
from farside.dem.lists.inherent import InherentGoal, RuleState
from farside.dem.parameters import Parameters
from farside.dem.policy.aversions import Aversion, checked

FORMAT = 4
"""Version of the format that is written; no other is read."""

MAX_UNPACKED = 2**28
"""The most bytes that a saved model may unpack to: some five million hypotheses."""

MAX_RATIO = 100
"""How many times its own length a saved model may unpack to, beyond the first MiB."""

_MIB = 2**20
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
        action_costs: in order of id.
        random: state of the random generator, see `random_state`.
        active, awaits_action, chosen, on_course: the private attributes of these names.
    """

    action_costs: dict[str, float]
    parameters: Parameters
    inherent: tuple[RuleState, ...]
    random: bytes
    learner: LearnerState
    goals: GoalsState
    aversions: tuple[Aversion, ...]
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
    """A generator that continues the stream of the one that `random_state` was given.

    Raises:
        UnreadableMemoryError: if `state` is of no generator.
    """
    try:
        saved: dict[str, Any] = json.loads(state)
        bits: Any = _GENERATORS[saved["bit_generator"]](0)
        bits.state = saved
        generator = Generator(bits)
        # numpy takes a position past the end of its buffers, and reads there.
        position, end = _positions(saved)
        possible = 0 <= position <= end and random_state(generator) == state
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError) as error:
        raise _unreadable(f"no state of a random generator ({error})") from error
    if not possible:
        raise _unreadable("no state of a random generator")
    return generator


def _positions(saved: dict[str, Any]) -> tuple[int, int]:
    """The position of a generator in its buffer, and the end of that; 0 where it has none."""
    match saved["bit_generator"]:
        case "MT19937":
            return saved["state"]["pos"], len(saved["state"]["key"])
        case "Philox":
            return saved["buffer_pos"], len(saved["buffer"])
        case _:
            return 0, 0


def compress(value: object) -> bytes:
    """A struct as compressed MessagePack.

    Raises:
        ValueError: if it is longer than `MAX_UNPACKED`.
    """
    # An int in a float field becomes a float on decoding. It is converted before encoding too, so
    # that a value that is decoded and encoded again gives the same bytes.
    plain = msgspec.msgpack.encode(value)
    plain = msgspec.msgpack.encode(msgspec.msgpack.decode(plain, type=type(value)))
    if len(plain) > MAX_UNPACKED:
        raise ValueError(f"expected a model of at most {MAX_UNPACKED} bytes, found {len(plain)}")
    packed = zlib.compress(plain)
    return packed if len(plain) <= _most_unpacked(packed) else zlib.compress(plain, level=0)


def decompress(data: bytes, kind: type[_T]) -> _T:
    """The struct that `compress` was given.

    Raises:
        UnreadableMemoryError: if `data` is not such a struct, or unpacks to too much.
    """
    stream, most = zlib.decompressobj(), _most_unpacked(data)
    try:
        plain = stream.decompress(data, most)
        if not stream.eof and stream.decompress(stream.unconsumed_tail, 1):
            raise _unreadable(f"more than {most} bytes in {len(data)}")
        if not stream.eof or stream.unused_data:
            raise _unreadable("data that ends too early or too late")
        return msgspec.msgpack.decode(plain, type=kind)
    except (zlib.error, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise _unreadable(str(error)) from error


def _most_unpacked(packed: bytes) -> int:
    return min(MAX_UNPACKED, _MIB + MAX_RATIO * len(packed))


def _unreadable(found: str) -> UnreadableMemoryError:
    return UnreadableMemoryError(
        f"a model's memory: expected what format {FORMAT} holds, found: {found}"
    )


def written(state: ModelState) -> bytes:
    """A model as bytes."""
    body = compress(state)
    return _HEADER.pack(_MAGIC, FORMAT, len(body), zlib.crc32(body)) + body


def read(data: bytes) -> ModelState:
    """The model that was `written`, checked.

    Raises:
        TypeError: if `data` is no bytes.
        UnreadableMemoryError: if `data` is not the whole of such a model.
    """
    if not isinstance(data, bytes | bytearray | memoryview):
        raise TypeError(f"a model's memory: expected the bytes of save(), found {shown(data)}")
    state = decompress(_checked_body(data), ModelState)
    try:
        _check(state)
    except ValueError as error:
        raise _unreadable(f"lists that no model has: {error}") from error
    return state


def _check(state: ModelState) -> None:
    actions, learner = ActionList({}), state.learner
    actions.restore(state.action_costs)
    lists = CheckedLists(actions, state.parameters, learner.signs, learner.hypotheses)
    lists.check_learner(learner)
    lists.check_due(learner, awaits_action=state.awaits_action)
    lists.check_active(state.active)
    check_goal_list(state.goals)
    checked(state.aversions)
    for when, goal, priority in map(msgspec.structs.astuple, state.inherent):
        InherentGoal(when, goal, 0.0 if priority is None else priority)
    if state.chosen is not None:
        actions.id_of(state.chosen)


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
