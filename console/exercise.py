"""The guided exercise of the mission `blackout`: each step is ticked when it was really done.

What counts is what the ground knows: a drive counts once its work is known to be done. The order
in which the steps are told is the one in which the mission's expectations can be met; what is done
in another order counts all the same.
"""

from collections.abc import Iterator
from enum import Enum

from farside.console.screen.screen import ExerciseStep
from farside.control import CommandStage, Mode, ModeCause, Verdict
from farside.logs.file.reading import LogEntry
from farside.messages import (
    Approve,
    Drive,
    Event,
    GoalReached,
    Happening,
    LinkBack,
    ModeChanged,
    Order,
    Override,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.node import NS_PER_S, to_ns
from farside.topics import CommandSent, EventLearned, LifeEntry, ShadowEntry, Silence

MISSION = "blackout"
"""The shipped mission that the exercise is about: its places, and the times of its blackout."""

_A, _B = ("at:A",), ("at:B",)
_TOUR = {"at:A": "A", "at:B": "B", "at:C": "C"}
_HOME = "at:D"

_DRIVES = 3
_MOMENTS = (
    (450, "the rover is to be back at D about now"),
    (600, "it is time to give it goal B"),
)
_REACHED_BY_NS = 590 * NS_PER_S
_HYPOTHESES = 12  # about as many as the way to A and back leaves


class _Step(Enum):
    """What to do, in the order in which it is told."""

    DRIVE = f"Drive the rover {_DRIVES} moves"
    DELAY = "See the delay"
    TEACH = "Teach it the ways: drive to A, B and C, then back to D"
    PROPOSE = "Let it propose"
    CONSENT = "Consent"
    OVERRIDE = "Override it once"
    REACH = "Bring it to A"
    LET_GO = "Give it goal B, and let go"
    LOSE = "Lose the link"
    READ = "Read what happened"
    TAKE_OVER = "Take over again"


_HOW = {
    _Step.DRIVE: (
        "Arrow keys or W A S D: north, west, south, east. Each press orders one move; you may "
        "order the next before the last is done."
    ),
    _Step.DELAY: (
        "Light takes 1.3 s each way. Under ON THE WAY see a command begin, and later its work "
        "done: you learn of each a light time after it was so. Esc takes back the newest command "
        "that can still be taken back."
    ),
    _Step.TEACH: (
        "The model on board learns from your moves, and later goes only where it knows a way. Be "
        "done by about 0:07:30; . and , make time faster and slower, space stops it."
    ),
    _Step.PROPOSE: (
        "Press M and choose SHARED: from now on the model proposes, and you consent. Then put the "
        "pointer on A in the map and press G: A is its goal."
    ),
    _Step.CONSENT: (
        "Read the proposal under NEXT, then press Enter to approve it. The rover does nothing of "
        "its own until you do: silence is not consent."
    ),
    _Step.OVERRIDE: (
        "While a proposal stands, press the arrow of another action that is not barred by a wall. "
        "The rover does yours, and learns from it. Drive it back if it knows no way from there."
    ),
    _Step.REACH: (
        "Go on approving until A is reached. Where nothing is proposed, drive it by the arrows to "
        "a place where it has been."
    ),
    _Step.LET_GO: (
        "At 0:10:00 put the pointer on B and press G; approve a proposal or two, then take your "
        "hands off. Not before: B is to be reached while the rover is alone. Not after 0:10:15: "
        "then word of it may not get there in time."
    ),
    _Step.LOSE: (
        "Soon after 0:10:20 nothing is heard any more, and no plan said so. FAILSAFE says what the "
        "rover will do: after {lost_after} of silence it goes on alone, to B, then to C. Order "
        "nothing now. Press . to let time run faster, until word comes again at about 0:16:20."
    ),
    _Step.READ: (
        "When the link is back, the rover tells what it did meanwhile. Acknowledge every alarm, "
        "and open the list of all events: each has the time when it was so, and the time when you "
        "learned of it."
    ),
    _Step.TAKE_OVER: (
        "The rover stands until you say who drives; that the link is back says nothing. Press M "
        "and choose GUIDED, and wait until the rover confirms it."
    ),
}

_BY = "Do it before the clock shows 0:09:50."

_SILENT = (
    "The rover is silent, so this has to wait. Press N to let time pass until it is heard again, "
    "at about 0:16:20."
)
_ROVER_MUST_HEAR = {
    _Step.DRIVE,
    _Step.DELAY,
    _Step.TEACH,
    _Step.PROPOSE,
    _Step.CONSENT,
    _Step.OVERRIDE,
    _Step.REACH,
}

_TOO_LATE = (
    "B was not its goal when the rover went silent. To try it, start the mission again and send B "
    "between 0:10:00 and 0:10:15."
)


class Exercise:
    """Follows a person through the exercise.

    Args:
        lost_after_s: the silence after which the rover counts the link as lost.
    """

    def __init__(self, *, lost_after_s: float) -> None:
        self._lost_after_s = lost_after_s
        self._done: set[_Step] = set()
        self._orders: dict[int, Order] = {}
        self._begun_ns: dict[int, int] = {}  # when it was learned of a command that it began
        self._drives = 0
        self._hypotheses = 0
        self._to_visit = dict(_TOUR)
        self._is_home = False
        self._shared = self._has_goal_a = False
        self._goal_b_ns: int | None = None  # since when B is a goal on board
        self._now_ns = 0
        self._silent_ns: int | None = None  # since when the latest unexpected silence
        self._is_silent = False
        self._is_back = self._acknowledged = self._read = False

    # --- what is done --------------------------------------------------------------------------

    def take(self, entry: LogEntry) -> None:
        """Take the next entry of the ground's log, in order."""
        self._wait(entry.log_time_ns)
        match entry.message:
            case CommandSent(number=number, order=order):
                self._orders[number] = order
            case LifeEntry(verdict=Verdict.ON_TIME | Verdict.LATE) as life:
                self._life(life, entry.log_time_ns)
            case Telemetry(tokens=tokens):
                for token in tokens:
                    self._to_visit.pop(token, None)
                self._is_home = self._is_home or (not self._to_visit and _HOME in tokens)
            case ShadowEntry(hypotheses=hypotheses):
                self._hypotheses = hypotheses
            case Silence(silent=silent):
                self._is_silent = silent
                self._silent_ns = entry.log_time_ns if silent else self._silent_ns
            case EventLearned(event=Event(what=what)):
                self._event(what)
        self._tick()

    def acknowledged(self) -> None:
        """The person acknowledged the alarms, and none is left."""
        self._acknowledged = self._is_back
        self._tick_read()

    def read(self) -> None:
        """The person opened the list of all that happened."""
        self._read = self._is_back
        self._tick_read()

    def _life(self, life: LifeEntry, now_ns: int) -> None:
        if life.stage in {CommandStage.TAKEN, CommandStage.BEGUN}:
            self._begun_ns.setdefault(life.number, now_ns)
        if life.stage is None or not life.stage.is_last:
            return
        begun_ns = self._begun_ns.pop(life.number, now_ns)
        order = self._orders.pop(life.number, None)
        if order is not None and life.stage is CommandStage.DONE:
            if begun_ns < now_ns:
                self._done.add(_Step.DELAY)
            self._order_done(order, now_ns if life.so_ns is None else life.so_ns)

    def _order_done(self, order: Order, since_ns: int) -> None:
        match order:
            case Drive():
                self._drives += 1
            case SetMode(mode=Mode.SHARED):
                self._shared = True
            case SetGoal(tokens=tokens) if tokens == _A:
                self._has_goal_a = True
            case SetGoal(tokens=tokens) if tokens == _B:
                self._goal_b_ns = since_ns
            case Approve():
                self._done.add(_Step.CONSENT)
            case Override():
                self._done.add(_Step.OVERRIDE)

    def _event(self, what: Happening) -> None:
        match what:
            case GoalReached(tokens=tokens) if tokens == _A:
                self._done.add(_Step.REACH)
            case GoalReached(tokens=tokens) if tokens == _B:
                self._goal_b_ns = None
            case LinkBack():
                self._is_back = True
            case ModeChanged(mode=Mode.GUIDED, why=ModeCause.OPERATOR | ModeCause.TAKEN_OVER):
                if self._is_back:
                    self._done.add(_Step.TAKE_OVER)

    def _wait(self, now_ns: int) -> None:
        """Time has passed, perhaps in silence."""
        self._now_ns = now_ns
        silent_ns = now_ns if self._silent_ns is None else self._silent_ns
        if self._is_silent and now_ns - silent_ns >= to_ns(self._lost_after_s):
            self._done.add(_Step.LOSE)

    def _tick(self) -> None:
        if self._drives >= _DRIVES:
            self._done.add(_Step.DRIVE)
        if self._is_home and self._hypotheses >= _HYPOTHESES:
            self._done.add(_Step.TEACH)
        if self._shared and self._has_goal_a:
            self._done.add(_Step.PROPOSE)
        b_ns, silent_ns = self._goal_b_ns, self._silent_ns
        if b_ns is not None and silent_ns is not None and b_ns <= silent_ns:
            self._done.add(_Step.LET_GO)

    def _tick_read(self) -> None:
        if self._acknowledged and self._read:
            self._done.add(_Step.READ)

    # --- what the person is told ---------------------------------------------------------------

    def rows(self) -> tuple[ExerciseStep, ...]:
        """The steps in the order in which they are told."""
        return tuple(
            ExerciseStep(
                step.value, self._how(step), done=step in self._done, missed=self._missed(step)
            )
            for step in _Step
        )

    def moments(self) -> Iterator[tuple[int, str]]:
        """When time is to go back to 1x, and why: what is to be done by then is not done yet."""
        for step, (at_s, why) in zip((_Step.TEACH, _Step.LET_GO), _MOMENTS, strict=True):
            if step not in self._done:
                yield at_s * NS_PER_S, why

    def _missed(self, step: _Step) -> bool:
        return step is _Step.LET_GO and _Step.LOSE in self._done and step not in self._done

    def _how(self, step: _Step) -> str:
        if self._is_silent and step in _ROVER_MUST_HEAR:
            return _SILENT
        match step:
            case _Step.REACH if self._now_ns < _REACHED_BY_NS:
                return f"{_HOW[step]} {_BY}"
            case _Step.DRIVE:
                return f"{_HOW[step]} Done so far: {min(self._drives, _DRIVES)} of {_DRIVES}."
            case _Step.TEACH:
                return f"{_HOW[step]} {self._tour()}"
            case _ if self._missed(step):
                return _TOO_LATE
            case _:
                return _HOW[step].format(lost_after=f"{self._lost_after_s:g} s")

    def _tour(self) -> str:
        if self._to_visit:
            return f"Still to visit: {', '.join(self._to_visit.values())}, then D."
        return "You have been everywhere." if self._is_home else "Now back to D."
