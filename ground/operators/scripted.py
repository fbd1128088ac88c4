"""An operator that follows the script of a mission file."""

from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from farside.ground.config import AwaitReached, Pursue, ScriptStep, SwitchMode, Tour, WaitUntil
from farside.ground.operators.operator import Situation
from farside.messages import Approve, Drive, Order, Override, SetGoal, SetMode, Telemetry
from farside.node import to_ns
from farside.places import Cell, Chart, place_token
from farside.topics import OperatorEntry


class ScriptedOperator:
    """Carries out the script of a mission file step by step.

    It moves and waits: a drive command goes out only when the one before is known to be done, and
    none while the rover is silent.

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

    def _steps(self, script: Sequence[ScriptStep]) -> Iterator[Sequence[Order]]:
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

    def _tour(self, step: Tour) -> Iterator[Sequence[Order]]:
        for place in step.places:
            target = self._chart.places[place]
            self.progress = replace(self.progress, waiting_for=f"the rover to be at {place}")
            while (way := self._way(target)) is None or way:
                yield [Drive(way[0])] if way else ()

    def _way(self, target: Cell) -> list[str] | None:
        """The path from where the rover stands, or `None` while that is not known for sure."""
        telemetry = self._situation.belief.telemetry
        if telemetry is None or self._situation.silent or not self._situation.settled:
            return None
        return self._chart.way(self._cell(telemetry), target)

    def _cell(self, telemetry: Telemetry) -> Cell:
        return next(self._chart.cells[t] for t in telemetry.tokens if t in self._chart.cells)

    def _switch(self, step: SwitchMode) -> Iterator[Sequence[Order]]:
        yield [SetMode(step.mode)]
        while not self._is_in(step):
            yield ()

    def _is_in(self, step: SwitchMode) -> bool:
        telemetry = self._situation.belief.telemetry
        return self._situation.settled and telemetry is not None and telemetry.mode is step.mode

    def _pursue(self, step: Pursue) -> Iterator[Sequence[Order]]:
        belief = self._situation.belief
        goal = (place_token(step.place),)
        known_events = len(belief.events)
        seen = answered = belief.proposal.number if belief.proposal else 0
        overrides = {override.proposal: override.action for override in step.overrides}
        yield [SetGoal(goal, step.priority)]
        while not belief.reached(goal, known_events):
            proposal = belief.proposal
            if proposal is None or proposal.number <= answered:
                yield ()
                continue
            answered = proposal.number
            action = overrides.get(proposal.number - seen)
            yield [Override(answered, action) if action else Approve(answered)]

    def _wait_for_goal(self, step: AwaitReached) -> Iterator[Sequence[Order]]:
        while not self._situation.belief.reached((place_token(step.place),)):
            yield ()

    def _wait(self, step: WaitUntil) -> Iterator[Sequence[Order]]:
        while self._situation.now_ns < to_ns(step.until_s):
            yield ()


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
