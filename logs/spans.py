"""What queries on a run answer with: spans of time, and counts of frames."""

from collections import Counter
from typing import NamedTuple, Self

import msgspec

from farside.control import Cause, CommandStage, Failsafe, Mode, ModeCause, Verdict
from farside.frames import Fate, FrameEvent, FrameFate, FrameStage, OutageReason
from farside.messages import Meant, ModelUpdate, Order, Telemetry, Tokens, When
from farside.node import Direction, to_s
from farside.topics import BeliefEntry, CommandSent, GoalSource, LifeEntry, Prediction


class ModeSpan(NamedTuple):
    """The rover was in `mode` from `t_s` until the next span; `why` is the cause of the change."""

    t_s: float
    mode: Mode
    why: ModeCause


class FailsafeSpan(NamedTuple):
    """The failsafe was in `state` from `t_s` until the next span; see `FailsafeEntry`."""

    t_s: float
    state: Failsafe
    why: str
    causes: tuple[Cause, ...]


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


class CommandVerdict(NamedTuple):
    """What the ground came to say of a stage of a command.

    Attributes:
        said_s: when; of a stage that it knows was reached, when it learned so.
        stage: the stage.
        verdict: on it.
        due_s: when it was due on board; `None` if it never was.
        so_s: when it was reached on board; `None` while the ground does not know.
    """

    said_s: float
    stage: CommandStage
    verdict: Verdict
    due_s: float | None
    so_s: float | None

    @property
    def is_of_fact(self) -> bool:
        """Whether the ground knew by it that the stage was reached."""
        return self.verdict in {Verdict.ON_TIME, Verdict.LATE}


class CommandLife(NamedTuple):
    """A command from leaving the ground to its end, on both sides.

    Attributes:
        number, order, meant, when: see `Command`.
        sent_s: when the ground gave it.
        expires_s: when it would be too late to begin it.
        arrived_s: when the rover received it; `None` if it did not. As ground, this and the next
            four are what the ground had heard.
        begun_s: when its action began; `None` without an action, or if it never did.
        ended_s: when it was over.
        how: the stage that ended it.
        why: why it ended without being done.
        verdicts: what the ground came to say of it, in order.
    """

    number: int
    order: Order
    meant: Meant | None
    when: When | None
    sent_s: float
    expires_s: float
    arrived_s: float | None = None
    begun_s: float | None = None
    ended_s: float | None = None
    how: CommandStage | None = None
    why: str | None = None
    verdicts: tuple[CommandVerdict, ...] = ()

    @classmethod
    def of(cls, sent: CommandSent, t_s: float) -> Self:
        """The life of a command that was sent at `t_s`."""
        return cls(sent.number, sent.order, sent.meant, sent.when, t_s, to_s(sent.expires_ns))

    @property
    def learned_s(self) -> float | None:
        """When the ground learned how it ended; `None` if it never did."""
        ends = (said.said_s for said in self.verdicts if said.stage.is_last and said.is_of_fact)
        return next(ends, None)

    def reach(self, stage: CommandStage, t_s: float | None, why: str | None) -> Self:
        """The same command once it has come to a stage at `t_s`."""
        if stage.is_last:
            return self._replace(ended_s=t_s, how=stage, why=why)
        if stage is CommandStage.BEGUN:
            return self._replace(begun_s=t_s)
        return self._replace(arrived_s=t_s) if stage is CommandStage.TAKEN else self

    def judge(self, entry: LifeEntry, t_s: float, *, told: bool) -> Self:
        """The same command once the ground has said this of it at `t_s`.

        Args:
            entry: what it said.
            t_s: when.
            told: whether its life on board is to be what the ground was told of it.
        """
        if entry.stage is None or entry.verdict is None:
            return self
        due_s, so_s = (None if ns is None else to_s(ns) for ns in (entry.due_ns, entry.so_ns))
        said = CommandVerdict(t_s, entry.stage, entry.verdict, due_s, so_s)
        judged = self._replace(verdicts=(*self.verdicts, said))
        return judged.reach(entry.stage, so_s, entry.why) if told and said.is_of_fact else judged


class Believed(NamedTuple):
    """What the ground believed of the rover at a time.

    Attributes:
        t_s: the time.
        belief: item by item, with when it was so and when that was learned.
        telemetry: the newest that had come straight from the rover; `None` before the first.
        age_s: how long ago that was measured.
        silent: whether the rover counted as silent.
        prediction: where the ground took it to be by then; `None` where it said nothing.
    """

    t_s: float
    belief: BeliefEntry
    telemetry: Telemetry | None
    age_s: float | None
    silent: bool
    prediction: Prediction | None


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


class LinkCounters(msgspec.Struct, frozen=True, omit_defaults=True):
    """Counts of the frames of one direction whose fate was decided within the run.

    Attributes:
        sent: frames handed to the channel; the sum of the next six, `store_full` and `no_route`.
        delivered, lost, outage, queue_full, expired, bit_error: frames with each `Fate`.
        duplicated: frames that arrived twice.
        damaged: frames that arrived with bit errors.
        refused: frames that the receiver refused as not genuine or not new.
        shadowed: frames lost to terrain shadow, at the rover.
        bytes: total payload of the frames sent, in bytes.
        delay_s: mean time from sender to arrival, queueing included; `None` if none arrived.
        store_full, no_route: frames with this `Fate`, by way of other nodes.
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
    store_full: int = 0
    no_route: int = 0


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
            store_full=fates[Fate.STORE_FULL],
            no_route=fates[Fate.NO_ROUTE],
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
        elif event.stage is FrameStage.SHADOWED:
            return  # at the rover's end, and never at the ground
        elif event.stored and is_down and event.what != "segment":
            self._arrived = event.what.rpartition(", ")[2]
