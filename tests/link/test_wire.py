"""Frames on the wire: what one end sealed the other opens, and nothing else does."""

import zlib
from contextlib import suppress
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.strategies._internal.core import DataObject
from wires import DOWN, KEY, UP, refusal, sealer, with_crc

from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.wire import (
    OVERHEAD_BYTE,
    SEQUENCE_LIMIT,
    WIRE_VERSION,
    Flag,
    FrameError,
    Opened,
    Opener,
    Refusal,
    Sealer,
    unpack,
)
from farside.messages import Command, Downlink, Drive, Uplink
from farside.node import Direction

flags = st.integers(0, 15).map(Flag)


@given(
    st.binary(max_size=2000), flags, st.integers(0, SEQUENCE_LIMIT - 1), st.sampled_from(Direction)
)
def test_opening_restores_what_was_sealed(
    body: bytes, flag: Flag, sequence: int, direction: Direction
) -> None:
    wire = sealer(direction, first=sequence).seal(body, flag)

    assert Opener(KEY, direction).open(wire) == Opened(sequence, flag, body)
    assert wire == sealer(direction, first=sequence).seal(body, flag)


@pytest.mark.parametrize(
    ("sequence", "overhead_byte"),
    [(0, 23), (255, 23), (256, 24), (65_536, 25), (2**24 - 1, 25), (2**24, 26), (2**32 - 1, 26)],
)
def test_a_frame_is_as_long_as_documented(sequence: int, overhead_byte: int) -> None:
    assert len(sealer(first=sequence).seal(b"12345")) == 5 + overhead_byte
    assert overhead_byte <= OVERHEAD_BYTE


def test_the_bytes_are_those_of_the_documented_format() -> None:
    info = b"farside link 5 down"
    key = HKDF(algorithm=SHA256(), length=32, salt=None, info=info).derive(KEY)
    header = bytes((5, 0b001010_01, 1, 44))
    nonce = b"down" + (300).to_bytes(8, "big")
    plain = header + AESGCM(key).encrypt(nonce, b"hello", header)

    wire = sealer(DOWN, first=300).seal(b"hello", Flag.STORED | Flag.REPORT)

    assert wire == plain + zlib.crc32(plain).to_bytes(4, "little")


def test_frames_are_numbered_one_after_the_other() -> None:
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)

    assert [rover.open(ground.seal(b"")).sequence for _ in range(300)] == list(range(300))
    assert ground.next_sequence == 300


def test_a_key_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a mission key of 32 bytes, found 16"):
        Sealer(bytes(16), UP)


# --- noise -------------------------------------------------------------------------------------


@given(st.binary(max_size=200), st.data())
def test_up_to_three_flipped_bits_anywhere_are_noise(body: bytes, data: DataObject) -> None:
    rover, wire = Opener(KEY, UP), sealer().seal(body)
    bits = data.draw(st.sets(st.integers(0, 8 * len(wire) - 1), min_size=1, max_size=3))
    noisy = bytearray(wire)
    for bit in bits:
        noisy[bit // 8] ^= 1 << bit % 8

    assert refusal(rover, bytes(noisy)) is Refusal.CORRUPTED
    assert rover.open(wire).body == body


@pytest.mark.parametrize("length", range(28))
def test_a_frame_cut_short_is_refused(length: int) -> None:
    wire = sealer().seal(b"12345")
    reason = Refusal.TRUNCATED if length < 23 else Refusal.CORRUPTED

    assert refusal(Opener(KEY, UP), wire[:length]) is reason


# --- strangers ---------------------------------------------------------------------------------


def test_a_frame_of_any_other_version_is_refused_as_such() -> None:
    wire = sealer().seal(b"12345")
    others = [version for version in range(256) if version != WIRE_VERSION]

    for version in others:
        foreign = with_crc(bytes((version,)) + wire[1:-4])
        assert refusal(Opener(KEY, UP), foreign) is Refusal.VERSION


def test_a_frame_of_another_mission_is_forged() -> None:
    assert refusal(Opener(KEY, UP), sealer(key=simulated_key(8)).seal(b"x")) is Refusal.FORGED


def test_flags_from_the_future_are_malformed() -> None:
    rover = Opener(KEY, UP)

    assert refusal(rover, sealer().seal(b"x", Flag(32))) is Refusal.MALFORMED


def test_a_refusal_says_what_was_found_and_is_counted() -> None:
    rover, wire = Opener(KEY, UP), sealer().seal(b"12345")
    rover.open(wire)
    for frame in (wire, wire, b"", with_crc(b"\x07" + bytes(30))):
        refusal(rover, frame)

    assert rover.refused == {Refusal.REPLAYED: 2, Refusal.TRUNCATED: 1, Refusal.VERSION: 1}
    with pytest.raises(FrameError, match=r"^up frame replayed: expected each frame once, found 0"):
        rover.open(wire)


# --- whatever arrives --------------------------------------------------------------------------


@st.composite
def near_misses(draw: st.DrawFn) -> bytes:
    """Frames changed in a few places."""
    wire = bytearray(sealer(first=draw(st.integers(0, 70_000))).seal(draw(st.binary(max_size=40))))
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(wire)))
        cut = draw(st.integers(0, 8))
        wire[at : at + cut] = draw(st.binary(max_size=8))
    return bytes(wire) if draw(st.booleans()) else with_crc(bytes(wire[:-4]))


arrivals = st.lists(
    st.binary(max_size=80)
    | near_misses()
    | st.binary(max_size=80).map(with_crc)
    | st.binary(max_size=80).map(lambda rest: with_crc(bytes((WIRE_VERSION,)) + rest)),
    max_size=8,
)


@given(arrivals)
def test_no_bytes_raise_anything_but_frame_error(frames: list[bytes]) -> None:
    rover = Opener(KEY, UP)
    pairs = [first + second for first, second in pairwise(frames)]
    opened = 0
    for wire in frames + pairs:
        with suppress(FrameError):
            rover.open(wire)
            opened += 1
    assert rover.refused.total() + opened == len(frames + pairs)


@given(st.binary(max_size=100), st.binary(max_size=100))
def test_two_frames_in_one_are_refused(one: bytes, other: bytes) -> None:
    ground = Sealer(KEY, UP)

    both = ground.seal(one) + ground.seal(other)

    assert refusal(Opener(KEY, UP), both) is Refusal.CORRUPTED


DECODERS = [msgspec.msgpack.Decoder(Uplink), msgspec.msgpack.Decoder(Downlink)]


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\xc1",
        b"\x81\xa4type\xa1\xff",
        b"\x82\xa4type\xa9heartbeat\xa1z" + b"\x91" * 100_000 + b"\xc0",
        b"\x82\xa4type\xa9telemetry\xa1z" + b"\x91" * 100_000 + b"\xc0",
        b"\x82\xa4type\xa8proposal\xa4goal\xdd\xff\xff\xff\xff",
    ],
    ids=["nothing", "never used", "not UTF-8", "deep", "deep", "four thousand million"],
)
@pytest.mark.parametrize("decoder", DECODERS, ids=["up", "down"])
def test_a_body_that_is_no_message_is_malformed(
    decoder: msgspec.msgpack.Decoder[Any], body: bytes
) -> None:
    with pytest.raises(FrameError, match="expected a message") as caught:
        unpack(body, decoder)
    assert caught.value.reason is Refusal.MALFORMED


messages = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)
fields = ["type", "number", "expires_ns", "order", "tokens", "goal", "path", "what", "action"]
fields += ["meant", "force", "stage", "why", "proposal"]
tags = ["command", "heartbeat", "shown", "event", "proposal", "telemetry"]
tags += ["drive", "veto", "goal", "mode", "ended"]


@given(
    st.binary(max_size=60)
    | st.dictionaries(st.sampled_from(fields), st.sampled_from(tags) | messages).map(
        msgspec.msgpack.encode
    ),
    st.sampled_from(DECODERS),
    st.binary(max_size=3),
)
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_no_body_raises_anything_but_frame_error(
    body: bytes, decoder: msgspec.msgpack.Decoder[Any], tail: bytes
) -> None:
    with suppress(FrameError):
        found = msgspec.msgpack.encode(unpack(body + tail, decoder))
        assert msgspec.msgpack.encode(unpack(found, decoder)) == found


def test_a_message_is_unpacked() -> None:
    command = Command(1, 99, Drive("N"))

    assert unpack(msgspec.msgpack.encode(command), DECODERS[0]) == command
