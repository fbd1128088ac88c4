"""Messages larger than a frame, cut into fragments."""

import struct
from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies._internal.random import ArtificialRandom

from farside.link.endpoint.fragments import FRAGMENT_OVERHEAD_BYTE, Fragmenter, Reassembler
from farside.link.endpoint.keys import simulated_key
from farside.link.endpoint.wire import OVERHEAD_BYTE, SEQUENCE_LIMIT, FrameError, Refusal, Sealer
from farside.node import Direction

HOUR_NS = 3600 * 10**9
LEAST_MTU_BYTE = OVERHEAD_BYTE + FRAGMENT_OVERHEAD_BYTE + 1


def fragment(number: int, index: int, count: int, chunk: bytes = b"x") -> bytes:
    return struct.pack(">IHH", number, index, count) + chunk


def refusal(reassembler: Reassembler, body: bytes) -> Refusal:
    with pytest.raises(FrameError) as caught:
        reassembler.add(body, 0)
    return caught.value.reason


def test_a_message_that_fits_is_sent_as_it_is() -> None:
    message = bytes(100 - OVERHEAD_BYTE)

    assert Fragmenter(100).cut(message, 0) == [message]
    assert len(Fragmenter(100).cut(message + b"x", 0)) == 2


@given(
    st.binary(max_size=3000), st.integers(LEAST_MTU_BYTE, 300), st.integers(0, SEQUENCE_LIMIT - 1)
)
def test_no_frame_is_longer_than_the_mtu(message: bytes, mtu_byte: int, number: int) -> None:
    class Last:
        first = SEQUENCE_LIMIT - 4000

        def reserve(self, sequence: int) -> int:
            return sequence + 4000

    sealer = Sealer(simulated_key(1), Direction.UP, Last())
    frames = [sealer.seal(body) for body in Fragmenter(mtu_byte).cut(message, number)]

    assert max(map(len, frames)) <= mtu_byte
    if len(frames) > 1:
        assert {len(frame) for frame in frames[:-1]} == {mtu_byte}


@given(st.lists(st.binary(min_size=60, max_size=400), min_size=1, max_size=4), st.randoms())
def test_fragments_in_any_order_and_more_than_once_give_each_message_once(
    messages: Sequence[bytes], rng: ArtificialRandom
) -> None:
    bodies = [
        body
        for number, message in enumerate(messages)
        for body in Fragmenter(70).cut(message, number)
    ]
    bodies += bodies
    rng.shuffle(bodies)
    reassembler = Reassembler(HOUR_NS)

    whole = [reassembler.add(body, 0) for body in bodies]

    assert sorted(filter(None, whole)) == sorted(messages)
    assert reassembler.surplus == len(bodies) // 2
    assert reassembler.held_byte == 0


def test_a_lost_fragment_leaves_the_message_incomplete_until_it_is_too_old() -> None:
    reassembler = Reassembler(HOUR_NS)
    bodies = Fragmenter(70).cut(bytes(200), 5)
    for body in bodies[:-1]:
        assert reassembler.add(body, 0) is None

    reassembler.expire(HOUR_NS - 1)
    assert (reassembler.expired, reassembler.held_byte > 0) == (0, True)
    reassembler.expire(HOUR_NS)
    assert (reassembler.expired, reassembler.held_byte) == (1, 0)
    assert reassembler.add(bodies[-1], HOUR_NS) is None
    assert (reassembler.surplus, reassembler.held_byte) == (1, 0)


def test_age_counts_from_the_first_fragment() -> None:
    reassembler = Reassembler(HOUR_NS)
    reassembler.add(fragment(1, 0, 3), 0)
    reassembler.add(fragment(1, 1, 3), HOUR_NS - 1)

    assert reassembler.add(fragment(1, 2, 3), HOUR_NS) is None
    assert reassembler.expired == 1


def test_with_too_many_messages_the_oldest_incomplete_one_is_dropped() -> None:
    reassembler = Reassembler(HOUR_NS, max_messages=2)
    for number in (1, 2, 3):
        reassembler.add(fragment(number, 0, 2), 0)

    assert reassembler.displaced == 1
    assert [reassembler.add(fragment(n, 1, 2), 0) for n in (1, 2, 3)] == [None, b"xx", b"xx"]


def test_with_too_many_bytes_the_oldest_incomplete_one_is_dropped() -> None:
    reassembler = Reassembler(HOUR_NS, max_byte=4000)
    for number in (1, 2, 3):
        reassembler.add(fragment(number, 0, 2, bytes(1500)), 0)

    assert reassembler.displaced == 1
    assert reassembler.held_byte <= 4000
    assert reassembler.add(fragment(2, 1, 2, b"end"), 0) == bytes(1500) + b"end"


def test_a_message_that_could_never_be_complete_displaces_no_other() -> None:
    reassembler = Reassembler(HOUR_NS, max_byte=4000)
    reassembler.add(fragment(1, 0, 2), 0)

    assert refusal(reassembler, fragment(2, 0, 4, bytes(1500))) is Refusal.OVERSIZED
    assert refusal(reassembler, fragment(2, 3, 4, bytes(4000))) is Refusal.OVERSIZED
    assert reassembler.add(fragment(1, 1, 2), 0) == b"xx"


@pytest.mark.parametrize(
    "other", [fragment(1, 0, 2, b"y"), fragment(1, 0, 3), fragment(1, 2, 3)], ids=str
)
def test_a_fragment_that_contradicts_another_is_refused_and_harms_nothing(other: bytes) -> None:
    reassembler = Reassembler(HOUR_NS)
    reassembler.add(fragment(1, 0, 2), 0)

    assert refusal(reassembler, other) is Refusal.CONFLICTING
    assert reassembler.refused == {Refusal.CONFLICTING: 1}
    assert reassembler.add(fragment(1, 1, 2, b"z"), 0) == b"xz"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        bytes(8),
        fragment(1, 0, 0),
        fragment(1, 0, 1),
        fragment(1, 2, 2),
        fragment(1, 0, 2, b""),
    ],
    ids=str,
)
def test_what_is_no_fragment_is_malformed(body: bytes) -> None:
    assert refusal(Reassembler(HOUR_NS), body) is Refusal.MALFORMED


fragments = st.builds(
    fragment,
    st.integers(0, 3),
    st.integers(0, 4),
    st.integers(0, 5),
    st.binary(max_size=3) | st.binary(min_size=200, max_size=300),
)


@given(
    st.lists(st.tuples(fragments | st.binary(max_size=12), st.integers(0, 40))),
    st.integers(1, 3),
    st.integers(0, 1500),
)
def test_no_fragments_raise_another_error_or_exceed_the_memory_bound(
    arrivals: Sequence[tuple[bytes, int]], max_messages: int, max_byte: int
) -> None:
    reassembler = Reassembler(100, max_messages, max_byte)
    now_ns = 0
    for body, wait_ns in arrivals:
        now_ns += wait_ns
        with suppress(FrameError):
            reassembler.add(body, now_ns)
        assert 0 <= reassembler.held_byte <= max_byte
    reassembler.expire(now_ns + 100)
    assert reassembler.held_byte == 0


def test_an_mtu_that_holds_no_fragment_is_refused() -> None:
    Fragmenter(LEAST_MTU_BYTE)
    with pytest.raises(ValueError, match="expected an MTU of 35 bytes or more, found 34"):
        Fragmenter(LEAST_MTU_BYTE - 1)


def test_a_message_of_too_many_fragments_is_refused() -> None:
    fragmenter = Fragmenter(LEAST_MTU_BYTE)

    assert len(fragmenter.cut(bytes(65_535), 0)) == 65_535
    with pytest.raises(ValueError, match="expected a message of 65535 bytes at most"):
        fragmenter.cut(bytes(65_536), 0)
