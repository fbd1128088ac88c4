"""Rules of the robot's own whose priority follows its state."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from farside.dem import DynamicExpectancyModel, Goal, InherentGoal, Sign
from tests.dem.conftest import Grid, RunCycle

WEST, EAST, DOCK = ("at:0,0",), ("at:5,0",), ("on_charge",)
LOW = ("battery:low",)


def with_rules(*rules: InherentGoal) -> DynamicExpectancyModel:
    return DynamicExpectancyModel(
        dict.fromkeys("NESW", 2.66), rng=np.random.default_rng(0), inherent=rules
    )


class Battery:
    """Charge that the robot does not sense as a Token; a rule may look at it all the same."""

    def __init__(self) -> None:
        self.charge = 1.0

    def urgency(self, tokens: Sign) -> float:
        assert "battery:low" in tokens, "a rule is asked only while it is active"
        return 10 * (1 - self.charge)


def test_the_more_the_battery_is_discharged_the_more_the_robot_wants_to_charge(
    corridor: Grid,
) -> None:
    """It is on its way east, and turns round to the dock once that has become more urgent."""
    battery = Battery()
    model = with_rules(InherentGoal(when=LOW, goal=DOCK, priority=battery.urgency))

    def tokens() -> list[str]:
        docked = [*DOCK] if corridor.at == (0, 0) else []
        return [*corridor.tokens(), *docked, *([*LOW] if battery.charge < 0.9 else [])]

    for action in "EEEEEWWWWW" * 2:
        model.sense(tokens())
        model.perform(corridor.do(action))
    model.set_goal(EAST, priority=5.0)
    pursued = []
    for _ in range(7):
        battery.charge -= 0.15
        model.sense(tokens())
        choice = model.choose()
        pursued.append(choice.goal)
        model.perform(corridor.do(choice.action))
    assert pursued == [EAST, EAST, EAST, DOCK, DOCK, DOCK, EAST]


def test_of_a_function_and_a_number_for_the_same_goal_the_higher_counts(cycle: RunCycle) -> None:
    dark = [0.5]
    model = with_rules(
        InherentGoal(when=("dark",), goal=DOCK, priority=2.0),
        InherentGoal(when=(), goal=DOCK, priority=lambda tokens: dark[0] * len(tokens)),
    )
    for much, tokens, priority in [(0.5, ["dark"], 2.0), (3.0, ["dark", "x"], 6.0), (1.0, [], 0.0)]:
        dark[0] = much
        cycle(model, tokens, None)
        assert model.goals == (Goal(DOCK, {"rule": priority}, model.goals[0].aside),)


@pytest.mark.parametrize(
    ("gives", "error", "words"),
    [
        (math.nan, ValueError, "expected a finite number, found nan"),
        (-math.inf, ValueError, "expected a finite number, found -inf"),
        ("high", TypeError, "expected a number, found 'high'"),
        (None, TypeError, "expected a number, found None"),
    ],
)
def test_a_priority_that_is_none_is_refused_by_the_name_of_the_rule_and_nothing_is_sensed(
    cycle: RunCycle, gives: Any, error: type[Exception], words: str
) -> None:
    given: list[Any] = [1.0]
    model = with_rules(InherentGoal(when=LOW, goal=DOCK, priority=lambda _: given[-1]))
    cycle(model, LOW, "E")
    before = model.save()
    given.append(gives)
    with pytest.raises(error, match=rf"the rule \('battery:low',\) -> \('on_charge',\): {words}"):
        model.sense([*LOW, "new"])
    assert model.save() == before
    given.append(2.0)
    model.sense([*LOW, "new"])
    assert model.goals[0].priority == 2.0


def test_functions_are_given_again_when_a_model_is_loaded(cycle: RunCycle) -> None:
    rules = [
        InherentGoal(when=LOW, goal=DOCK, priority=lambda _: 3.0),
        InherentGoal(when=("dark",), goal=WEST, priority=1),
    ]
    model = with_rules(*rules)
    cycle(model, LOW, None)
    data = model.save()
    loaded = DynamicExpectancyModel.load(data, inherent=rules)
    assert loaded.goals == model.goals
    assert cycle(loaded, ["dark", *LOW], None) == cycle(model, ["dark", *LOW], None)
    assert loaded.goals == model.goals
    assert loaded.save() == model.save()
    with pytest.raises(ValueError, match=r"rules once more, .* found none; .*'battery:low'"):
        DynamicExpectancyModel.load(data)
    for others in ([], rules[:1], [rules[0], InherentGoal(("dark",), WEST, 2.0)], rules[::-1]):
        with pytest.raises(ValueError, match="inherent: expected the rules that were saved"):
            DynamicExpectancyModel.load(data, inherent=others)


@pytest.mark.parametrize("priority", ["high", True, None, [1.0]])
def test_a_priority_is_a_number_or_a_function(priority: Any) -> None:
    with pytest.raises(TypeError, match=r"priority of goal \('on_charge',\): expected a number"):
        InherentGoal(when=LOW, goal=DOCK, priority=priority)


def test_a_rule_of_a_function_needs_a_goal_as_well() -> None:
    priority: Callable[[Sign], float] = lambda _: 1.0  # noqa: E731
    with pytest.raises(ValueError, match="one Token at least"):
        InherentGoal(when=LOW, goal=(), priority=priority)
