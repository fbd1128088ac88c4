"""Saved models and deltas made to do harm are refused, in one error and little memory.

A body is taken apart, changed in one place, and sealed again with the right length and checksum, so
that nothing but what it says can be found wrong.
"""

import random
import struct
import tracemalloc
import zlib
from contextlib import suppress
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS

from farside.dem import (
    Delta,
    DeltaError,
    DynamicExpectancyModel,
    InherentGoal,
    ShadowModel,
    UnreadableMemoryError,
)
from farside.dem.memory import MAX_RATIO

HEADER = struct.Struct("<8sHQI")
MIB = 2**20


def lived(eventful: Any, live: Any, kind: str = "PCG64") -> DynamicExpectancyModel:
    """A model with something in every list."""
    rng = np.random.Generator(getattr(np.random, kind)(3))
    rules = [InherentGoal(when=("a",), goal=("b", "c"), priority=1)]
    model = DynamicExpectancyModel(COSTS, PARAMETERS, rng=rng, inherent=rules)
    model.record_changes()
    live(model, eventful(90))
    return model


@pytest.fixture(scope="module")
def body(eventful: Any, live: Any) -> bytes:
    """The MessagePack in a saved model."""
    return zlib.decompress(lived(eventful, live).save()[HEADER.size :])


def dice(seed: int) -> random.Random:
    """What to change, and where, drawn alike on every run."""
    return random.Random(seed)  # noqa: S311 - no secrets


def sealed(body: bytes) -> bytes:
    """A saved model of this body, as far as length and checksum go."""
    packed = zlib.compress(body)
    return HEADER.pack(b"FARSIDE\0", 4, len(packed), zlib.crc32(packed)) + packed


def is_refused_or_lives(data: bytes) -> bool:
    """Load it; a model that comes of it can be used and saved. Whether one does."""
    try:
        model = DynamicExpectancyModel.load(data)
    except UnreadableMemoryError:
        return False
    if model._awaits_action:
        model.perform("go")
    for tokens in (["a", "b"], ["c"], ["a", "d", "e"], ["b", "f"]):
        model.sense(tokens)
        model.perform(model.choose().action)
    model.policy_map()
    DynamicExpectancyModel.load(model.save())
    return True


@settings(max_examples=400)
@given(at=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_a_body_with_any_byte_changed_is_refused_or_is_a_model(
    body: bytes, at: float, flip: int
) -> None:
    place = int(at * len(body))
    is_refused_or_lives(sealed(body[:place] + bytes([body[place] ^ flip]) + body[place + 1 :]))


def test_many_bytes_changed_at_once_are_refused_or_are_a_model(body: bytes) -> None:
    rng = dice(4)
    for _ in range(400):
        changed = bytearray(body)
        for _ in range(rng.randint(1, 6)):
            changed[rng.randrange(len(changed))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF))
        is_refused_or_lives(sealed(bytes(changed)))


def values(tree: Any, way: tuple[int | str, ...] = ()) -> Any:
    """Every place in a decoded body, as the way that leads there."""
    yield way
    if isinstance(tree, list):
        for index, inner in enumerate(tree):
            yield from values(inner, (*way, index))
    elif isinstance(tree, dict):
        for key, inner in tree.items():
            yield from values(inner, (*way, key))


def test_any_value_replaced_by_any_other_is_refused_or_is_a_model(body: bytes) -> None:
    rng = dice(5)
    ways = [way for way in values(msgspec.msgpack.decode(body)) if way]
    others: list[Any] = [
        *(
            -1,
            0,
            1,
            2**31 - 1,
            2**31,
            2**63,
            float("nan"),
            float("inf"),
            -1.5,
            True,
            None,
            "",
            "zz",
        ),
        *([], [[]], {}, b"", b"\xff" * 7, b"\xff" * 64, b"{}", [0, 0], [2**40], ["b", "a"]),
        *(b"[" * 9000, b'{"bit_generator":"MT19937","state":{"key":[],"pos":9}}'),
    ]
    for _ in range(1200):
        tree = msgspec.msgpack.decode(body)
        *way, last = rng.choice(ways)
        place = tree
        for step in way:
            place = place[step]
        place[last] = rng.choice(others)
        is_refused_or_lives(sealed(msgspec.msgpack.encode(tree)))


@pytest.mark.parametrize(
    ("kind", "position"), [("MT19937", 625), ("MT19937", -1), ("Philox", 5), ("Philox", -1)]
)
def test_a_generator_is_not_made_to_read_past_its_buffer(
    eventful: Any, live: Any, kind: str, position: int
) -> None:
    body = zlib.decompress(lived(eventful, live, kind).save()[HEADER.size :])
    tree = msgspec.msgpack.decode(body)
    random_state = msgspec.json.decode(tree[3])
    if kind == "MT19937":
        random_state["state"]["pos"] = position
    else:
        random_state["buffer_pos"] = position
    tree[3] = msgspec.json.encode(random_state)
    with pytest.raises(UnreadableMemoryError, match="no state of a random generator"):
        DynamicExpectancyModel.load(sealed(msgspec.msgpack.encode(tree)))


@pytest.mark.parametrize(
    "content",
    [
        b"\0" * (64 * MIB),
        b"\xdd\x03\xff\xff\xff" + b"\x90" * (64 * MIB),
        b"\x9a\x81\xa1a\x01\x80\x90\xc4\x00\x98\x94\xdd\x02\x00\x00\x00" + b"\x91\xa0" * (16 * MIB),
    ],
    ids=["zeros", "empty arrays", "empty Signs"],
)
def test_a_small_file_does_not_unpack_into_a_large_one(content: bytes) -> None:
    bomb = sealed(content)
    tracemalloc.start()
    with pytest.raises(UnreadableMemoryError, match="found: more than"):
        DynamicExpectancyModel.load(bomb)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * (MIB + MAX_RATIO * len(bomb))


def test_a_model_that_compresses_better_than_a_bomb_may_is_saved_all_the_same() -> None:
    model = DynamicExpectancyModel({"x": 1.0}, rng=np.random.default_rng(1))
    model.sense(["y" * (8 * MIB)])
    assert DynamicExpectancyModel.load(model.save()).signs == model.signs


# --- deltas ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["whole", "take_delta"])
def test_a_delta_with_bytes_changed_is_refused_or_leaves_a_shadow_that_can_be_used(
    eventful: Any, live: Any, kind: str
) -> None:
    rng = dice(6)
    model = lived(eventful, live)
    first = model.take_delta()
    live(model, eventful(180)[90:])
    delta = msgspec.msgpack.encode(getattr(model, kind)())
    for _ in range(600):
        shadow = ShadowModel(COSTS, PARAMETERS)
        shadow.apply(first)
        changed = bytearray(delta)
        for _ in range(rng.randint(1, 3)):
            changed[rng.randrange(len(changed))] = rng.randrange(256)
        try:
            hostile = msgspec.msgpack.decode(changed, type=Delta)
        except (msgspec.DecodeError, UnicodeDecodeError):
            continue
        with suppress(DeltaError, UnreadableMemoryError):
            shadow.apply(hostile)
        shadow.policy_map()
        shadow.value(["a"])
        assert len(shadow.hypotheses) == shadow._hypotheses.count


def test_after_an_impossible_change_a_shadow_is_empty_until_the_next_whole(
    eventful: Any, live: Any
) -> None:
    model, shadow = lived(eventful, live), ShadowModel(COSTS, PARAMETERS)
    shadow.apply(model.take_delta())
    live(model, eventful(91)[90:])
    delta = msgspec.structs.replace(model.take_delta(), changes=(-7, 3 * 10**9))

    with pytest.raises(DeltaError, match="expected a known hypothesis, found -3: ask for a whole"):
        shadow.apply(delta)
    assert (shadow.signs, shadow.hypotheses, shadow.goals) == ((), (), ())
    shadow.apply(model.whole())
    assert shadow.hypotheses == model.hypotheses
