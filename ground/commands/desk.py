"""The command desk: the one owner of commands at the ground."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from copy import copy
from typing import NamedTuple

import msgspec

from farside.acts import Act, Discard, Planned
from farside.control import CommandStage, TakeBackChance
from farside.ground.commands.life import Foreseen, Life, bound, foresee
from farside.ground.commands.meaning import Meaning
from farside.ground.commands.timing import Timing
from farside.ground.moves import MoveTimes
from farside.link.endpoint.endpoint import FRAMED_BYTE
from farside.link.profile.schedule import Schedule
from farside.messages import Command, CommandReached, Order, Telemetry, When
from farside.node import NEVER_NS, Journal
from farside.topics import (
    GROUND_COMMAND,
    GROUND_HELD,
    GROUND_LIFE,
    CommandSent,
    HeldEntry,
    HeldFate,
    LifeEntry,
    StageDue,
)

_OVER_KEPT = 1000  # lives that are over: more than any operator looks back (project default)
_LONGER, _LONGEST = 4, 16  # times the validity that the mission gives

_encode = msgspec.msgpack.Encoder().encode


class Held(NamedTuple):
    """What stays at the ground until the link is up.

    Attributes:
        number: of holding, from 1; not that of a command.
        acts: what is held, in order.
        after: the command that the first of it is to follow on; `None` for none.
    """

    number: int
    acts: list[Planned]
    after: int | None


class Reviewed(msgspec.Struct, frozen=True):
    """What an act would be if it was given now.

    Attributes:
        number: the command's, unless others are given first.
        order: the order.
        when: what it would wait for on board.
        expires_ns: when it would expire.
        dues: when its stages would be due.
        take_back, take_back_until_ns: whether it could be taken back once it was sent, and until
            when for sure.
    """

    number: int
    order: Order
    when: When | None
    expires_ns: int
    dues: tuple[StageDue, ...]
    take_back: TakeBackChance
    take_back_until_ns: int | None


class CommandDesk:
    """Numbers commands from 1 without a gap, says when each expires, and follows their lives.

    A command expires so long after it can begin by plan: after it is due at the rover, behind what
    it follows, and not before its time. On a link that is open now and then, what is ordered when
    one opening is over expires before the next, every time. So after a command that expired the
    next ones are valid for four times as long as that one, up to sixteen times what the mission
    gives (project defaults), until one is done.

    Lives that are over are forgotten beyond the newest 1000; those that are not are all kept.

    Args:
        schedule: light times, rates and contacts.
        valid_ns: how long after it can begin a command may still be begun.
        times: how long moves take.
        least_move_ns: what a move takes at least unless it is blocked: the rover sees to it.
        action_of: answers which action an order asks for; `None` if for none, or if not known.
        journal: of the ground's node: what is given, held and learned is noted there.
        queued_until_ns: answers at any moment until when the ground's transmitter sends what it was
            given so far.

    Attributes:
        valid_ns: as given.
        last_given: number of the newest command, 0 before the first.
        held: what is held at the ground, by number of holding.
    """

    def __init__(
        self,
        schedule: Schedule,
        *,
        valid_ns: int,
        times: MoveTimes,
        least_move_ns: int,
        action_of: Callable[[Order], str | None],
        journal: Journal,
        queued_until_ns: Callable[[int], int],
    ) -> None:
        self._timing = Timing(schedule)
        self.valid_ns, self._least_move_ns = valid_ns, least_move_ns
        self._times_of, self._action_of = times, action_of
        self._journal, self._queued_until_ns = journal, queued_until_ns
        self.last_given = 0
        self.held: dict[int, Held] = {}
        self._last_held = 0
        self._tail: int | None = None  # the holding that the act given last is in
        self._silent = False
        self._telemetry: Telemetry | None = None
        self._meaning = Meaning()
        self._live: dict[int, Life] = {}
        self._over: OrderedDict[int, Life] = OrderedDict()
        self._line_ns = 0  # when the last command given leaves
        self._times = 1  # as long as `valid_ns` the next command is valid
        self._given_times: OrderedDict[int, int] = OrderedDict()
        self._wake_ns = NEVER_NS

    # --- what is learned -----------------------------------------------------------------------

    def learn(self, telemetry: Telemetry, now_ns: int = 0) -> None:
        """Telemetry says which commands are over, under way, or wait; it may be old."""
        newest = self._telemetry
        if newest is None or telemetry.time_ns >= newest.time_ns:
            self._telemetry = telemetry
        self._meaning.learn(self._telemetry, self._is_settled)
        news = [life.see(telemetry, now_ns) for life in self._live.values()]
        if any(news):
            self._judge(now_ns)

    def learn_stage(self, reached: CommandReached, so_ns: int = 0, now_ns: int = 0) -> None:
        """The rover says that a command came to a stage."""
        number = reached.number
        if reached.stage is CommandStage.EXPIRED:
            times = self._given_times.get(number, self._times)
            self._times = min(_LONGEST, max(self._times, _LONGER * times))
        life = self._live.get(number)
        if life is None:
            return
        life.reach(reached, so_ns, now_ns)
        if reached.stage is CommandStage.DONE and life.begun_ns is not None:
            self._time(life, so_ns - life.begun_ns)
        self._judge(now_ns)
        if life.end is not None:
            self._over[number] = self._live.pop(number)
            if len(self._over) > _OVER_KEPT:
                self._over.popitem(last=False)
            self._meaning.learn(self._telemetry, self._is_settled)

    def _time(self, life: Life, duration_ns: int) -> None:
        """Learn from an action how long moves take, where the one before is known."""
        before = self.life(life.number - 1)
        if before is not None and before.action is not None and life.action is not None:
            self._times_of.add(before.action, life.action, duration_ns)

    def _is_settled(self, number: int) -> bool:
        """Whether the newest telemetry shows the rover as this command left it, or it failed."""
        life, telemetry = self._over.get(number), self._telemetry
        if life is None or life.end is None:
            return False
        done_ns = life.stages[CommandStage.DONE].so_ns
        return (
            life.end.stage is not CommandStage.DONE
            or telemetry is None
            or done_ns is None
            or done_ns <= telemetry.time_ns
        )

    def follow(self, now_ns: int, *, silent: bool) -> list[Command]:
        """Judge what is due by now; the commands to send that were held until the link is up.

        To be called on every tick, before anything is given.

        Args:
            now_ns: the present.
            silent: whether the rover is not heard though it should be.
        """
        self._silent = silent
        if now_ns >= self._wake_ns or self._has_fewer_chances(now_ns):
            self._judge(now_ns)
        if not self.held or not self._link_is_up(now_ns):
            return []
        released: list[Command] = []
        for held in list(self.held.values()):
            commands = self._release(held, now_ns)
            self._note_held(held, HeldFate.RELEASED, tuple(one.number for one in commands))
            released += commands
        self._judge(now_ns)
        return released

    @property
    def is_settled(self) -> bool:
        """Whether all commands given so far are known to be over."""
        telemetry = self._telemetry
        return telemetry is not None and telemetry.commands_done >= self.last_given

    def end_of(self, number: int) -> CommandReached | None:
        """How a command ended that was not done; `None` if it was, or nothing is known yet."""
        life = self._over.get(number)
        if life is None or life.end is None or life.end.stage is CommandStage.DONE:
            return None
        return life.end

    def life(self, number: int) -> Life | None:
        """The life of a command; `None` if there is none, or it is forgotten."""
        return self._live.get(number) or self._over.get(number)

    @property
    def live(self) -> tuple[Life, ...]:
        """The lives of which no end is known, in order."""
        return tuple(self._live.values())

    @property
    def over(self) -> tuple[Life, ...]:
        """The lives of which the end is known, in the order in which it was learned."""
        return tuple(self._over.values())

    @property
    def foreseen(self) -> dict[int, Foreseen]:
        """When those of `live` are expected to be taken, begun and done, from what is known now."""
        return foresee(self._live.values(), self._times_of, self._timing.round_trip_ns)

    # --- what is given -------------------------------------------------------------------------

    def give(self, act: Act, now_ns: int) -> list[Command]:
        """The commands to send now, of what the operator gives now; none if it is held."""
        commands = self._take(act, now_ns)
        if commands:
            self._judge(now_ns)
        return commands

    def review(self, acts: Sequence[Act], now_ns: int) -> tuple[Reviewed, ...]:
        """What acts would be if they were given now, or with the link up; nothing is given."""
        trial = copy(self)
        trial.held, trial._tail = {}, None  # noqa: SLF001 - of its own kind
        trial._live, trial._meaning = dict(self._live), self._meaning.copy()  # noqa: SLF001
        trial._given_times = OrderedDict(self._given_times)  # noqa: SLF001
        trial._journal = Journal()  # noqa: SLF001
        commands: list[Command] = []
        for act in acts:
            at_once = act
            if isinstance(act, Planned):
                at_once = msgspec.structs.replace(act, link_up=False)
            if not isinstance(act, Discard):
                commands += trial._take(at_once, now_ns)  # noqa: SLF001
        return tuple(trial._reviewed(command, now_ns) for command in commands)  # noqa: SLF001

    def _reviewed(self, command: Command, now_ns: int) -> Reviewed:
        chance, until_ns = self._chance(self._live[command.number], self._ready_ns(now_ns))
        dues = self._live[command.number].dues
        number, expires_ns = command.number, command.expires_ns
        return Reviewed(number, command.order, command.when, expires_ns, dues, chance, until_ns)

    def _take(self, act: Act, now_ns: int) -> list[Command]:
        if isinstance(act, Discard):
            self._discard(act.held)
            return []
        if not isinstance(act, Planned):
            self._tail = None
            return [self._make(act, None, now_ns)]
        if act.follows and self._tail is not None:
            self.held[self._tail].acts.append(act)
            self._note_held(self.held[self._tail], HeldFate.HELD)
            return []
        after = self.last_given if act.follows and self.last_given else None
        held = Held(self._last_held + 1, [act], after)
        if not act.link_up or self._link_is_up(now_ns):
            self._tail = None
            return self._release(held, now_ns)
        self._tail = self._last_held = held.number
        self.held[held.number] = held
        self._note_held(held, HeldFate.HELD)
        return []

    def _discard(self, number: int) -> None:
        held = self.held.pop(number, None)
        if held is not None:
            self._tail = None if self._tail == number else self._tail
            self._note_held(held, HeldFate.GIVEN_UP)

    def _release(self, held: Held, now_ns: int) -> list[Command]:
        self.held.pop(held.number, None)
        self._tail = None if self._tail == held.number else self._tail
        commands: list[Command] = []
        after = held.after
        for act in held.acts:
            when = When(after if act.follows else None, act.at_ns)
            commands.append(self._make(act.order, when if when != When() else None, now_ns))
            after = self.last_given
        return commands

    def _make(self, order: Order, when: When | None, now_ns: int) -> Command:
        """The next command; its life begins."""
        if self.is_settled and self.last_given and self.end_of(self.last_given) is None:
            self._times = 1
        number = self.last_given = self.last_given + 1
        meant = self._meaning.of(order, number, waits=when is not None)
        command = Command(number, NEVER_NS, order, meant, when)
        size_byte = len(_encode(command)) + FRAMED_BYTE
        leaves_ns = self._timing.leaves_ns(self._ready_ns(now_ns), size_byte)
        least_ns = self._timing.arrives_ns(self._timing.leaves_ns(now_ns, 0))
        action = self._action_of(order)
        life = Life(command, action, now_ns, self._timing.arrives_ns(leaves_ns), least_ns)
        self._line_ns = leaves_ns
        foreseen = foresee(
            [*self._live.values(), life], self._times_of, self._timing.round_trip_ns
        )[number]
        life.expect(foreseen, self._timing)
        earliest_ns = foreseen.taken_ns if when is None else foreseen.begun_ns
        expires_ns = min(NEVER_NS, earliest_ns + self._times * self.valid_ns)
        command = life.command = msgspec.structs.replace(command, expires_ns=expires_ns)
        self._live[number] = life
        self._given_times[number] = self._times
        if len(self._given_times) > _OVER_KEPT:
            self._given_times.popitem(last=False)
        life.begins_ns = bound(life, self.life, self._least_move_ns)
        sent = CommandSent(number, order, expires_ns, meant, when, life.dues)
        self._journal.note(GROUND_COMMAND, sent)
        return command

    # --- what can be taken back ----------------------------------------------------------------

    def take_back(self, number: int, now_ns: int) -> tuple[TakeBackChance, int | None]:
        """Whether a command can be taken back, and until when for sure.

        The promise: an order to take it back that is given by then, and is taken on board when it
        is due, finds that it has not begun. It holds for the transmit queue as it is: what is given
        in between may use it up. What is held at the ground has no number yet: see `Discard`.
        """
        life = self.life(number)
        if life is None:
            chance = TakeBackChance.HERE if number > self.last_given else TakeBackChance.TOO_LATE
            return chance, None
        return self._chance(life, self._ready_ns(now_ns))

    def _chance(self, life: Life, ready_ns: int) -> tuple[TakeBackChance, int | None]:
        if life.has_begun:
            return TakeBackChance.TOO_LATE, None
        until_ns = self._timing.withdraw_until_ns(ready_ns, life.begins_ns)
        if until_ns is None:
            return TakeBackChance.OPEN, None
        return TakeBackChance.SURE, until_ns

    def _has_fewer_chances(self, now_ns: int) -> bool:
        """Whether any that could be taken back for sure cannot any more."""
        sure = [life for life in self._live.values() if life.take_back[0] is TakeBackChance.SURE]
        if not sure:
            return False
        withdrawn_ns = self._timing.withdrawn_ns(self._ready_ns(now_ns))
        return any(withdrawn_ns > life.begins_ns for life in sure)

    def _ready_ns(self, now_ns: int) -> int:
        """When the transmitter begins to send what it is given now."""
        return max(now_ns, self._line_ns, self._queued_until_ns(now_ns))

    # --- what is told --------------------------------------------------------------------------

    def _link_is_up(self, now_ns: int) -> bool:
        return not self._silent and self._timing.is_open(now_ns)

    def _judge(self, now_ns: int) -> None:
        """Note the verdicts and chances that are new."""
        self._wake_ns = NEVER_NS
        ready_ns = self._ready_ns(now_ns)
        for life in self._live.values():
            life.begins_ns = bound(life, self.life, self._least_move_ns)
            before, life.take_back = life.take_back, self._chance(life, ready_ns)
            entries = list(life.judge(now_ns))
            if not entries and life.take_back != before:
                chance, until_ns = life.take_back
                entries = [LifeEntry(life.number, take_back=chance, take_back_until_ns=until_ns)]
            for entry in entries:
                self._journal.note(GROUND_LIFE, entry)
            self._wake_ns = min(self._wake_ns, life.wakes_ns(now_ns))

    def _note_held(self, held: Held, fate: HeldFate, commands: tuple[int, ...] = ()) -> None:
        orders = tuple(act.order for act in held.acts)
        self._journal.note(GROUND_HELD, HeldEntry(held.number, orders, fate, commands))
