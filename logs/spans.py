"""What queries on a run answer with: spans of time, and counts of frames."""

from collections import Counter
from typing import NamedTuple

import msgspec

from farside.control import Mode, ModeCause
from farside.frames import Fate, FrameEvent, FrameFate, FrameStage, OutageReason
from farside.messages import ModelUpdate, Tokens
from farside.node import Direction, to_s
from farside.topics import GoalSource


class ModeSpan(NamedTuple):
    """The rover was in `mode` from `t_s` until the next span; `why` is the cause of the change."""

    t_s: float
    mode: Mode
    why: ModeCause


class OutageSpan(NamedTuple):
    """One direction was down from `start_s` to `end_s`, or to the end of the run."""

    direction: Direction
    start_s: float
    end_s: float
    reason: OutageReason = OutageReason.BLACKOUT


class GoalSpan(NamedTuple):
    """A goal from being set to leaving the Goal List, or to the end of the run.

    Attributes:
        tokens: its Sign.
        source: who set it.
        set_s: when it was added to the Goal List.
        reached_s: when it was reached; `None` if it was not, or if only the estimate said so.
        withdrawn_s: when it was withdrawn; `None` if it was not.
    """

    tokens: Tokens
    source: GoalSource
    set_s: float
    reached_s: float | None = None
    withdrawn_s: float | None = None


class OperatorSpan(NamedTuple):
    """From `t_s` on, the operator was at `step` of `of` and waited; see `OperatorEntry`."""

    t_s: float
    step: int
    of: int
    waiting_for: str | None
    left: tuple[str, ...] = ()


class LeastCharge(NamedTuple):
    """The least state of charge in a run, 0 to 1, and when the battery first had it."""

    t_s: float
    charge: float


class ShadowPrice(NamedTuple):
    """What the shadow of the model at the ground took of the link.

    Attributes:
        updates: how many updates were made on board.
        wholes: how many of them were all lists, and not their changes.
        cycles: how many cycles of the model they cover.
        downlink_byte: length of the frames that carried them, repeated ones included.
        downlink_share: their share of all bytes that the rover sent, 0 to 1.
        report_byte: length of the reports of them on the uplink. Stored telemetry is reported in
            the same way: a report counts if the last of both that had arrived was an update.
        in_step: whether the ground held the lists as they were after its newest update, at the end.
    """

    updates: int
    wholes: int
    cycles: int
    downlink_byte: int
    downlink_share: float
    report_byte: int
    in_step: bool


class LinkCounters(msgspec.Struct, frozen=True):
    """Counts of the frames of one direction whose fate was decided within the run.

    Attributes:
        sent: frames handed to the channel; the sum of the next six.
        delivered, lost, outage, queue_full, expired, bit_error: frames with each `Fate`.
        duplicated: frames that arrived twice.
        damaged: frames that arrived with bit errors.
        refused: frames that the receiver refused as not genuine or not new.
        shadowed: frames lost to terrain shadow, at the rover.
        bytes: total payload of the frames sent, in bytes.
        delay_s: mean time from sender to arrival, queueing included; `None` if none arrived.
    """

    sent: int
    delivered: int
    lost: int
    outage: int
    queue_full: int
    expired: int
    bit_error: int
    duplicated: int
    damaged: int
    refused: int
    shadowed: int
    bytes: int
    delay_s: float | None


class LinkTally:
    """Counts the frames of one direction.

    Attributes:
        stages: how many frames reached each stage at the endpoints.
    """

    def __init__(self) -> None:
        self.stages: Counter[FrameStage] = Counter()
        self._fates: Counter[Fate] = Counter()
        self._sent = self._duplicated = self._damaged = self._bytes = self._delay_ns = 0

    def add(self, frame: FrameFate) -> None:
        """Count a frame."""
        if frame.copy:
            self._duplicated += frame.copy if frame.fate is Fate.DELIVERED else 0
            return
        self._sent += 1
        self._fates[frame.fate] += 1
        self._damaged += frame.flipped_bits > 0
        self._bytes += frame.size_byte
        if frame.arrival_ns is not None:
            self._delay_ns += frame.arrival_ns - frame.queued_ns

    def counters(self) -> LinkCounters:
        """The counts so far."""
        fates = self._fates
        delivered = fates[Fate.DELIVERED]
        return LinkCounters(
            sent=self._sent,
            delivered=delivered,
            lost=fates[Fate.LOST],
            outage=fates[Fate.OUTAGE],
            queue_full=fates[Fate.QUEUE_FULL],
            expired=fates[Fate.EXPIRED],
            bit_error=fates[Fate.BIT_ERROR],
            duplicated=self._duplicated,
            damaged=self._damaged,
            refused=self.stages[FrameStage.REFUSED],
            shadowed=self.stages[FrameStage.SHADOWED],
            bytes=self._bytes,
            delay_s=to_s(self._delay_ns) / delivered if delivered else None,
        )


class ShadowTally:
    """Counts what the shadow of the model takes of the link; see `ShadowPrice`.

    Attributes:
        sent_byte: length of all frames that the rover made.
        downlink_byte: of those that carry updates of the model.
        report_byte: of the reports of them.
    """

    def __init__(self) -> None:
        self.sent_byte = self.downlink_byte = self.report_byte = 0
        self._arrived = ""

    def add(self, event: FrameEvent) -> None:
        """Count what an endpoint did with a frame; those of the ground in order."""
        is_made, is_down = event.stage is FrameStage.MADE, event.direction is Direction.DOWN
        if is_made and is_down:
            self.sent_byte += event.size_byte
            if event.what.startswith(ModelUpdate.__name__):
                self.downlink_byte += event.size_byte
        elif event.stored and is_made and self._arrived == ModelUpdate.__name__:
            self.report_byte += event.size_byte
        elif event.stored and is_down and event.what != "segment":
            self._arrived = event.what.rpartition(", ")[2]
