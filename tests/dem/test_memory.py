"""A loaded model continues exactly as the one that was saved."""

import struct
import zlib
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, cycles
from restless import parameters as restless_parameters

from farside.dem import (
    Aside,
    DynamicExpectancyModel,
    InherentGoal,
    Parameters,
    Sensed,
    UnreadableMemoryError,
)
from tests.dem.conftest import Event, Eventful, Live

HEADER = struct.Struct("<8sHQI")
KINDS = ["MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64"]

# Goals of the robot's own, two of them the same, which are also set and reached otherwise.
RULES = [
    InherentGoal(when=("a",), goal=("b",), priority=1),
    InherentGoal(when=("c",), goal=("b",), priority=2),
    InherentGoal(when=("a",), goal=("c", "d"), priority=3),
]


def drawn(model: DynamicExpectancyModel) -> list[float]:
    """What the model's random generator would give next."""
    return [float(draw) for draw in model._rng.random(3)]


def restless_model(kind: str = "PCG64") -> DynamicExpectancyModel:
    inherent = [InherentGoal(when=("a",), goal=("b", "c"), priority=1)]
    bits = getattr(np.random, kind)(3)
    return DynamicExpectancyModel(
        COSTS, PARAMETERS, rng=np.random.Generator(bits), inherent=inherent
    )


@given(
    parameters=restless_parameters,
    lived=st.integers(0, 120),
    before=st.lists(cycles),
    after=st.lists(cycles),
)
def test_a_loaded_model_continues_exactly_as_the_saved_one(
    eventful: Eventful,
    live: Live,
    *,
    parameters: Parameters,
    lived: int,
    before: list[Event],
    after: list[Event],
) -> None:
    rng = np.random.default_rng(1)
    model = DynamicExpectancyModel(COSTS, parameters, rng=rng, inherent=RULES)
    live(model, eventful(lived) + before)
    loaded = DynamicExpectancyModel.load(model.save())

    assert live(loaded, after) == live(model, after)
    assert (loaded.signs, loaded.hypotheses) == (model.signs, model.hypotheses)
    assert loaded.save() == model.save()
    assert drawn(loaded) == drawn(model)


@pytest.mark.parametrize(("kind", "cut"), [*zip(KINDS, [1, 20, 90, 150, 250], strict=True)])
def test_a_long_stream_can_be_interrupted_with_any_bit_generator(
    eventful: Eventful, live: Live, kind: str, cut: int
) -> None:
    stream = eventful(300)
    model = restless_model(kind)
    live(model, stream[:cut])
    loaded = DynamicExpectancyModel.load(model.save())

    assert live(loaded, stream[cut:]) == live(model, stream[cut:])
    assert loaded.hypotheses == model.hypotheses
    assert drawn(loaded) == drawn(model)


def test_that_long_stream_exercises_everything_that_has_to_be_saved(
    eventful: Eventful, live: Live
) -> None:
    model = restless_model()
    sensed, signs = list[Sensed](), set[tuple[str, ...]]()
    for cycle in eventful(480):
        sensed.append(cast("Sensed", live(model, [cycle])[0]))
        signs.update(model.signs)
    kept = model._learner.state()

    assert sum(one.removed for one in sensed) > 50
    told = {goal.aside for one in sensed for goal in one.suspended}
    assert told == {Aside.BLOCKED, Aside.UNREACHABLE}
    assert max(len(one.context) for one in model.hypotheses) > 1
    assert {one.delay for one in model.hypotheses} == {1, 2}
    assert kept.hypotheses.free
    assert kept.differentiation.watches
    assert all(kept.predictions)


def test_early_in_that_stream_a_sign_is_removed(eventful: Eventful, live: Live) -> None:
    model = restless_model()
    signs: set[tuple[str, ...]] = set()
    for cycle in eventful(30):
        live(model, [cycle])
        signs.update(model.signs)

    assert signs - set(model.signs) == {("a", "b")}
    assert model._learner.state().signs.free


def test_a_model_can_be_saved_between_choosing_and_performing(
    eventful: Eventful, live: Live
) -> None:
    model = restless_model()
    live(model, eventful(200))
    model.set_goal(["b"], 1)
    model.sense(["a", "d"])
    model.choose()
    loaded = DynamicExpectancyModel.load(model.save())

    for one in (model, loaded):
        with pytest.raises(RuntimeError, match=r"sense\(\) twice"):
            one.sense(["a"])
        one.perform("go")
    assert live(loaded, eventful(300)[200:]) == live(model, eventful(300)[200:])


def test_a_suspended_goal_recovers_on_time_after_loading(eventful: Eventful, live: Live) -> None:
    model, stream = restless_model(), eventful(300)
    while not any(goal.aside is Aside.BLOCKED for goal in model.goals):
        live(model, [stream.pop(0)])
    loaded = DynamicExpectancyModel.load(model.save())

    assert loaded.goals == model.goals
    assert live(loaded, stream) == live(model, stream)


def test_saving_changes_nothing(eventful: Eventful, live: Live) -> None:
    model, other = restless_model(), restless_model()
    for cycle in eventful(100):
        assert live(model, [cycle]) == live(other, [cycle])
        model.save()


@given(parameters=restless_parameters, lived=st.integers(0, 120), stream=st.lists(cycles))
def test_saving_a_loaded_model_gives_the_same_bytes(
    eventful: Eventful, live: Live, parameters: Parameters, lived: int, stream: list[Event]
) -> None:
    model = DynamicExpectancyModel(COSTS, parameters, rng=np.random.default_rng(1))
    live(model, eventful(lived) + stream)
    saved = model.save()

    assert DynamicExpectancyModel.load(saved).save() == saved


@pytest.fixture(scope="module")
def saved(eventful: Eventful, live: Live) -> bytes:
    model = restless_model()
    live(model, eventful(40))
    return model.save()


def test_data_truncated_anywhere_is_refused(saved: bytes) -> None:
    for length in range(len(saved)):
        with pytest.raises(UnreadableMemoryError, match="expected"):
            DynamicExpectancyModel.load(saved[:length])


def test_data_with_any_byte_changed_is_refused(saved: bytes) -> None:
    rng = np.random.default_rng(2)
    for at, flip in enumerate(rng.integers(1, 256, len(saved)).tolist()):
        damaged = saved[:at] + bytes([saved[at] ^ flip]) + saved[at + 1 :]
        with pytest.raises(UnreadableMemoryError, match="expected"):
            DynamicExpectancyModel.load(damaged)


@settings(max_examples=300)
@given(data=st.binary(max_size=60))
def test_arbitrary_data_is_refused(data: bytes) -> None:
    with pytest.raises(UnreadableMemoryError, match="a model's memory: expected"):
        DynamicExpectancyModel.load(data)


def test_the_message_says_what_is_wrong(saved: bytes) -> None:
    magic, _, length, check = HEADER.unpack_from(saved)
    body = saved[HEADER.size :]
    with pytest.raises(UnreadableMemoryError, match=r"begin with b'FARSIDE.*found b'GIF89a'$"):
        DynamicExpectancyModel.load(b"GIF89a")
    with pytest.raises(UnreadableMemoryError, match="expected format 4, found format 3"):
        DynamicExpectancyModel.load(HEADER.pack(magic, 3, length, check) + body)
    with pytest.raises(UnreadableMemoryError, match=f"{length} bytes after .* {length + 1}$"):
        DynamicExpectancyModel.load(saved + b"\0")
    with pytest.raises(UnreadableMemoryError, match="is damaged: expected CRC-32"):
        DynamicExpectancyModel.load(saved[:-1] + bytes([saved[-1] ^ 1]))


@pytest.mark.parametrize("body", [b"", zlib.compress(b""), zlib.compress(b"\x90")])
def test_wrong_contents_are_refused_even_with_the_right_checksum(body: bytes) -> None:
    data = HEADER.pack(b"FARSIDE\0", 4, len(body), zlib.crc32(body)) + body
    with pytest.raises(UnreadableMemoryError, match="expected what format 4 holds, found"):
        DynamicExpectancyModel.load(data)


def test_a_bit_generator_of_unknown_kind_is_refused() -> None:
    class Foreign:
        state = {"bit_generator": "Foreign"}  # noqa: RUF012

    class Rng(np.random.Generator):
        bit_generator = Foreign()  # type: ignore[assignment]

    model = DynamicExpectancyModel(COSTS, rng=Rng(np.random.PCG64(1)))
    with pytest.raises(TypeError, match=r"expected one of MT19937, .* found Foreign"):
        model.save()
