"""State, numbers and events of the rover, in truth, on board and as the ground has them."""

import msgspec

from farside.logs.events import sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.foxglove.names import (
    GROUND_EVENTS,
    GROUND_NUMBERS,
    GROUND_STATE,
    ROVER_EVENTS,
    ROVER_NUMBERS,
    ROVER_STATE,
    TRUTH_NUMBERS,
)
from farside.logs.foxglove.poses import Drawn, HeardPose, TruePose
from farside.logs.foxglove.states import (
    NONE,
    UNKNOWN,
    GroundNumbers,
    GroundState,
    RoverNumbers,
    RoverState,
    TruthNumbers,
)
from farside.logs.foxglove.telling import PLOT_NS, told, told_event
from farside.logs.picture import Picture
from farside.messages import Tokens
from farside.node import to_s
from farside.topics import (
    ActionEnded,
    ActionStarted,
    BatteryEntry,
    Cycle,
    FailsafeEntry,
    LifeEntry,
    ModeEntry,
    PolicyMapEntry,
    Prediction,
    ShadowEntry,
    Silence,
    StuckEntry,
)

_CHARGE_SHOWN, _SPEED_SHOWN_M_S = 0.001, 0.01


class TruthSide:
    """The true numbers of the rover."""

    def __init__(self) -> None:
        self._last = TruthNumbers(-1.0, 0.0)

    def condition(self, t_ns: int, pose: TruePose) -> Drawn:
        """Battery and speed, where a plot would show the change."""
        last = self._last
        if (
            abs(pose.speed_m_s - last.speed_m_s) < _SPEED_SHOWN_M_S
            and abs(pose.battery - last.battery) < _CHARGE_SHOWN
        ):
            return ()
        self._last = TruthNumbers(pose.battery, pose.speed_m_s)
        return told(TRUTH_NUMBERS, t_ns, self._last)


class RoverSide:
    """The rover's state, numbers and events."""

    def __init__(self) -> None:
        self._picture = Picture()
        self._state = RoverState(UNKNOWN, UNKNOWN, UNKNOWN, stuck=False, action=NONE, goal=NONE)
        self._numbers = RoverNumbers(0, 0, 0.0, 0, 0)

    def event(self, entry: LogEntry) -> Drawn:
        """What happened, if it is news."""
        return told_event(ROVER_EVENTS, "rover", self._picture, entry)

    def state(self, t_ns: int, message: msgspec.Struct) -> Drawn:
        """Its state, if that has changed."""
        replace, now = msgspec.structs.replace, self._state
        match message:
            case ModeEntry(mode=mode):
                now = replace(now, mode=mode)
            case FailsafeEntry(state=failsafe):
                now = replace(now, failsafe=failsafe)
            case BatteryEntry(state=battery):
                now = replace(now, battery=battery)
            case StuckEntry(stuck=stuck):
                now = replace(now, stuck=stuck)
            case ActionStarted(action=action):
                now = replace(now, action=action)
            case ActionEnded():
                now = replace(now, action=NONE)
            case PolicyMapEntry(goal=goal):
                now = replace(now, goal=_goal(goal))
        if now == self._state:
            return ()
        self._state = now
        return told(ROVER_STATE, t_ns, now)

    def cycle(self, t_ns: int, cycle: Cycle) -> Drawn:
        """The lists after a cycle."""
        before = self._numbers
        self._numbers = RoverNumbers(
            signs=cycle.signs,
            hypotheses=cycle.hypotheses,
            mean_cm=cycle.mean_cm,
            surprises=before.surprises + len(cycle.novel) + len(cycle.unexpected),
            failed_predictions=before.failed_predictions + cycle.failed,
        )
        return told(ROVER_NUMBERS, t_ns, self._numbers)


class KnownWord(msgspec.Struct, frozen=True):
    """A `farside.topics.Known` word: its value."""

    value: str | None


class KnownSigns(msgspec.Struct, frozen=True):
    """The Goal List as the ground knows it."""

    value: tuple[Tokens, ...]


class KnownNumber(msgspec.Struct, frozen=True):
    """A number as the ground knows it, and when it was so."""

    value: int | None
    so_ns: int


class Believed(msgspec.Struct, frozen=True):
    """A `farside.topics.BeliefEntry`, as far as it is told of here."""

    stale: tuple[str, ...]
    mode: KnownWord | None = None
    failsafe: KnownWord | None = None
    action: KnownWord | None = None
    goals: KnownSigns | None = None
    proposal: KnownNumber | None = None


class GroundSide:
    """What the ground knows, in states, numbers and events; from its own records only."""

    def __init__(self) -> None:
        self._picture = Picture()
        self._state = GroundState(
            UNKNOWN, UNKNOWN, NONE, NONE, link=UNKNOWN, stale=False, shadow=NONE
        )
        self._battery: float | None = None
        self._plot_at_ns = 0
        self._commands_done = 0

    def event(self, entry: LogEntry) -> Drawn:
        """What happened or was learned, if it is news."""
        message, commands = entry.message, self._picture.commands
        if isinstance(message, LifeEntry) and not commands.says_news(message):
            commands.apply(message, entry.log_time_ns)
            return ()
        return told_event(GROUND_EVENTS, "ground", self._picture, entry)

    def hear(self, t_ns: int, telemetry: HeardPose) -> Drawn:
        """Telemetry has come, newer than all before it."""
        self._battery = telemetry.battery
        if telemetry.commands_done != self._commands_done:
            self._commands_done = telemetry.commands_done
            self._picture.commands.end_up_to(telemetry.commands_done, t_ns)
        # Silence is told of from its first time on.
        if self._state.link != UNKNOWN:
            return ()
        self._state = msgspec.structs.replace(self._state, link="heard")
        return told(GROUND_STATE, t_ns, self._state)

    def state(self, t_ns: int, message: msgspec.Struct) -> Drawn:
        """The state of the rover as it is believed to be, if that has changed."""
        replace, now = msgspec.structs.replace, self._state
        match message:
            case Believed(mode=mode, failsafe=failsafe, goals=goals, stale=stale) as belief:
                now = replace(
                    now,
                    mode=_known(mode),
                    failsafe=_known(failsafe),
                    action=_known(belief.action),
                    goal=_goal(goals.value[0] if goals is not None and goals.value else None),
                    stale=bool(stale),
                )
            case Silence(silent=silent, expected=expected):
                link = "silent" if silent else "expected silence" if expected else "heard"
                now = replace(now, link=link)
            case ShadowEntry(in_step=in_step):
                now = replace(now, shadow="in step" if in_step else "out of step")
        if now == self._state:
            return ()
        self._state = now
        return told(GROUND_STATE, t_ns, now)

    def prediction(self, t_ns: int, prediction: Prediction) -> Drawn:
        """How old and how sure it is what the ground knows."""
        if self._battery is None or t_ns < self._plot_at_ns:
            return ()
        self._plot_at_ns = t_ns + PLOT_NS
        likely = prediction.likely
        numbers = GroundNumbers(
            battery=self._battery,
            telemetry_age_s=to_s(t_ns - prediction.from_ns),
            commands_underway=self._picture.commands.on_the_way,
            place_probability=likely[0].probability if likely else 0.0,
        )
        return told(GROUND_NUMBERS, t_ns, numbers)


def _known(known: KnownWord | None) -> str:
    if known is None:
        return UNKNOWN
    return NONE if known.value is None else known.value


def _goal(goal: Tokens | None) -> str:
    return NONE if goal is None else sign_text(goal)
