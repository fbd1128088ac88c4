"""Messages in, frames across, messages out."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link import Direction, Frame, FrameError, ground_endpoint, rover_endpoint
from farside.link.messages import Command, Drive, Heartbeat, SetGoal


def carry(endpoint, other, now_ns=0):
    other.expect(endpoint.take_sent())
    return [message for _, message in other.received(now_ns)]


def test_a_message_comes_out_as_it_went_in():
    ground, rover = ground_endpoint(), rover_endpoint()
    order = Command(1, 99, SetGoal(("at:A",), 2.0))
    ground.send(order, 0)
    ground.send(Heartbeat(3), 0)
    assert carry(ground, rover) == [order, Heartbeat(3)]


def test_frames_are_counted_and_taken_once():
    ground = ground_endpoint()
    for number in range(3):
        ground.send(Heartbeat(number), number)
    frames = ground.take_sent()
    assert [(f.direction, f.sequence, f.time_ns) for f in frames] == [
        (Direction.UP, 0, 0),
        (Direction.UP, 1, 1),
        (Direction.UP, 2, 2),
    ]
    assert ground.take_sent() == []


def test_a_message_is_not_read_before_it_arrives():
    ground, rover = ground_endpoint(), rover_endpoint()
    ground.send(Heartbeat(1), 100)
    rover.expect(ground.take_sent())
    assert list(rover.received(99)) == []
    assert list(rover.received(100)) == [(100, Heartbeat(1))]


@pytest.mark.parametrize(
    ("payload", "found"),
    [
        (b"", "expected version 1"),
        (b"\x02\x80", "expected version 1"),
        (b"\x01", "expected a message"),
        (b"\x01\xc1", "expected a message"),
    ],
)
def test_a_foreign_frame_is_refused_by_name(payload, found):
    rover = rover_endpoint()
    rover.expect([Frame(Direction.UP, 4, 0, payload)])
    with pytest.raises(FrameError, match=f"up frame 4: {found}"):
        list(rover.received(0))


@given(st.binary(max_size=60))
def test_no_payload_raises_anything_else(payload):
    rover = rover_endpoint()
    rover.expect([Frame(Direction.UP, 0, 0, b"\x01" + payload)])
    with suppress(FrameError):
        list(rover.received(0))


@given(st.binary(max_size=8))
def test_a_frame_cut_short_is_refused(tail):
    ground, rover = ground_endpoint(), rover_endpoint()
    ground.send(Command(1, 5, Drive("N")), 0)
    (frame,) = ground.take_sent()
    rover.expect([Frame(frame.direction, 0, 0, frame.payload[: len(tail)])])
    with pytest.raises(FrameError):
        list(rover.received(0))
