"""Authority: who drives, by whose word, and what the loss of the link makes of it."""

from collections.abc import Mapping
from typing import NamedTuple

from farside.control import Cause, CommandStage, Failsafe, Mode, ModeCause, OnLoss, Signal
from farside.messages import LinkBack, ModeChanged, Tokens
from farside.node import Journal
from farside.places import LINK_UP, ON_CHARGE
from farside.rover.battery import Battery
from farside.rover.commands import Commands
from farside.rover.config import FailsafeConfig, ReturnTo
from farside.rover.control.cycle import ControlCycle
from farside.rover.control.proposals import Proposals
from farside.rover.events import EventQueue
from farside.rover.failsafe.gate import SafetyGate
from farside.rover.failsafe.silence import Silence
from farside.rover.failsafe.track import Track
from farside.rover.failsafe.watch import FailsafeWatch
from farside.rover.goals import Goals
from farside.topics import ROVER_MODE, ModeEntry, reasons


class Conditions(NamedTuple):
    """What is so of the rover's body and its surroundings.

    Attributes:
        place: the Token of the place where it is; `None` while it does not know.
        signal: strength of the radio's signal.
        stuck: whether it cannot move any more.
        tilted: whether it tilts more than it may.
    """

    place: str | None
    signal: Signal
    stuck: bool
    tilted: bool


class Parts(NamedTuple):
    """What the pilot works with; each is the one owner of what it is named for.

    `tracks` lead back to where a goal of the rover's own is reached.
    """

    cycle: ControlCycle
    goals: Goals
    commands: Commands
    proposals: Proposals
    silence: Silence
    watch: FailsafeWatch
    gate: SafetyGate
    tracks: Mapping[Tokens, Track]
    battery: Battery
    journal: Journal
    events: EventQueue


class _Away:
    """What the rover has done since the link was lost."""

    def __init__(self, heard_ns: int) -> None:
        self.heard_ns = heard_ns
        self.moves = self.bumps = 0


class Authority:
    """The one owner of the mode.

    The failsafe, see `farside.rover.failsafe.table`, stands above all modes. After the rover took
    over since the link was lost, control goes back in two steps: the link is back, upon which it
    begins nothing of its own; then the operator takes over, by a mode or a drive, or confirms
    autonomous mode.

    Args:
        parts: what decides it, and what follows.
        config: of the failsafe.
        has_dock: whether there is a dock to charge at.

    Attributes:
        mode: who drives.
        on_loss: what to do when the link is lost.
        conditions: what was so at the last look.
    """

    def __init__(self, parts: Parts, config: FailsafeConfig, *, has_dock: bool) -> None:
        self._parts = parts
        self._config = config
        self._has_dock = has_dock
        self.mode = Mode.GUIDED
        self._why = ModeCause.START
        self.on_loss = config.on_loss
        self._confirmed = False  # that the mission goals be pursued though the link is back
        self.conditions = Conditions(None, Signal.STRONG, stuck=False, tilted=False)
        self._away: _Away | None = None
        parts.journal.note(ROVER_MODE, ModeEntry(self.mode, self._why))

    def change(self, config: FailsafeConfig) -> None:
        """Go by another failsafe from now on; what the operator said of `on_loss` stays."""
        if config.on_loss is not self._config.on_loss:
            self.on_loss = config.on_loss
        self._config = config

    # --- what is so ----------------------------------------------------------------------------

    def look(self, conditions: Conditions, now_ns: int) -> bool:
        """Follow what is so at this moment; true if the failsafe has another reason than before."""
        parts, silence = self._parts, self._parts.silence
        self.conditions = conditions
        silence.look(now_ns)
        self._follow_inherent_goals()
        changed = self._look_in_table()
        if silence.lost:
            self._lose()
        else:
            if self._away is not None:
                self._find_again(now_ns)
            parts.goals.reached_lately.clear()
        parts.goals.follow_mission(wanted=self._is_alone or self._confirmed)
        return changed

    def _look_in_table(self) -> bool:
        """Have the failsafe follow what is so; true if it has another reason than before."""
        silence, conditions = self._parts.silence, self.conditions
        so = (  # of `CAUSES`, in their order
            silence.expected and not silence.silent,
            silence.silent,
            silence.lost,
            self._why is ModeCause.LINK_LOST,
            self.on_loss is OnLoss.HOLD,
            not self._parts.goals.any_for_alone,
            self._parts.gate.reserve,
            conditions.signal is Signal.NONE,
            conditions.stuck,
            conditions.tilted,
            conditions.place is None,
        )
        return self._parts.watch.look(so)

    @property
    def _is_alone(self) -> bool:
        return self._parts.watch.state is Failsafe.ALONE

    def _follow_inherent_goals(self) -> None:
        goals, battery, gate = self._parts.goals, self._parts.battery, self._parts.gate
        if gate.reserve:
            battery.ask_for_charge()
        charge: float | None = None
        if self._has_dock and battery.low and ON_CHARGE not in self._parts.cycle.tokens:
            charge = battery.urgency
            if gate.reserve:
                charge = max(charge, 1 + goals.most_wanted_beside((ON_CHARGE,)))
        goals.follow_inherent((ON_CHARGE,), charge)
        wants_signal = (
            self._parts.silence.lost
            and self.conditions.signal is Signal.NONE
            and self._config.return_to is not ReturnTo.NONE
        )
        goals.follow_inherent((LINK_UP,), self._config.return_priority if wants_signal else None)

    def _lose(self) -> None:
        """The link is lost: drop what waits and, if the failsafe says so, act alone."""
        parts = self._parts
        if self._away is None:
            self._away = _Away(parts.silence.heard_ns)
        parts.commands.drop_all(CommandStage.SUPERSEDED, reasons.LINK_LOST.of())
        if self._is_alone and self.mode is not Mode.AUTONOMOUS:
            self._switch(Mode.AUTONOMOUS, ModeCause.LINK_LOST)

    def _find_again(self, now_ns: int) -> None:
        """The link is back: tell what was done meanwhile."""
        assert self._away is not None  # noqa: S101 - checked by the caller
        away, self._away = self._away, None
        reached = tuple(self._parts.goals.reached_lately)
        silence_ns = max(0, now_ns - away.heard_ns)
        self._parts.events.tell(LinkBack(silence_ns, away.moves, away.bumps, reached))

    @property
    def is_unconfirmed(self) -> bool:
        """Whether the link is back after the rover took over, and nobody has said who drives."""
        return self._parts.watch.rule.when == {Cause.UNCONFIRMED}

    def moved(self, *, blocked: bool) -> None:
        """A move has ended, whoever chose it."""
        if self._away is not None:
            self._away.moves += 1
            self._away.bumps += blocked

    def order(self, mode: Mode) -> None:
        """The operator says who drives: takes over, or confirms what the rover took up alone."""
        self._confirmed = mode is Mode.AUTONOMOUS and (
            self._confirmed or self._why is ModeCause.LINK_LOST
        )
        self._switch(mode, ModeCause.OPERATOR)

    def take_over(self) -> None:
        """The operator drives: in autonomous mode that is the end of it."""
        if self.mode is Mode.AUTONOMOUS:
            self._switch(Mode.GUIDED, ModeCause.TAKEN_OVER)

    def _switch(self, mode: Mode, why: ModeCause) -> None:
        if (mode, why) == (self.mode, self._why) or (
            mode is self.mode and self._why is not ModeCause.LINK_LOST
        ):
            return
        self.mode, self._why = mode, why
        if mode is not Mode.AUTONOMOUS:
            self._confirmed = False
        self._parts.journal.note(ROVER_MODE, ModeEntry(mode, why))
        self._parts.events.tell(ModeChanged(mode, why))
