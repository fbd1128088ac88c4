"""The fate of every frame, and the outages of the link, as the log tells them."""

from enum import StrEnum

import msgspec

from farside.node import Direction


class OutageReason(StrEnum):
    """Why a direction is out."""

    BLACKOUT = "blackout"
    PASS = "pass"  # noqa: S105 - of a satellite
    CONTACT = "contact"
    CONJUNCTION = "conjunction"
    CONTROL = "control"

    @property
    def is_foreseen(self) -> bool:
        """Whether both ends know of it beforehand: not of a blackout, nor of what somebody does."""
        return self not in {OutageReason.BLACKOUT, OutageReason.CONTROL}


class Fate(StrEnum):
    """The fate of a frame in the channel: delivered, or why not."""

    DELIVERED = "delivered"
    LOST = "lost"
    OUTAGE = "outage"
    QUEUE_FULL = "queue-full"
    EXPIRED = "expired"
    BIT_ERROR = "bit-error"
    STORE_FULL = "store-full"
    NO_ROUTE = "no-route"


class FrameFate(msgspec.Struct, frozen=True, gc=False):
    """The fate of a frame in the channel, logged when it came about.

    Attributes:
        direction, sequence: the frame's id.
        size_byte: length of its payload.
        queued_ns: when the sender handed it to the channel.
        sent_ns, sent_end_ns: when its first and last bit left; both `queued_ns` if it never left.
        arrival_ns: when its last bit arrived, `None` unless delivered.
        fate: its fate.
        priority: as the sender set it.
        copy: 0 for the frame itself, 1 for its duplicate.
        flipped_bits: number of bit errors on arrival.
        outage: the reason of the outage that it was lost to.
    """

    direction: Direction
    sequence: int
    size_byte: int
    queued_ns: int
    sent_ns: int
    sent_end_ns: int
    arrival_ns: int | None
    fate: Fate
    priority: int = 0
    copy: int = 0
    flipped_bits: int = 0
    outage: OutageReason | None = None


class FrameHop(msgspec.Struct, frozen=True, omit_defaults=True, gc=False):
    """What became of a frame at one node of its way, logged when it left there or was dropped.

    Only links by way of other nodes have hops.

    Attributes:
        direction, sequence: the frame's id, as in `FrameFate`.
        hop: which node of its way this is, from 1, the sender.
        node: the node's number.
        received_ns: when its last bit arrived there; at the sender, when it was handed over.
        stored_byte: how much then waited there in this direction, this frame included.
        to: the node that it was sent to; absent, with the times of that, if it was dropped.
        sent_ns, sent_end_ns: when its first and last bit left.
        arrival_ns: when its last bit is there.
        dropped_ns: when it was dropped.
        fate: why it was dropped.
    """

    direction: Direction
    sequence: int
    hop: int
    node: int
    received_ns: int
    stored_byte: int
    to: int | None = None
    sent_ns: int | None = None
    sent_end_ns: int | None = None
    arrival_ns: int | None = None
    dropped_ns: int | None = None
    fate: Fate | None = None


class FrameStage(StrEnum):
    """A stage in a frame's life at an endpoint; its life in the channel is a `FrameFate`.

    Made from a message; lost to terrain shadow on sending or arrival; refused, as not genuine or
    not new; used.
    """

    MADE = "made"
    SHADOWED = "shadowed"
    REFUSED = "refused"
    USED = "used"


class Carried(msgspec.Struct, frozen=True, omit_defaults=True, gc=False):
    """A message in a frame, or a part of one.

    Attributes:
        kind: as the message is tagged on the link, such as `command` or `telemetry`.
        number: its number; of `shown`, that of the proposal. `None` where it has none.
        time_ns: its time stamp, `None` where it has none.
        part, parts: which part of it, from 1, of how many.
        attempt: how many times this part has now been sent.
    """

    kind: str
    number: int | None = None
    time_ns: int | None = None
    part: int = 1
    parts: int = 1
    attempt: int = 1


class FrameEvent(msgspec.Struct, frozen=True, omit_defaults=True):
    """What an endpoint did with a frame.

    Attributes:
        direction, sequence: the frame's id, as in `FrameFate`.
        stage: the stage reached.
        size_byte: its length on the link.
        what: the kind of message in it or, if refused, the reason.
        stored: whether it is of the stored stream: what waited for the link to return, and the
            updates of the model.
        carries: the message in it, as far as this end knows: the sender of each frame but a
            report; the receiver once it has the message whole, and with it those that waited for
            it to be in order.
    """

    direction: Direction
    sequence: int
    stage: FrameStage
    size_byte: int
    what: str
    stored: bool = False
    carries: tuple[Carried, ...] = ()


class LinkOutage(msgspec.Struct, frozen=True):
    """An outage of one direction begins (`down` true) or ends."""

    direction: Direction
    down: bool
    reason: OutageReason
