"""The endpoint: the end of the link inside a node, between its messages and the frames."""

import heapq
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

import msgspec

from farside.link.messages import Downlink, Uplink
from farside.link.node import Direction, Frame

WIRE_VERSION = 1
"""First byte of every payload. A frame of another version is refused."""

_Out = TypeVar("_Out", bound=msgspec.Struct)
_In = TypeVar("_In", bound=msgspec.Struct)

_encode = msgspec.msgpack.Encoder().encode


class FrameError(Exception):
    """A frame that is not one of ours: of another version, cut short, or of no known message."""


class Endpoint(Generic[_Out, _In]):
    """Turns messages into frames of one direction, and arrived frames into messages.

    A payload is the version byte and the message as MessagePack.
    """

    def __init__(self, outgoing: Direction, decoder: msgspec.msgpack.Decoder[_In]) -> None:
        self._direction = outgoing
        self._decoder = decoder
        self._sequence = 0
        self._outbox: list[Frame] = []
        self._inbox: list[tuple[int, int, Frame]] = []

    def send(self, message: _Out, time_ns: int) -> None:
        """Put `message` in a frame and hand it to the link at `time_ns`."""
        payload = bytes((WIRE_VERSION,)) + _encode(message)
        self._outbox.append(Frame(self._direction, self._sequence, time_ns, payload))
        self._sequence += 1

    def take_sent(self) -> list[Frame]:
        """The frames sent since the last call, in order."""
        sent, self._outbox = self._outbox, []
        return sent

    def expect(self, frames: Iterable[Frame]) -> None:
        """Keep frames that will arrive until they are due."""
        for frame in frames:
            heapq.heappush(self._inbox, (frame.time_ns, frame.sequence, frame))

    def received(self, now_ns: int) -> Iterator[tuple[int, _In]]:
        """The messages that have arrived by `now_ns`, each with its time of arrival, in order.

        Raises:
            FrameError: if a payload is not a message of this version.
        """
        while self._inbox and self._inbox[0][0] <= now_ns:
            arrival_ns, _, frame = heapq.heappop(self._inbox)
            yield arrival_ns, self._decode(frame)

    def _decode(self, frame: Frame) -> _In:
        name = f"{frame.direction} frame {frame.sequence}"
        if frame.payload[:1] != bytes((WIRE_VERSION,)):
            raise FrameError(
                f"{name}: expected version {WIRE_VERSION}, found {frame.payload[:1]!r}"
            )
        try:
            return self._decoder.decode(frame.payload[1:])
        except msgspec.MsgspecError as error:
            raise FrameError(f"{name}: expected a message, found {error}") from error


def rover_endpoint() -> Endpoint[Downlink, Uplink]:
    """The end at the rover: sends down, receives up."""
    return Endpoint(Direction.DOWN, msgspec.msgpack.Decoder(Uplink))


def ground_endpoint() -> Endpoint[Uplink, Downlink]:
    """The end at the ground: sends up, receives down."""
    return Endpoint(Direction.UP, msgspec.msgpack.Decoder(Downlink))
