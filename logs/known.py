"""The commands as the ground knew them at a moment, built from its log entries; and in words."""

from collections import deque
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import msgspec

from farside.control import CommandStage, TakeBackChance, Verdict
from farside.logs.events import HAPPENED, MISSED, order_text, when_text
from farside.messages import ACTS, Order, Telemetry, When
from farside.node import Topic, to_s
from farside.topics import (
    GROUND_COMMAND,
    GROUND_HELD,
    GROUND_LIFE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    CommandSent,
    HeldEntry,
    HeldFate,
    LifeEntry,
    StageDue,
)

_OPEN_KEPT = 1000  # more than any link has on its way at once
_ENDED_KEPT = 8  # as many as a large screen has rows for

_TAKEN, _BEGUN, _DONE = CommandStage.TAKEN, CommandStage.BEGUN, CommandStage.DONE
_KNOWN = {Verdict.ON_TIME, Verdict.LATE}

_COMING = {_TAKEN: "arrives", _BEGUN: "begins", _DONE: "done"}

COMMAND_TOPICS: tuple[Topic[Any], ...] = (
    GROUND_COMMAND,
    GROUND_LIFE,
    GROUND_HELD,
    GROUND_TELEMETRY,
    GROUND_STORED_TELEMETRY,
)
"""The topics that tell what the ground knows of commands."""


@dataclass
class KnownStage:
    """What the ground has said of a stage.

    Attributes:
        due: when it is due; `None` if that was not said.
        verdict: the last; `None` before the first.
        so_ns: when it was so, if that is known.
        told_ns: when the ground learned that it was so; `None` before that.
    """

    due: StageDue | None = None
    verdict: Verdict | None = None
    so_ns: int | None = None
    told_ns: int | None = None

    @property
    def is_overdue(self) -> bool:
        """Whether word of it is missing."""
        return self.told_ns is None and self.verdict is Verdict.OVERDUE


@dataclass
class KnownCommand:
    """A command that has left the ground, as the ground knows it.

    Attributes:
        number: of the command.
        order, when: what it carries; see `Command`.
        sent_ns: when it was given.
        expires_ns: after this the rover does not begin it.
        stages: taken, begun (of an action) and done; whatever ends it counts as done.
        end: how it ended; `None` while that is not known.
        why: why it ended without being done.
        over_ns: when the ground learned that it is over, perhaps without how.
        take_back: whether it can be taken back.
        take_back_until_ns: until when for sure.
    """

    number: int
    order: Order
    when: When | None
    sent_ns: int
    expires_ns: int
    stages: dict[CommandStage, KnownStage]
    end: CommandStage | None = None
    why: str | None = None
    over_ns: int | None = None
    take_back: TakeBackChance = TakeBackChance.OPEN
    take_back_until_ns: int | None = None

    @property
    def is_over(self) -> bool:
        """Whether it is known to be over."""
        return self.over_ns is not None

    @property
    def is_overdue(self) -> bool:
        """Whether word of it is missing."""
        return not self.is_over and any(stage.is_overdue for stage in self.stages.values())

    @property
    def is_late(self) -> bool:
        """Whether a stage is known to have come late."""
        return any(stage.verdict is Verdict.LATE for stage in self.stages.values())

    @property
    def lapses(self) -> bool:
        """Whether it is due to expire on board before its turn comes."""
        begun = self.stages.get(_BEGUN)
        if begun is None or begun.due is None or begun.told_ns is not None or self.is_over:
            return False
        return begun.due.expected_ns > self.expires_ns

    def learn(self, entry: LifeEntry, now_ns: int) -> None:
        """Take in what the ground says of it now."""
        self.take_back, self.take_back_until_ns = entry.take_back, entry.take_back_until_ns
        if entry.stage is None:
            return
        stage = self.stages.setdefault(_slot(entry.stage), KnownStage())
        stage.verdict = entry.verdict
        if entry.verdict not in _KNOWN:
            return
        stage.so_ns = entry.so_ns
        stage.told_ns = now_ns if stage.told_ns is None else stage.told_ns
        if entry.stage.is_last:
            self.end, self.why = entry.stage, entry.why
            self.over_ns = now_ns if self.over_ns is None else self.over_ns

    def copy(self) -> "KnownCommand":
        """The same, which changes by itself."""
        return replace(self, stages={slot: copy(stage) for slot, stage in self.stages.items()})

    def says_news(self, entry: LifeEntry) -> bool:
        """Whether a verdict is worth a line: the first overdue or late one, and what resolves it.

        What ended with a reason has a line of its own.
        """
        if entry.verdict is Verdict.OVERDUE:
            return not self.is_overdue
        if entry.stage is None or entry.why is not None or entry.verdict not in _KNOWN:
            return False
        stage = self.stages.get(_slot(entry.stage))
        was_overdue = stage is not None and stage.is_overdue
        return was_overdue or (entry.verdict is Verdict.LATE and not self.is_late)

    # --- in words ------------------------------------------------------------------------------

    def words(self, now_ns: int) -> Iterator[str]:
        """What is known and what is due, the most important first, such as `begins in 2.9 s`."""
        if self.end is not None:
            yield self._ended(now_ns)
        elif self.over_ns is not None:
            yield f"over, told {_s(now_ns - self.over_ns)} ago, not yet how it ended"
        else:
            yield from self._open(now_ns)

    def _ended(self, now_ns: int) -> str:
        done = self.stages[_DONE]
        since_ns = done.told_ns if done.so_ns is None else done.so_ns
        text = self._past(_DONE) if self.end is _DONE else str(self.end)
        text += f" {_s(now_ns - (since_ns or 0))} ago, told {_s(now_ns - (done.told_ns or 0))} ago"
        return f"{text}: {self.why}" if self.why else f"{text}, {done.verdict}"

    def _open(self, now_ns: int) -> Iterator[str]:
        slot = self._next
        stage = self.stages.get(slot, KnownStage())
        if stage.due is None:
            yield f"sent {_s(now_ns - self.sent_ns)} ago"
        elif stage.is_overdue:
            since = _s(now_ns - stage.due.expected_ns)
            yield f"overdue: {self._should(slot)} {since} ago, no word"
        begun = self.stages.get(_BEGUN, KnownStage())
        if begun.told_ns is not None:
            since = "has begun" if begun.so_ns is None else f"began {_s(now_ns - begun.so_ns)} ago"
            yield f"{since}, told {_s(now_ns - begun.told_ns)} ago, {begun.verdict}"
        if stage.due is None or stage.is_overdue:
            return
        yield self._coming(slot, stage, stage.due, now_ns)
        until_ns = self.take_back_until_ns
        if self.take_back is TakeBackChance.SURE and until_ns is not None:
            yield f"take back: {_s(until_ns - now_ns)} left"
        yield f"word within {_s(stage.due.told_due_ns - now_ns)}"
        if self.take_back is TakeBackChance.OPEN and isinstance(self.order, ACTS):
            yield "take back: maybe too late"

    @property
    def _next(self) -> CommandStage:
        """The stage to wait for: what is overdue first; that it arrives matters only then."""
        order = (_BEGUN, _DONE, _TAKEN) if isinstance(self.order, ACTS) else (_DONE, _TAKEN)
        stages = {slot: self.stages[slot] for slot in order if slot in self.stages}
        missing = [slot for slot, stage in stages.items() if stage.told_ns is None]
        return next((slot for slot in missing if stages[slot].is_overdue), (*missing, _DONE)[0])

    def _coming(self, slot: CommandStage, stage: KnownStage, due: StageDue, now_ns: int) -> str:
        if stage.verdict is Verdict.UNKNOWN:
            return f"{self._should(slot)} {_s(now_ns - due.expected_ns)} ago"
        if self.lapses:
            left_ns = self.expires_ns - now_ns
            if left_ns > 0:
                return f"expires in {_s(left_ns)}, before its turn"
            return f"should have expired {_s(-left_ns)} ago, before its turn"
        coming = "takes effect" if self._takes_effect(slot) else _COMING[slot]
        left_ns = due.expected_ns - now_ns
        return f"{coming} in {_s(left_ns)}" if left_ns > 0 else f"{coming} about now"

    def _takes_effect(self, slot: CommandStage) -> bool:
        """Whether that stage is a change of a setting, which is not work that takes time."""
        return slot is _DONE and not isinstance(self.order, ACTS)

    def _past(self, slot: CommandStage) -> str:
        return "took effect" if self._takes_effect(slot) else HAPPENED[slot]

    def _should(self, slot: CommandStage) -> str:
        return "should have taken effect" if self._takes_effect(slot) else MISSED[slot]


@dataclass
class KnownCommands:
    """The commands that are not known to have ended, and the last eight that are.

    Attributes:
        open: those of which no end is known, by number; the newest 1000.
        ended: the others, in the order in which their ends were told.
        held: what stays at the ground until the link is up, by number of holding; the newest 1000.
    """

    open: dict[int, KnownCommand] = field(default_factory=dict)
    ended: deque[KnownCommand] = field(default_factory=lambda: deque(maxlen=_ENDED_KEPT))
    held: dict[int, tuple[Order, ...]] = field(default_factory=dict)

    def apply(self, message: msgspec.Struct, now_ns: int) -> None:
        """Take in what was logged at `now_ns` on one of `COMMAND_TOPICS`; ignore all else."""
        match message:
            case CommandSent():
                self._send(message, now_ns)
            case LifeEntry(number=number) if (command := self.open.get(number)) is not None:
                command.learn(message, now_ns)
                if command.end is not None:
                    self.ended.append(self.open.pop(number))
            case HeldEntry(number=number, fate=HeldFate.HELD, orders=orders):
                self.held[number] = orders
                _bound(self.held)
            case HeldEntry(number=number):
                self.held.pop(number, None)
            case Telemetry(commands_done=done):
                self.end_up_to(done, now_ns)

    def end_up_to(self, number: int, now_ns: int) -> None:
        """Take in that every command up to this number is over, done or not."""
        for open_number, command in self.open.items():
            if open_number <= number and command.over_ns is None:
                command.over_ns = now_ns

    def _send(self, sent: CommandSent, now_ns: int) -> None:
        stages = {due.stage: KnownStage(due) for due in sent.dues}
        self.open[sent.number] = KnownCommand(
            sent.number, sent.order, sent.when, now_ns, sent.expires_ns, stages
        )
        _bound(self.open)

    def forget(self, before_ns: int) -> None:
        """Forget those that were known to be over before a time."""
        for number, command in list(self.open.items()):
            if command.over_ns is not None and command.over_ns < before_ns:
                del self.open[number]
        while self.ended and (self.ended[0].stages[_DONE].told_ns or 0) < before_ns:
            self.ended.popleft()

    def copy(self) -> "KnownCommands":
        """The same, which changes by itself."""
        return KnownCommands(
            {number: command.copy() for number, command in self.open.items()},
            self.ended.copy(),
            dict(self.held),
        )

    def says_news(self, entry: LifeEntry) -> bool:
        """Whether a verdict is worth a line; see `KnownCommand.says_news`."""
        command = self.open.get(entry.number)
        return command is not None and command.says_news(entry)

    @property
    def on_the_way(self) -> int:
        """How many are not known to be over."""
        return sum(not command.is_over for command in self.open.values())

    @property
    def overdue(self) -> int:
        """Of how many word is missing."""
        return sum(command.is_overdue for command in self.open.values())

    def foremost(self, most: int) -> list[KnownCommand]:
        """The `most` that matter most, newest first: overdue, on their way, over, in this order."""
        commands = sorted((*self.open.values(), *self.ended), key=_rank)[:most]
        return sorted(commands, key=lambda command: -command.number)


def _rank(command: KnownCommand) -> tuple[bool, bool, int]:
    return not command.is_overdue, command.is_over, -command.number


def command_text(command: KnownCommand) -> str:
    """What a command is to do, and what it waits for on board: `drive E, after command 92`."""
    return order_text(command.order) + when_text(command.when)


def _slot(stage: CommandStage) -> CommandStage:
    """Where a stage is kept: whatever ends a command counts as done."""
    return _DONE if stage.is_last else stage


def _bound(kept: dict[int, Any]) -> None:
    if len(kept) > _OPEN_KEPT:
        del kept[next(iter(kept))]


def _s(duration_ns: int) -> str:
    return f"{to_s(max(0, duration_ns)):.1f} s"
