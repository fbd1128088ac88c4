"""An operator that follows the script of a mission file."""

from collections.abc import Sequence

from farside.acts import Act
from farside.ground.config import (
    AwaitReached,
    Leave,
    Pursue,
    Rule,
    ScriptStep,
    Supervise,
    SwitchMode,
    Teach,
    Tour,
    WaitUntil,
)
from farside.ground.operators.operator import Situation
from farside.ground.operators.seat import Seat, Work
from farside.ground.operators.steps.driving import tour
from farside.ground.operators.steps.goals import (
    leave,
    pursue,
    switch,
    wait,
    wait_for_goal,
)
from farside.ground.operators.steps.supervising import supervise
from farside.ground.operators.steps.teaching import teach
from farside.places import Chart
from farside.topics import OperatorEntry


class ScriptedOperator:
    """Carries out the script of a mission file step by step.

    It moves and waits: a drive command goes out only when the one before is known to be over, and
    none while the rover is silent. What was refused or came too late it gives again. It insists on
    a drive that was refused, since its script was written with the yard at hand; unless the battery
    is low, when it drives to the dock and waits there until the rover is charged.

    The operators `guide` and `supervisor` are scripts of a single step.

    Args:
        script: the steps.
        chart: the chart of the yard.
        rules: what a path must meet for the operator to agree to it.
    """

    def __init__(
        self, script: Sequence[ScriptStep], chart: Chart, rules: tuple[Rule, ...] = ()
    ) -> None:
        self._seat = Seat(chart, len(script), rules)
        self._script = list(script)
        self._play = self._steps()

    @property
    def progress(self) -> OperatorEntry:
        """See `Operator`."""
        return self._seat.progress

    def act(self, situation: Situation) -> Sequence[Act]:
        """Orders to give now; see `Operator`."""
        self._seat.situation = situation
        return next(self._play)

    def change(self, script: Sequence[ScriptStep], rules: tuple[Rule, ...]) -> bool:
        """Go on by another script and other rules; false if what has begun differs in it.

        Nothing is changed then.
        """
        begun = self.progress.step
        if self._script[:begun] != list(script[:begun]):
            return False
        self._script[begun:] = script[begun:]
        self._seat.change(len(script), rules)
        return True

    def _steps(self) -> Work:
        # More steps may come, and others go, while it goes through them and when it is through.
        number = 0
        while True:
            while number < len(self._script):
                step = self._script[number]
                number += 1
                self._seat.begin(number, _wanted(step))
                yield from _work(self._seat, step)
            self._seat.end()
            while number == len(self._script):
                yield ()


def _work(seat: Seat, step: ScriptStep) -> Work:  # noqa: PLR0911 - a kind each
    """The work that a step is."""
    match step:
        case Tour():
            return tour(seat, step)
        case Teach():
            return teach(seat, step)
        case SwitchMode(mode=mode):
            return switch(seat, mode)
        case Pursue():
            return pursue(seat, step)
        case Leave():
            return leave(seat, step)
        case Supervise():
            return supervise(seat, step)
        case AwaitReached():
            return wait_for_goal(seat, step)
        case WaitUntil():
            return wait(seat, step)


def _wanted(step: ScriptStep) -> str:  # noqa: PLR0911 - a kind each
    """What has to happen for a step to be over, in words."""
    match step:
        case Tour(places=places):
            return f"the rover to be at {', '.join(places)}"
        case Teach():
            return "every move to be made"
        case SwitchMode(mode=mode):
            return f"telemetry that confirms mode {mode}"
        case Pursue(place=place):
            return f"goal {place} to be reached"
        case Leave():
            return "autonomous mode and the goals to be confirmed"
        case Supervise(goals=goals):
            return f"goals {', '.join(wanted.place for wanted in goals)} to be reached"
        case AwaitReached(place=place):
            return f"goal {place} to be reached, which others set"
        case WaitUntil(until_s=until_s):
            return f"{until_s:g} s"
