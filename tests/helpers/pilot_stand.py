"""A pilot on a stand: pilot, authority and watch are real, and what they look at is set by hand."""

from enum import StrEnum
from typing import Any, NamedTuple, cast

from farside.control import Cause, Chooser, Failsafe, Mode, ModeCause, OnLoss, Signal
from farside.dem import Choice, Goal
from farside.messages import Command, Drive, Happening, Proposal, Tokens
from farside.node import Journal
from farside.rover.commands import Assignment
from farside.rover.config import FailsafeConfig
from farside.rover.control.authority import Conditions, Parts, _Away
from farside.rover.events import EventQueue
from farside.rover.failsafe.table import orders_for, rule_for
from farside.rover.failsafe.watch import FailsafeWatch
from farside.rover.pilot import Pilot

GOAL: Tokens = ("at:1,1",)
ANSWER = Proposal(number=1, time_ns=0, goal=GOAL, action="N", path=(), veto_window_s=10.0)


class Word(StrEnum):
    """What the operator can say about who drives."""

    GUIDED = "set mode guided"
    SHARED = "set mode shared"
    AUTONOMOUS = "set mode autonomous"
    DRIVE = "drive"
    FORBID = "forbid autonomy on loss"
    ALLOW = "allow autonomy on loss"


MODES = {
    Word.GUIDED: Mode.GUIDED,
    Word.SHARED: Mode.SHARED,
    Word.AUTONOMOUS: Mode.AUTONOMOUS,
}
TOGGLED = tuple(one for one in Cause if one not in {Cause.UNCONFIRMED, Cause.FORBIDDEN})
"""The causes that come and go. The other two follow from what is said and done."""
EVENTS: tuple[Cause | Word, ...] = (*TOGGLED, *Word)


class Memory(NamedTuple):
    """All that is remembered from one tick to the next."""

    present: frozenset[Cause]
    seen: tuple[bool, ...]
    mode: Mode
    why: ModeCause
    on_loss: OnLoss
    confirmed: bool
    away: bool
    mission: bool


class Moment(NamedTuple):
    """What shows from outside after a tick.

    Attributes:
        state, reason: of the failsafe.
        mode, why: who drives, and what brought it about.
        acts: who chooses what the rover would begin of its own; `None` if it begins nothing.
        begins: whether it would begin an order.
        forced: whether it would begin an order with which the operator insists.
        mission: whether the mission goals are on the list.
    """

    state: Failsafe
    reason: str
    mode: Mode
    why: ModeCause
    acts: Chooser | None
    begins: bool
    forced: bool
    mission: bool


class _Silence:
    heard_ns = quiet_ns = countdown_ns = 0
    silent = expected = lost = False

    def look(self, now_ns: int) -> None:
        pass


class _Goals:
    """One goal of the operator's, or none; the mission goals are on the list or not."""

    any_for_alone = mission = False
    top = None
    all: tuple[Goal, ...] = ()

    def __init__(self) -> None:
        self.reached_lately: list[Tokens] = []

    @property
    def listed(self) -> tuple[Tokens, ...]:
        return (GOAL,) if self.any_for_alone else ()

    def follow_mission(self, *, wanted: bool) -> None:
        self.mission = wanted

    def follow_inherent(self, tokens: Tokens, priority: float | None) -> None:
        pass

    def most_wanted_beside(self, *_tokens: Tokens) -> float:
        return 0.0


class _Cycle:
    tokens: frozenset[str] = frozenset()
    number = 0

    def choose(self, **_explore: bool) -> Choice:
        return Choice("N", GOAL)

    def decided(self, *args: object, **kwargs: object) -> None:
        pass


class _Commands:
    """One order waits for good, or none."""

    next: Assignment | None = None

    @property
    def waits(self) -> bool:
        return self.next is not None

    def ripe(self, now_ns: int) -> None:
        pass

    def tell_missing(self, now_ns: int) -> None:
        pass

    def expire(self, _now_ns: int) -> bool:
        return False

    def begin(self, *_forced: str | None) -> None:
        self.next = None

    def drop_next(self, *_args: object) -> None:
        self.next = None

    def drop_all(self, *_args: object) -> None:
        self.next = None


class _Proposals:
    """The operator was shown a proposal and let the veto window pass, as often as it is asked."""

    standing = ANSWER
    chooser = Chooser.GOAL_DIRECTED
    has_consent = True

    def follow(self, situation: object) -> None:
        pass

    def end(self, why: str) -> None:
        pass


class _Gate:
    reserve = False

    def refusal(self, action: str, here: frozenset[str], *, bumps: bool) -> None:
        pass


class _Battery:
    empty = low = False
    urgency = 0.0

    def ask_for_charge(self) -> None:
        pass


class PilotStand:
    """Hands the pilot what is so and what the operator says, tick by tick.

    Args:
        on_loss: what the mission says about autonomy on loss.

    Attributes:
        pilot: the real one.
        present: the causes of `TOGGLED` that are so now.
    """

    def __init__(self, on_loss: OnLoss = OnLoss.AUTONOMY) -> None:
        self._silence, self._goals, self._gate = _Silence(), _Goals(), _Gate()
        self._commands = _Commands()
        self.journal = Journal()
        self._events = EventQueue(self.journal)
        self._watch = FailsafeWatch(cast("Any", self._silence), self.journal, self._events)
        parts = {
            "cycle": _Cycle(),
            "goals": self._goals,
            "commands": self._commands,
            "proposals": _Proposals(),
            "silence": self._silence,
            "watch": self._watch,
            "gate": self._gate,
            "tracks": {},
            "battery": _Battery(),
            "journal": self.journal,
            "events": self._events,
        }
        self.pilot = Pilot(
            Parts(**cast("Any", parts)), FailsafeConfig(on_loss=on_loss), has_dock=True
        )
        self.present: frozenset[Cause] = frozenset()
        self.tick()

    def happen(self, event: Cause | Word) -> None:
        """Toggle a cause, or have the operator say a word; nobody looks yet."""
        authority = self.pilot.authority
        match event:
            case Cause():
                self.present ^= {event}
            case Word.DRIVE:
                authority.take_over()
            case Word.FORBID:
                authority.on_loss = OnLoss.HOLD
            case Word.ALLOW:
                authority.on_loss = OnLoss.AUTONOMY
            case Word():
                authority.order(MODES[event])

    def tick(self) -> list[Happening]:
        """Have the pilot look; what it tells the ground."""
        self.pilot.look(self._set_up(), 0)
        return [event.what for event in self._events.take()]

    def _set_up(self) -> Conditions:
        """Have everything be as it is to be."""
        present = self.present
        self._silence.silent = Cause.SILENCE in present
        self._silence.expected = Cause.EXPECTED_SILENCE in present
        self._silence.lost = Cause.LOST in present
        self._goals.any_for_alone = Cause.EXHAUSTED not in present
        self._gate.reserve = Cause.RESERVE in present
        return Conditions(
            place=None if Cause.SENSOR_DEAD in present else "at:0,0",
            signal=Signal.NONE if Cause.NO_SIGNAL in present else Signal.STRONG,
            stuck=Cause.STUCK in present,
            tilted=Cause.TILT in present,
        )

    def moment(self) -> Moment:
        """What shows now; looking at it changes nothing."""
        authority, rule = self.pilot.authority, self._watch.rule
        own = self.pilot.next()
        return Moment(
            rule.state,
            rule.why,
            authority.mode,
            authority._why,
            None if own is None else own.chooser,
            self._begins(force=False),
            self._begins(force=True),
            self._goals.mission,
        )

    def _begins(self, *, force: bool) -> bool:
        """Whether an order that came by now would begin."""
        drive = Command(1, 1, Drive("N", force))
        self._commands.next = Assignment(drive, "N", force=force)
        begun = self.pilot.next()
        self._commands.next = None
        self._events.take()
        return begun is not None and begun.command == 1

    # --- to go on from any state -----------------------------------------------------------------

    @property
    def memory(self) -> Memory:
        """All that is remembered."""
        authority = self.pilot.authority
        return Memory(
            self.present,
            self._watch._so,
            authority.mode,
            authority._why,
            authority.on_loss,
            authority._confirmed,
            authority._away is not None,
            self._goals.mission,
        )

    def recall(self, memory: Memory) -> None:
        """Go back to how things were after a tick."""
        authority, watch = self.pilot.authority, self._watch
        self.present = memory.present
        self._set_up()
        authority.mode, authority._why = memory.mode, memory.why
        authority.on_loss, authority._confirmed = memory.on_loss, memory.confirmed
        authority._away = _Away(0) if memory.away else None
        self._goals.mission = memory.mission
        watch._so = memory.seen
        watch.rule, watch.orders = rule_for(watch._causes), orders_for(watch._causes)
