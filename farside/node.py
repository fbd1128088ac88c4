"""What rover, link and ground have in common: time, frames, records, and the `Node` protocol."""

from collections.abc import Sequence
from enum import StrEnum
from itertools import repeat
from typing import Generic, NamedTuple, Protocol, TypeVar

import msgspec

NS_PER_S = 1_000_000_000

NEVER_NS = 1 << 62
"""Later than any time of a run, by a century."""


def to_ns(seconds: float) -> int:
    """`seconds` as whole nanoseconds, to the nearest one."""
    return round(seconds * NS_PER_S)


def to_s(nanoseconds: int) -> float:
    """`nanoseconds` as seconds, for display and for physics."""
    return nanoseconds / NS_PER_S


class Role(StrEnum):
    """The three parties of a run. Their order is the order of records made at the same time."""

    ROVER = "rover"
    LINK = "link"
    GROUND = "ground"


class Direction(StrEnum):
    """Direction of a frame: `UP` to the rover, `DOWN` to the ground."""

    UP = "up"
    DOWN = "down"

    @property
    def opposite(self) -> "Direction":
        """The reverse direction."""
        return Direction.DOWN if self is Direction.UP else Direction.UP


class Frame(msgspec.Struct, frozen=True, array_like=True, gc=False):
    """The unit that crosses the link; opaque to the channel.

    Attributes:
        direction: which way it goes.
        sequence: number of the frame in its direction, from 0. With the direction it is the
            frame's id, the same on both sides and in the log.
        time_ns: when the sender handed it to the channel; at the receiver, when it arrived.
        payload: its bytes.
        priority: of waiting frames the one with the highest goes first, then the oldest.
        lifetime_ns: how long it may wait to be sent; the link's own limit where absent.
    """

    direction: Direction
    sequence: int
    time_ns: int
    payload: bytes
    priority: int = 0
    lifetime_ns: int | None = None


T = TypeVar("T", bound=msgspec.Struct)


class Topic(Generic[T]):
    """A topic of the log: its name, and the type of its messages.

    Args:
        name: such as `/rover/mode`; the first part says who knew it, see `farside.topics`.
        kind: the type. Several topics may carry one type.
    """

    def __init__(self, name: str, kind: type[T]) -> None:
        self.name, self.kind = name, kind
        self._decoder = msgspec.json.Decoder(kind)

    def __repr__(self) -> str:
        return f"Topic({self.name!r}, {self.kind.__name__})"

    def decode(self, payload: bytes) -> T:
        """The message that a record's payload holds.

        Raises:
            msgspec.MsgspecError: if it holds none of this type.
        """
        return self._decoder.decode(payload)


class Record(msgspec.Struct, frozen=True, array_like=True, gc=False):
    """One message of the log, encoded where it was made.

    Attributes:
        topic: name of a `Topic`.
        log_time_ns: when it became known where it was recorded.
        publish_time_ns: when it was so.
        payload: the message as JSON.
    """

    topic: str
    log_time_ns: int
    publish_time_ns: int
    payload: bytes


_encoder = msgspec.json.Encoder(order="deterministic")


class Journal:
    """Collects a node's records in order, encoded, until they are taken.

    Attributes:
        now_ns: the present, moved by the node: log time of what is noted without another one.
    """

    def __init__(self) -> None:
        self.now_ns = 0
        self._records: list[Record] = []

    def note(
        self,
        topic: Topic[T],
        message: T,
        *,
        log_time_ns: int | None = None,
        publish_time_ns: int | None = None,
    ) -> None:
        """Record `message` on `topic`.

        Args:
            topic: where it goes.
            message: what became known.
            log_time_ns: when it became known; the present by default.
            publish_time_ns: when it was so; `log_time_ns` by default.
        """
        known_ns = self.now_ns if log_time_ns is None else log_time_ns
        so_ns = known_ns if publish_time_ns is None else publish_time_ns
        self._records.append(Record(topic.name, known_ns, so_ns, _encoder.encode(message)))

    def note_all(self, topic: Topic[T], messages: Sequence[T], times_ns: Sequence[int]) -> None:
        """`note` for many, each known, and so, at its time; much the faster."""
        # One line for each: in JSON a line break stands nowhere else.
        payloads = _encoder.encode_lines(messages).split(b"\n")
        self._records += map(Record, repeat(topic.name), times_ns, times_ns, payloads)

    def take(self) -> list[Record]:
        """The records since the last call."""
        taken, self._records = self._records, []
        return taken


class Step(NamedTuple):
    """The result of a window: frames and records, each in order of time."""

    frames: list[Frame]
    records: list[Record]


class Node(Protocol):
    """One party of a run: rover, ground or the channel between them.

    A node owns its time, which only `advance` moves. It holds no clock, file, socket, thread or
    global random source, so the same calls give the same steps in any process. What it returns
    must not depend on how time is divided into windows.
    """

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Simulate from the present up to, not including, `until_ns`.

        Args:
            until_ns: end of the window; not before the end of the last one.
            arrivals: frames that are now certain to arrive, each at its `time_ns`, which may lie
                beyond this window. For the channel: the frames sent in this window.

        Returns:
            the frames sent and the records made in the window.
        """
        ...
