"""An operator that follows the script of a mission file."""

from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from farside.control import CommandStage
from farside.ground.config import AwaitReached, Pursue, ScriptStep, SwitchMode, Tour, WaitUntil
from farside.ground.operators.operator import Situation
from farside.messages import (
    Approve,
    Drive,
    Order,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.node import to_ns
from farside.places import BATTERY_LOW, Cell, Chart, place_name, place_token
from farside.topics import OperatorEntry

_Orders = Iterator[Sequence[Order]]


class ScriptedOperator:
    """Carries out the script of a mission file step by step.

    It moves and waits: a drive command goes out only when the one before is known to be over, and
    none while the rover is silent. What was refused or came too late it gives again. It insists on
    a drive that was refused, since its script was written with the yard at hand; unless the battery
    is low, when it drives to the dock and waits there until the rover is charged.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, script: Sequence[ScriptStep], chart: Chart) -> None:
        self._chart = chart
        self._situation: Situation
        self._play = self._steps(script)
        self._over = False
        self.progress = OperatorEntry(0, len(script), None)

    def act(self, situation: Situation) -> Sequence[Order]:
        """Orders to send now; see `Operator`."""
        self._situation = situation
        return () if self._over else next(self._play)

    def _steps(self, script: Sequence[ScriptStep]) -> _Orders:
        for number, step in enumerate(script, start=1):
            self.progress = OperatorEntry(number, len(script), _wanted(step))
            match step:
                case Tour():
                    yield from self._tour(step)
                case SwitchMode():
                    yield from self._switch(step)
                case Pursue():
                    yield from self._pursue(step)
                case AwaitReached():
                    yield from self._wait_for_goal(step)
                case WaitUntil():
                    yield from self._wait(step)
        self._over = True
        self.progress = OperatorEntry(len(script), len(script), None)
        yield ()

    def _wait_for(self, what: str) -> None:
        if self.progress.waiting_for != what:
            self.progress = replace(self.progress, waiting_for=what)

    # --- driving -------------------------------------------------------------------------------

    def _tour(self, step: Tour) -> _Orders:
        for place in step.places:
            yield from self._drive_to(self._chart.places[place], charging=True)

    def _drive_to(self, target: Cell, *, charging: bool) -> _Orders:
        goal = f"the rover to be at {place_name(self._chart.tokens[target])}"
        insist = False
        while True:
            way = self._way(target, goal)
            if way is None:
                yield ()
                continue
            if not way:
                return
            number = self._situation.commands.last_given + 1
            yield [Drive(way[0], force=insist)]
            while not self._situation.settled:
                yield ()
            end = self._situation.commands.end_of(number)
            insist = end is not None and end.stage is CommandStage.REFUSED
            if insist and charging and self._is_low and self._chart.dock is not None:
                yield from self._charge(self._chart.dock)
                insist = False

    def _charge(self, dock: Cell) -> _Orders:
        yield from self._drive_to(dock, charging=False)
        while self._is_low:
            self._wait_for("the rover to be charged")
            yield ()

    @property
    def _is_low(self) -> bool:
        telemetry = self._situation.belief.telemetry
        return telemetry is not None and BATTERY_LOW in telemetry.tokens

    def _way(self, target: Cell, goal: str) -> list[str] | None:
        """The path from where the rover stands, or `None` while that is not known for sure."""
        telemetry = self._situation.belief.telemetry
        if telemetry is None or self._situation.silent or not self._situation.settled:
            self._wait_for(goal)
            return None
        cell = self._cell(telemetry)
        if cell is None:
            self._wait_for("the rover to know where it is")
            return None
        try:
            way = self._chart.way(cell, target)
        except ValueError:
            # Where noise puts the rover behind a wall.
            self._wait_for(f"{goal}, to which no way leads from where it believes to be")
            return None
        self._wait_for(goal)
        return way

    def _cell(self, telemetry: Telemetry) -> Cell | None:
        """Where the rover is, if it knows."""
        cells = (self._chart.cells.get(token) for token in telemetry.tokens)
        return next((cell for cell in cells if cell is not None), None)

    # --- modes and goals -----------------------------------------------------------------------

    def _switch(self, step: SwitchMode) -> _Orders:
        while True:
            number = self._situation.commands.last_given + 1
            yield [SetMode(step.mode)]
            while not self._situation.settled:
                yield ()
            if self._situation.commands.end_of(number) is None:
                break
        while not self._is_in(step):
            yield ()

    def _is_in(self, step: SwitchMode) -> bool:
        telemetry = self._situation.belief.telemetry
        return telemetry is not None and telemetry.mode is step.mode

    def _pursue(self, step: Pursue) -> _Orders:
        belief = self._situation.belief
        goal = (place_token(step.place),)
        known_events = belief.last_event
        seen = answered = belief.proposal.number if belief.proposal else 0
        sent: int | None = None
        while not belief.reached(goal, known_events):
            proposal = belief.proposal
            if sent is None or self._situation.commands.end_of(sent) is not None:
                sent = self._situation.commands.last_given + 1
                yield [SetGoal(goal, step.priority)]
            elif proposal is None or proposal.number <= answered:
                yield ()
            else:
                answered = proposal.number
                yield _answer(step, proposal, answered - seen)

    def _wait_for_goal(self, step: AwaitReached) -> _Orders:
        belief = self._situation.belief
        known_events = 0 if step.already else belief.last_event
        while not belief.reached((place_token(step.place),), known_events):
            yield ()

    def _wait(self, step: WaitUntil) -> _Orders:
        while self._situation.now_ns < to_ns(step.until_s):
            yield ()


def _answer(step: Pursue, proposal: Proposal, count: int) -> list[Order]:
    """The answer to the `count`-th proposal since the goal was sent."""
    for override in step.overrides:
        if override.proposal == count:
            return [Override(proposal.number, override.action)]
    return [Approve(proposal.number)] if proposal.veto_window_s is None else []


def _wanted(step: ScriptStep) -> str:
    """What has to happen for a step to be over, in words."""
    match step:
        case Tour(places=places):
            return f"the rover to be at {', '.join(places)}"
        case SwitchMode(mode=mode):
            return f"telemetry that confirms mode {mode}"
        case Pursue(place=place):
            return f"goal {place} to be reached"
        case AwaitReached(place=place):
            return f"goal {place} to be reached, which others set"
        case WaitUntil(until_s=until_s):
            return f"{until_s:g} s"
