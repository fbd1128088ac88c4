"""State, numbers and events of the rover, of the link and of the ground, each from its records."""

from collections.abc import Callable
from typing import Any

import msgspec
from foxglove.messages import Log, LogLevel

from farside.control import BatteryState, Failsafe, Verdict
from farside.frames import LinkOutage
from farside.logs.events import event_line, sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.foxglove.names import (
    GROUND_EVENTS,
    GROUND_NUMBERS,
    GROUND_STATE,
    LINK_EVENTS,
    LINK_NUMBERS,
    LINK_STATE,
    PICTURES,
    ROVER_EVENTS,
    ROVER_NUMBERS,
    ROVER_STATE,
    TRUTH_NUMBERS,
    PictureTopic,
)
from farside.logs.foxglove.poses import Drawn, TruePose
from farside.logs.foxglove.protobuf import encoder
from farside.logs.foxglove.shapes import stamp
from farside.logs.foxglove.states import (
    NONE,
    OPEN,
    UNKNOWN,
    GroundNumbers,
    GroundState,
    LinkNumbers,
    LinkState,
    RoverNumbers,
    RoverState,
    TruthNumbers,
)
from farside.logs.picture import Picture
from farside.messages import CommandReached, Event, Telemetry, Tokens
from farside.node import NS_PER_S, Direction, Record, to_s
from farside.topics import (
    ActionEnded,
    ActionStarted,
    BatteryEntry,
    CommandEntry,
    Cycle,
    EventLearned,
    FailsafeEntry,
    LifeEntry,
    ModeEntry,
    PolicyMapEntry,
    Prediction,
    ShadowEntry,
    Silence,
    StuckEntry,
)

_PLOT_NS = 5 * NS_PER_S
"""How often numbers are told that change all the time (project default)."""

_CHARGE_SHOWN, _SPEED_SHOWN_M_S = 0.001, 0.01

_ENCODERS: dict[type[msgspec.Struct], Callable[[Any], bytes]] = {
    picture.kind: encoder(picture.kind)
    for picture in PICTURES.values()
    if not isinstance(picture.kind, str)
}


def _told(topic: PictureTopic, t_ns: int, message: msgspec.Struct) -> Drawn:
    return (Record(topic.name, t_ns, t_ns, _ENCODERS[type(message)](message)),)


class TruthSide:
    """The true numbers of the rover."""

    def __init__(self) -> None:
        self._told = TruthNumbers(-1.0, 0.0)

    def condition(self, t_ns: int, pose: TruePose) -> Drawn:
        """Battery and speed, where a plot would show the change."""
        told = self._told
        if (
            abs(pose.speed_m_s - told.speed_m_s) < _SPEED_SHOWN_M_S
            and abs(pose.battery - told.battery) < _CHARGE_SHOWN
        ):
            return ()
        self._told = TruthNumbers(pose.battery, pose.speed_m_s)
        return _told(TRUTH_NUMBERS, t_ns, self._told)


class RoverSide:
    """The rover's state, numbers and events."""

    def __init__(self) -> None:
        self._picture = Picture()
        self._state = RoverState(UNKNOWN, UNKNOWN, UNKNOWN, stuck=False, action=NONE, goal=NONE)
        self._numbers = RoverNumbers(0, 0, 0.0, 0, 0)

    def event(self, entry: LogEntry) -> Drawn:
        """What happened, if it is news."""
        return _event(ROVER_EVENTS, "rover", self._picture, entry)

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
        return _told(ROVER_STATE, t_ns, now)

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
        return _told(ROVER_NUMBERS, t_ns, self._numbers)


class SentFrame(msgspec.Struct, frozen=True, gc=False):
    """A `farside.frames.FrameFate`, as far as it is counted here."""

    direction: Direction
    size_byte: int
    queued_ns: int
    sent_ns: int
    sent_end_ns: int
    arrival_ns: int | None


class _Way:
    """One direction of the link.

    Attributes:
        delay_ns: of the last frame delivered.
        queue_ns: how long the last frame sent had waited.
        lost: how many frames were not delivered.
        byte: sent since the numbers were told.
    """

    __slots__ = ("byte", "delay_ns", "lost", "queue_ns")

    def __init__(self) -> None:
        self.delay_ns = self.queue_ns = self.lost = self.byte = 0


class LinkSide:
    """The link's state, numbers and events."""

    def __init__(self) -> None:
        self._state = LinkState(OPEN, OPEN)
        self._ways = {direction: _Way() for direction in Direction}
        self._told_ns = 0

    def start(self, t_ns: int, _message: msgspec.Struct) -> Drawn:
        """The run begins with the link open."""
        return _told(LINK_STATE, t_ns, self._state)

    def event(self, entry: LogEntry) -> Drawn:
        """What happened."""
        return _event(LINK_EVENTS, "link", None, entry)

    def outage(self, t_ns: int, outage: LinkOutage) -> Drawn:
        """An outage begins or ends."""
        now = str(outage.reason) if outage.down else OPEN
        if outage.direction is Direction.UP:
            self._state = LinkState(now, self._state.down)
        else:
            self._state = LinkState(self._state.up, now)
        return _told(LINK_STATE, t_ns, self._state)

    def frame(self, t_ns: int, frame: SentFrame) -> Drawn:
        """A frame's fate; the numbers follow from all since they were told last."""
        way, queued_ns = self._ways[frame.direction], frame.queued_ns
        if frame.arrival_ns is None:
            way.lost += 1
        else:
            way.delay_ns = frame.arrival_ns - queued_ns
        if frame.sent_end_ns > queued_ns:
            way.queue_ns = frame.sent_ns - queued_ns
            way.byte += frame.size_byte
        since_ns = t_ns - self._told_ns
        if since_ns < _PLOT_NS:
            return ()
        up, down = self._ways[Direction.UP], self._ways[Direction.DOWN]
        numbers = LinkNumbers(
            up_delay_s=to_s(up.delay_ns),
            down_delay_s=to_s(down.delay_ns),
            up_rate_bit_s=round(8 * up.byte / to_s(since_ns)),
            down_rate_bit_s=round(8 * down.byte / to_s(since_ns)),
            up_queue_s=to_s(up.queue_ns),
            down_queue_s=to_s(down.queue_ns),
            up_lost_frames=up.lost,
            down_lost_frames=down.lost,
        )
        self._told_ns = t_ns
        up.byte = down.byte = 0
        return _told(LINK_NUMBERS, t_ns, numbers)


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
        return _event(GROUND_EVENTS, "ground", self._picture, entry)

    def hear(self, t_ns: int, telemetry: Telemetry) -> Drawn:
        """Telemetry has come, newer than all before it."""
        self._battery = telemetry.battery
        if telemetry.commands_done != self._commands_done:
            self._commands_done = telemetry.commands_done
            self._picture.commands.apply(telemetry, t_ns)
        # Silence is told of from its first time on.
        if self._state.link != UNKNOWN:
            return ()
        self._state = msgspec.structs.replace(self._state, link="heard")
        return _told(GROUND_STATE, t_ns, self._state)

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
        return _told(GROUND_STATE, t_ns, now)

    def prediction(self, t_ns: int, prediction: Prediction) -> Drawn:
        """How old and how sure it is what the ground knows."""
        if self._battery is None or t_ns < self._plot_at_ns:
            return ()
        self._plot_at_ns = t_ns + _PLOT_NS
        likely = prediction.likely
        numbers = GroundNumbers(
            battery=self._battery,
            telemetry_age_s=to_s(t_ns - prediction.from_ns),
            commands_underway=self._picture.commands.on_the_way,
            place_probability=likely[0].probability if likely else 0.0,
        )
        return _told(GROUND_NUMBERS, t_ns, numbers)


def _known(known: KnownWord | None) -> str:
    if known is None:
        return UNKNOWN
    return NONE if known.value is None else known.value


def _goal(goal: Tokens | None) -> str:
    return NONE if goal is None else sign_text(goal)


def _event(topic: PictureTopic, name: str, picture: Picture | None, entry: LogEntry) -> Drawn:
    if _says_nothing(entry.message):
        return ()
    line = event_line(entry) if picture is None else picture.apply(entry)
    if line is None:
        return ()
    t_ns = entry.log_time_ns
    level = LogLevel.Debug if line.routine else _level(entry.message)
    log = Log(timestamp=stamp(t_ns), level=level, message=line.text, name=name)
    return (Record(topic.name, t_ns, t_ns, log.encode()),)


def _says_nothing(message: msgspec.Struct) -> bool:
    """Whether a message never makes a line: it is asked first, as most messages are such."""
    match message:
        case ActionEnded(blocked=False) | CommandEntry(why=None):
            return True
        case EventLearned(event=Event(what=CommandReached(why=None))):
            return True
        case _:
            return False


def _level(message: msgspec.Struct) -> LogLevel:
    """How much an event asks to be seen: whatever is not as it should be is a warning."""
    match message:
        case (
            FailsafeEntry(state=Failsafe.HOLD | Failsafe.ALONE | Failsafe.SAFE)
            | BatteryEntry(state=BatteryState.LOW | BatteryState.FLAT)
            | StuckEntry(stuck=True)
            | LinkOutage(down=True)
            | CommandEntry()
            | LifeEntry(verdict=Verdict.OVERDUE | Verdict.LATE)
            | Silence(silent=True)
            | ShadowEntry(in_step=False)
        ):
            return LogLevel.Warning
        case _:
            return LogLevel.Info
