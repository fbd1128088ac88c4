"""Sequence numbers: no attacker gets a frame accepted twice, and no number is used twice."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies._internal.core import DataObject
from wires import DOWN, KEY, UP, From, refusal, sealer, with_crc

from farside.link.endpoint.fragments import Fragmenter, Reassembler
from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.wire import (
    REPLAY_WINDOW,
    SEQUENCE_LIMIT,
    Flag,
    Opened,
    Opener,
    Refusal,
    Sealer,
    SequenceExhaustedError,
)


def test_an_attacker_cannot_replay() -> None:
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)
    seen = [ground.seal(bytes((n % 256,))) for n in range(3 * REPLAY_WINDOW)]
    for wire in seen:
        rover.open(wire)

    assert {refusal(rover, wire) for wire in seen} == {Refusal.REPLAYED}


def test_an_attacker_cannot_replay_to_a_rover_that_restarted() -> None:
    numbers = From(0, ahead=10)
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP, numbers)
    seen = [ground.seal(b"drive") for _ in range(25)]
    for wire in seen:
        rover.open(wire)
    restarted = Opener(KEY, UP, From(numbers.asked[-1] + numbers.ahead))

    assert {refusal(restarted, wire) for wire in seen} == {Refusal.REPLAYED}
    assert restarted.open(sealer(first=30).seal(b"new")).body == b"new"


def test_an_attacker_cannot_reflect_a_frame() -> None:
    wire = Sealer(KEY, UP).seal(b"drive")

    assert refusal(Opener(KEY, DOWN), wire) is Refusal.FORGED


@given(st.data())
def test_an_attacker_who_recomputes_the_crc_cannot_change_a_byte(data: DataObject) -> None:
    wire = sealer(first=70_000).seal(b"drive north", Flag.RELIABLE)
    changed = bytearray(wire[:-4])
    changed[data.draw(st.integers(1, len(changed) - 1))] ^= data.draw(st.integers(1, 255))

    assert refusal(Opener(KEY, UP), with_crc(bytes(changed))) is Refusal.FORGED


@given(st.integers(0, 40))
def test_an_attacker_who_recomputes_the_crc_cannot_shorten_or_extend_a_frame(length: int) -> None:
    wire = sealer().seal(b"drive north")
    rover = Opener(KEY, UP)

    if length < len(wire) - 4:
        expected = {Refusal.FORGED, Refusal.TRUNCATED}
        assert refusal(rover, with_crc(wire[:length])) in expected
    assert refusal(rover, with_crc(wire[:-4] + bytes(length + 1))) is Refusal.FORGED


def test_an_attacker_cannot_splice_the_fragments_of_two_messages() -> None:
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
def test_forgeries_do_not_move_the_replay_window(claimed: Sequence[int]) -> None:
    ground, rover = Sealer(KEY, UP), Opener(KEY, UP)
    stranger = simulated_key(8)
    for bits in claimed:
        refusal(rover, sealer(first=2**bits, key=stranger).seal(b"x"))

    assert rover.open(ground.seal(b"genuine")) == Opened(0, Flag(0), b"genuine")


# --- the window --------------------------------------------------------------------------------


def test_frames_may_come_in_any_order_within_the_window() -> None:
    wires = [sealer(first=n).seal(b"") for n in range(REPLAY_WINDOW)]
    rover = Opener(KEY, UP)

    opened = [rover.open(wire).sequence for wire in reversed(wires)]

    assert opened == list(reversed(range(REPLAY_WINDOW)))


def test_a_frame_from_before_the_window_is_refused() -> None:
    rover = Opener(KEY, UP)
    rover.open(sealer(first=REPLAY_WINDOW).seal(b""))

    assert rover.open(sealer(first=1).seal(b"")).sequence == 1
    assert refusal(rover, sealer(first=0).seal(b"")) is Refusal.REPLAYED


def test_a_jump_to_the_last_sequence_number_takes_no_memory() -> None:
    rover = Opener(KEY, UP)
    for sequence in (0, SEQUENCE_LIMIT - 1):
        rover.open(sealer(first=sequence).seal(b""))

    assert refusal(rover, sealer().seal(b"")) is Refusal.REPLAYED


@given(st.lists(st.integers(0, 60)), st.integers(1, 20))
def test_the_window_decides_as_a_receiver_that_remembers_everything(
    sequences: Sequence[int], window: int
) -> None:
    rover, taken = Opener(KEY, UP, window=window), set[int]()
    for sequence in sequences:
        wire = sealer(first=sequence).seal(b"")
        if sequence in taken or sequence <= max(taken, default=-1) - window:
            assert refusal(rover, wire) is Refusal.REPLAYED
        else:
            assert rover.open(wire).sequence == sequence
            taken.add(sequence)


# --- numbers -----------------------------------------------------------------------------------


def test_numbers_are_reserved_before_they_are_used() -> None:
    numbers = From(5, ahead=10)
    ground = Sealer(KEY, UP, numbers)
    for _ in range(21):
        ground.seal(b"")

    assert numbers.asked == [5, 15, 25]


def test_nothing_is_sealed_with_a_number_that_could_not_be_reserved() -> None:
    class FullDisk(From):
        def reserve(self, sequence: int) -> None:
            raise OSError(f"no space left for {sequence}")

    ground = Sealer(KEY, UP, FullDisk(5))
    with pytest.raises(OSError, match="no space"):
        ground.seal(b"")
    assert ground.next_sequence == 5


def test_after_the_last_number_a_new_key_is_due() -> None:
    ground = sealer(first=SEQUENCE_LIMIT - 1)
    ground.seal(b"")

    with pytest.raises(SequenceExhaustedError, match=r"all of them used: give both ends a new"):
        ground.seal(b"")
