"""Frames on the wire: what one end sealed the other opens, and nothing else does."""

import zlib
from contextlib import suppress
from itertools import pairwise

import msgspec
import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.link.endpoint.fragments import Fragmenter, Reassembler
from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.wire import (
    OVERHEAD_BYTE,
    REPLAY_WINDOW,
    SEQUENCE_LIMIT,
    WIRE_VERSION,
    Flag,
    FrameError,
    Opened,
    Opener,
    Refusal,
    Sealer,
    SequenceExhaustedError,
    unpack,
)
from farside.messages import Command, Downlink, Drive, Uplink
from farside.node import Direction

UP, DOWN = Direction.UP, Direction.DOWN
KEY = simulated_key(7)


class From:
    """Numbers from a certain one on, as after a restart; remembers what was asked for."""

    def __init__(self, first, ahead=SEQUENCE_LIMIT):
        self.first, self.ahead, self.asked = first, ahead, []

    def reserve(self, sequence):
        self.asked.append(sequence)
        return sequence + self.ahead


def sealer(direction=UP, *, first=0, key=KEY):
    return Sealer(key, direction, From(first))


def with_crc(content):
    return content + zlib.crc32(content).to_bytes(4, "little")


def refusal(opener, wire):
    with pytest.raises(FrameError) as caught:
        opener.open(wire)
    return caught.value.reason


flags = st.integers(0, 15).map(Flag)


@given(
    st.binary(max_size=2000), flags, st.integers(0, SEQUENCE_LIMIT - 1), st.sampled_from(Direction)
)
def test_what_is_sealed_is_opened_as_it_was(body, flag, sequence, direction):
    wire = sealer(direction, first=sequence).seal(body, flag)

    assert Opener(KEY, direction).open(wire) == Opened(sequence, flag, body)
    assert wire == sealer(direction, first=sequence).seal(body, flag)


@pytest.mark.parametrize(
    ("sequence", "overhead_byte"),
    [(0, 23), (255, 23), (256, 24), (65_536, 25), (2**24 - 1, 25), (2**24, 26), (2**32 - 1, 26)],
)
def test_a_frame_is_as_long_as_documented(sequence, overhead_byte):
    assert len(sealer(first=sequence).seal(b"12345")) == 5 + overhead_byte
    assert overhead_byte <= OVERHEAD_BYTE


def test_the_bytes_are_those_of_the_documented_format():
    info = b"farside link 3 down"
    key = HKDF(algorithm=SHA256(), length=32, salt=None, info=info).derive(KEY)
    header = bytes((3, 0b001010_01, 1, 44))
    nonce = b"down" + (300).to_bytes(8, "big")
    plain = header + AESGCM(key).encrypt(nonce, b"hello", header)

    wire = sealer(DOWN, first=300).seal(b"hello", Flag.STORED | Flag.REPORT)

    assert wire == plain + zlib.crc32(plain).to_bytes(4, "little")


def test_frames_are_numbered_one_after_the_other():
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)

    assert [rover.open(ground.seal(b"")).sequence for _ in range(300)] == list(range(300))
    assert ground.next_sequence == 300


def test_a_key_of_another_length_is_refused():
    with pytest.raises(ValueError, match="expected a mission key of 32 bytes, found 16"):
        Sealer(bytes(16), UP)


# --- noise -------------------------------------------------------------------------------------


@given(st.binary(max_size=200), st.data())
def test_up_to_three_flipped_bits_are_noise_whichever_they_are(body, data):
    rover, wire = Opener(KEY, UP), sealer().seal(body)
    bits = data.draw(st.sets(st.integers(0, 8 * len(wire) - 1), min_size=1, max_size=3))
    noisy = bytearray(wire)
    for bit in bits:
        noisy[bit // 8] ^= 1 << bit % 8

    assert refusal(rover, bytes(noisy)) is Refusal.CORRUPTED
    assert rover.open(wire).body == body


@pytest.mark.parametrize("length", range(28))
def test_a_frame_cut_short_is_refused(length):
    wire = sealer().seal(b"12345")
    reason = Refusal.TRUNCATED if length < 23 else Refusal.CORRUPTED

    assert refusal(Opener(KEY, UP), wire[:length]) is reason


# --- strangers ---------------------------------------------------------------------------------


def test_a_frame_of_any_other_version_is_named_so():
    wire = sealer().seal(b"12345")
    others = [version for version in range(256) if version != WIRE_VERSION]

    for version in others:
        foreign = with_crc(bytes((version,)) + wire[1:-4])
        assert refusal(Opener(KEY, UP), foreign) is Refusal.VERSION


def test_a_frame_of_another_mission_is_forged():
    assert refusal(Opener(KEY, UP), sealer(key=simulated_key(8)).seal(b"x")) is Refusal.FORGED


def test_flags_from_the_future_are_malformed():
    rover = Opener(KEY, UP)

    assert refusal(rover, sealer().seal(b"x", 32)) is Refusal.MALFORMED


def test_a_refusal_says_what_was_found_and_is_counted():
    rover, wire = Opener(KEY, UP), sealer().seal(b"12345")
    rover.open(wire)
    for frame in (wire, wire, b"", with_crc(b"\x07" + bytes(30))):
        refusal(rover, frame)

    assert rover.refused == {Refusal.REPLAYED: 2, Refusal.TRUNCATED: 1, Refusal.VERSION: 1}
    with pytest.raises(FrameError, match=r"^up frame replayed: expected each frame once, found 0"):
        rover.open(wire)


# --- somebody who sees every frame ----------------------------------------------------------------


def test_an_attacker_cannot_replay():
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)
    seen = [ground.seal(bytes((n % 256,))) for n in range(3 * REPLAY_WINDOW)]
    for wire in seen:
        rover.open(wire)

    assert {refusal(rover, wire) for wire in seen} == {Refusal.REPLAYED}


def test_an_attacker_cannot_replay_to_a_rover_that_restarted():
    numbers = From(0, ahead=10)
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP, numbers)
    seen = [ground.seal(b"drive") for _ in range(25)]
    for wire in seen:
        rover.open(wire)
    restarted = Opener(KEY, UP, From(numbers.asked[-1] + numbers.ahead))

    assert {refusal(restarted, wire) for wire in seen} == {Refusal.REPLAYED}
    assert restarted.open(sealer(first=30).seal(b"new")).body == b"new"


def test_an_attacker_cannot_turn_a_frame_back():
    wire = Sealer(KEY, UP).seal(b"drive")

    assert refusal(Opener(KEY, DOWN), wire) is Refusal.FORGED


@given(st.data())
def test_an_attacker_who_mends_the_crc_cannot_change_a_byte(data):
    wire = sealer(first=70_000).seal(b"drive north", Flag.RELIABLE)
    changed = bytearray(wire[:-4])
    changed[data.draw(st.integers(1, len(changed) - 1))] ^= data.draw(st.integers(1, 255))

    assert refusal(Opener(KEY, UP), with_crc(bytes(changed))) is Refusal.FORGED


@given(st.integers(0, 40))
def test_an_attacker_who_mends_the_crc_cannot_cut_or_lengthen_a_frame(length):
    wire = sealer().seal(b"drive north")
    rover = Opener(KEY, UP)

    if length < len(wire) - 4:
        expected = {Refusal.FORGED, Refusal.TRUNCATED}
        assert refusal(rover, with_crc(wire[:length])) in expected
    assert refusal(rover, with_crc(wire[:-4] + bytes(length + 1))) is Refusal.FORGED


def test_an_attacker_cannot_splice_the_fragments_of_two_messages():
    rover, reassembler, fragmenter = Opener(KEY, UP), Reassembler(10**9), Fragmenter(64)
    ground = Sealer(KEY, UP)
    frames = []
    for message in (b"a" * 60, b"b" * 60):
        parts = fragmenter.cut(message, ground.next_sequence)
        frames.append([ground.seal(part, Flag.FRAGMENT) for part in parts])
    first, second = frames
    assert len(first) == len(second) == 2

    # Bytes of one frame in another are forged; whole frames, mixed at will, do not fit together.
    header_byte = 3
    mixed = with_crc(first[1][:header_byte] + second[1][header_byte:-4])
    assert refusal(rover, mixed) is Refusal.FORGED
    for wire in (first[0], second[1]):
        assert reassembler.add(rover.open(wire).body, 0) is None
    assert reassembler.add(rover.open(first[1]).body, 0) == b"a" * 60


@given(st.lists(st.integers(0, 30), max_size=10))
def test_forgeries_do_not_move_the_replay_window(claimed):
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)
    stranger = simulated_key(8)
    for bits in claimed:
        refusal(rover, sealer(first=2**bits, key=stranger).seal(b"x"))

    assert rover.open(ground.seal(b"genuine")) == Opened(0, Flag(0), b"genuine")


# --- the window --------------------------------------------------------------------------------


def test_frames_may_come_in_any_order_within_the_window():
    wires = [sealer(first=n).seal(b"") for n in range(REPLAY_WINDOW)]
    rover = Opener(KEY, UP)

    opened = [rover.open(wire).sequence for wire in reversed(wires)]

    assert opened == list(reversed(range(REPLAY_WINDOW)))


def test_a_frame_from_before_the_window_is_refused():
    rover = Opener(KEY, UP)
    rover.open(sealer(first=REPLAY_WINDOW).seal(b""))

    assert rover.open(sealer(first=1).seal(b"")).sequence == 1
    assert refusal(rover, sealer(first=0).seal(b"")) is Refusal.REPLAYED


def test_a_leap_to_the_last_number_costs_no_memory():
    rover = Opener(KEY, UP)
    for sequence in (0, SEQUENCE_LIMIT - 1):
        rover.open(sealer(first=sequence).seal(b""))

    assert refusal(rover, sealer().seal(b"")) is Refusal.REPLAYED


@given(st.lists(st.integers(0, 60)), st.integers(1, 20))
def test_the_window_is_that_of_a_receiver_with_a_perfect_memory(sequences, window):
    rover, taken = Opener(KEY, UP, window=window), set()
    for sequence in sequences:
        wire = sealer(first=sequence).seal(b"")
        if sequence in taken or sequence <= max(taken, default=-1) - window:
            assert refusal(rover, wire) is Refusal.REPLAYED
        else:
            assert rover.open(wire).sequence == sequence
            taken.add(sequence)


# --- numbers -----------------------------------------------------------------------------------


def test_numbers_are_reserved_before_they_are_used():
    numbers = From(5, ahead=10)
    ground = Sealer(KEY, UP, numbers)
    for _ in range(21):
        ground.seal(b"")

    assert numbers.asked == [5, 15, 25]


def test_nothing_is_sealed_with_a_number_that_could_not_be_reserved():
    class FullDisk(From):
        def reserve(self, sequence):
            raise OSError(f"no space left for {sequence}")

    ground = Sealer(KEY, UP, FullDisk(5))
    with pytest.raises(OSError, match="no space"):
        ground.seal(b"")
    assert ground.next_sequence == 5


def test_after_the_last_number_a_new_key_is_asked_for():
    ground = sealer(first=SEQUENCE_LIMIT - 1)
    ground.seal(b"")

    with pytest.raises(SequenceExhaustedError, match=r"all of them used: give both ends a new"):
        ground.seal(b"")


# --- whatever arrives --------------------------------------------------------------------------


@st.composite
def near_misses(draw):
    """Bytes that were a frame once."""
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
def test_no_bytes_raise_anything_but_the_one_error(frames):
    rover = Opener(KEY, UP)
    pairs = [first + second for first, second in pairwise(frames)]
    opened = 0
    for wire in frames + pairs:
        with suppress(FrameError):
            rover.open(wire)
            opened += 1
    assert rover.refused.total() + opened == len(frames + pairs)


@given(st.binary(max_size=100), st.binary(max_size=100))
def test_two_frames_in_one_are_refused(one, other):
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
def test_a_body_that_is_no_message_is_malformed(decoder, body):
    with pytest.raises(FrameError, match="expected a message") as caught:
        unpack(body, decoder)
    assert caught.value.reason is Refusal.MALFORMED


messages = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)
fields = ["type", "number", "expires_ns", "order", "tokens", "goal", "path", "events", "action"]
tags = ["command", "heartbeat", "proposal", "telemetry", "drive", "goal", "mode"]


@given(
    st.binary(max_size=60)
    | st.dictionaries(st.sampled_from(fields), st.sampled_from(tags) | messages).map(
        msgspec.msgpack.encode
    ),
    st.sampled_from(DECODERS),
    st.binary(max_size=3),
)
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_no_body_raises_anything_but_the_one_error(body, decoder, tail):
    with suppress(FrameError):
        found = msgspec.msgpack.encode(unpack(body + tail, decoder))
        assert msgspec.msgpack.encode(unpack(found, decoder)) == found


def test_a_message_is_unpacked():
    command = Command(1, 99, Drive("N"))

    assert unpack(msgspec.msgpack.encode(command), DECODERS[0]) == command
