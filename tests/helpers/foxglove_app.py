"""A viewer as the Foxglove app is one, on the other end of the WebSocket.

It speaks the subprotocol `foxglove.sdk.v1`: JSON for what is said of channels, and binary messages
that begin with an opcode, all little-endian.
"""

import json
import struct
from collections.abc import Callable
from itertools import count
from types import TracebackType
from typing import Any, NamedTuple, Self

from websockets.sync.client import connect
from websockets.typing import Subprotocol

_PATIENCE_S = 20  # a server that says nothing for so long is broken
_MESSAGE, _TIME, _STATE = 1, 2, 5  # from the server
_CONTROL = 3  # to the server
_PLAY, _PAUSE = 0, 1
_STATUS = ("playing", "paused", "buffering", "ended")


class Message(NamedTuple):
    """A message of a topic, with its log time."""

    topic: str
    time_ns: int
    payload: bytes


class Time(NamedTuple):
    """The time at the server."""

    time_ns: int


class State(NamedTuple):
    """What the play bar shows; `request` names the request that it answers, if it does."""

    status: str
    time_ns: int
    speed: float
    did_seek: bool
    request: str


class FoxgloveApp:
    """A connection to a server on this machine. A context manager that ends it.

    Attributes:
        info: what the server says of itself.
        channels: those that it offers, by topic.
        got: all that came, in order.
    """

    def __init__(self, port: int) -> None:
        self._connection = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[Subprotocol("foxglove.sdk.v1")],
            proxy=None,
            max_size=None,
            max_queue=None,  # what is never taken must not hold up the end
        )
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.got: list[Message | Time | State] = []
        self._topics: dict[int, str] = {}
        self._requests = count(1)

    @property
    def messages(self) -> list[Message]:
        """The messages that came, in order."""
        return [event for event in self.got if isinstance(event, Message)]

    @property
    def states(self) -> list[State]:
        """The states of the play bar that came, in order."""
        return [event for event in self.got if isinstance(event, State)]

    def subscribe(self, *topics: str) -> None:
        """Ask for topics."""
        wanted = [(self.channels[topic]["id"], topic) for topic in topics]
        self._topics |= dict(wanted)
        subscriptions = [{"id": number, "channelId": number} for number, _ in wanted]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def ask(self, *, play: bool, speed: float = 1.0, seek_ns: int | None = None) -> State:
        """Use the play bar; returns the server's answer."""
        name = f"request {next(self._requests)}".encode()
        control = struct.pack("<BBf", _CONTROL, _PLAY if play else _PAUSE, speed)
        seek = struct.pack("<BQ", seek_ns is not None, seek_ns or 0)
        self._socket.send(control + seek + struct.pack("<I", len(name)) + name)
        self.until(lambda: any(state.request == name.decode() for state in self.states))
        return self.states[-1]

    def until(self, seen: Callable[[], bool]) -> None:
        """Take what comes until something has been seen."""
        while not seen():
            self._take(self._socket.recv(timeout=_PATIENCE_S))

    def until_messages(self, count: int) -> None:
        """Take what comes until so many messages have come in all."""
        self.until(lambda: len(self.messages) >= count)

    def _take(self, data: str | bytes) -> None:
        if isinstance(data, str):
            said = json.loads(data)
            match said["op"]:
                case "serverInfo":
                    self.info = said
                case "advertise":
                    self.channels |= {channel["topic"]: channel for channel in said["channels"]}
                case other:
                    raise AssertionError(f"expected no {other}: {said}")
            return
        match data[0]:
            case op if op == _MESSAGE:
                number, time_ns = struct.unpack_from("<IQ", data, 1)
                self.got.append(Message(self._topics[number], time_ns, data[13:]))
            case op if op == _TIME:
                self.got.append(Time(*struct.unpack_from("<Q", data, 1)))
            case op if op == _STATE:
                status, time_ns, speed, did_seek, _ = struct.unpack_from("<BQfBI", data, 1)
                request = data[19:].decode()
                self.got.append(State(_STATUS[status], time_ns, speed, bool(did_seek), request))
            case op:
                raise AssertionError(f"expected no opcode {op}")

    def __enter__(self) -> Self:
        self._socket = self._connection.__enter__()
        self.until(lambda: bool(self.channels))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._connection.__exit__(kind, error, traceback)
