"""Goals in the whole model: their order, goals of the robot's own, and blocked paths."""

import math
from collections.abc import Collection, Sequence
from typing import Any, cast

import numpy as np
import pytest
from goal_runs import drive, reached
from msgspec.structs import replace

from farside.dem import DynamicExpectancyModel, Goal, InherentGoal
from tests.dem.conftest import Grid, MakeModel, RunCycle


@pytest.fixture
def driven(make_model: MakeModel, corridor: Grid, cycle: RunCycle) -> DynamicExpectancyModel:
    """A model that knows a corridor both ways and stands at its west end."""
    model = make_model()
    for action in "EEEEEWWWWW" * 2:
        cycle(model, corridor.tokens(), corridor.do(action))
    return model


def test_goals_are_visited_in_order_of_priority_and_those_on_the_way_in_passing(
    driven: DynamicExpectancyModel, corridor: Grid
) -> None:
    for place, priority in [("at:0,0", 1.0), ("at:4,0", 2.0), ("at:1,0", 1.0), ("at:3,0", 2.0)]:
        driven.set_goal([place], priority)
    corridor.at = (2, 0)
    story = drive(driven, corridor, patience=20)
    assert reached(story) == [("at:3,0",), ("at:4,0",), ("at:1,0",), ("at:0,0",)]
    assert len(story) == 1 + 2 + 4


def test_the_robot_charges_while_its_battery_is_low_and_then_goes_on(corridor: Grid) -> None:
    """The battery runs low halfway to the goal; it is full after two cycles on the charger."""
    charge = InherentGoal(when=("battery:low",), goal=("on_charge",), priority=2.5)
    costs = dict.fromkeys("NESW", 2.66)
    model = DynamicExpectancyModel(costs, rng=np.random.default_rng(0), inherent=[charge])

    def tokens(*, low: bool = False) -> list[str]:
        charger = ["on_charge"] if corridor.at == (0, 0) else []
        return [*corridor.tokens(), *charger, *(["battery:low"] if low else [])]

    for action in "EEEEEWWWWW" * 2:
        model.sense(tokens())
        model.perform(corridor.do(action))
    model.set_goal(["at:5,0"], priority=1.0)
    low, on_charger, story = False, 0, []
    for _ in range(20):
        low = on_charger < 2 and (low or corridor.at == (3, 0))
        sensed = model.sense(tokens(low=low))
        story.append((corridor.at[0], [goal.tokens for goal in sensed.reached]))
        on_charger += low and corridor.at == (0, 0)
        if not model.goals:
            break
        assert (charge.goal in [goal.tokens for goal in model.goals]) == (
            low and corridor.at != (0, 0)
        )
        stays = low and corridor.at == (0, 0)
        model.perform(None if stays else corridor.do(model.choose().action))
    assert [place for place, _ in story] == [0, 1, 2, 3, 2, 1, 0, 0, 0, 1, 2, 3, 4, 5]
    assert [(place, signs) for place, signs in story if signs] == [
        (0, [("on_charge",)]),
        (5, [("at:5,0",)]),
    ]


LAMP = ("lamp:on",)
WANTED_BY_BOTH = Goal(LAMP, {"operator": 0.5, "rule": 1.0})


def with_rules(*rules: tuple[Collection[str], Collection[str], float]) -> DynamicExpectancyModel:
    """A model with rules of its own, each a trigger, a goal and a priority."""
    inherent = [InherentGoal(tuple(when), tuple(goal), priority) for when, goal, priority in rules]
    return DynamicExpectancyModel({"press": 1.0}, rng=np.random.default_rng(0), inherent=inherent)


@pytest.fixture
def lit_when_dark() -> DynamicExpectancyModel:
    """A model that wants its lamp on while it is dark."""
    return with_rules((["dark"], LAMP, 1.0))


def listed_after(
    model: DynamicExpectancyModel, cycle: RunCycle, tokens: Sequence[str]
) -> tuple[Goal, ...]:
    """The Goal List after sensing `tokens`."""
    cycle(model, tokens, None)
    return wanted_by(model)


def wanted_by(model: DynamicExpectancyModel) -> tuple[Goal, ...]:
    """What is wanted, and by whom; that no way is known to any of it is no matter here."""
    return tuple(replace(goal, aside=None) for goal in model.goals)


def test_an_inherent_goal_leaves_the_list_with_its_trigger(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    assert listed_after(lit_when_dark, cycle, ["dark"]) == (Goal(LAMP, {"rule": 1.0}),)
    assert cycle(lit_when_dark, ["dawn"], None).reached == ()
    assert lit_when_dark.goals == ()


def test_a_goal_that_the_operator_wants_too_outlives_the_rule(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    lit_when_dark.set_goal(LAMP, priority=0.5)
    assert listed_after(lit_when_dark, cycle, ["dark"]) == (WANTED_BY_BOTH,)
    assert listed_after(lit_when_dark, cycle, ["dawn"]) == (Goal(LAMP, {"operator": 0.5}),)
    assert lit_when_dark.withdraw_goal(LAMP)
    assert lit_when_dark.goals == ()


def test_the_higher_priority_of_operator_and_rule_counts(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    cycle(lit_when_dark, ["dark"], None)
    lit_when_dark.set_goal(LAMP, priority=3.0)
    assert [goal.priority for goal in lit_when_dark.goals] == [3.0]
    assert [goal.priority for goal in listed_after(lit_when_dark, cycle, ["dark"])] == [3.0]


def test_a_goal_that_a_rule_wants_too_outlives_its_withdrawal(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    cycle(lit_when_dark, ["dark"], None)
    lit_when_dark.set_goal(LAMP, priority=3.0)
    assert lit_when_dark.withdraw_goal(LAMP)
    assert wanted_by(lit_when_dark) == (Goal(LAMP, {"rule": 1.0}),)
    assert not lit_when_dark.withdraw_goal(LAMP)
    assert wanted_by(lit_when_dark) == (Goal(LAMP, {"rule": 1.0}),)


@pytest.mark.parametrize("first", [1.0, 2.0])
def test_a_goal_of_two_rules_has_the_higher_priority_of_those_that_are_active(
    first: float, cycle: RunCycle
) -> None:
    second = 3.0 - first
    model = with_rules((["dark"], LAMP, first), (["visitor"], LAMP, second))
    assert listed_after(model, cycle, ["dark"]) == (Goal(LAMP, {"rule": first}),)
    assert listed_after(model, cycle, ["dark", "visitor"]) == (Goal(LAMP, {"rule": 2.0}),)
    assert listed_after(model, cycle, ["visitor"]) == (Goal(LAMP, {"rule": second}),)
    assert listed_after(model, cycle, ["dawn"]) == ()


def test_an_inherent_goal_is_reached_once_and_wanted_again_after_it_was_inactive(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    nights = [["dark"], ["dark", *LAMP], ["dark", *LAMP], ["dark"], ["dark", *LAMP], LAMP]
    story = [
        (cycle(lit_when_dark, night, None).reached, wanted_by(lit_when_dark)) for night in nights
    ]
    wanted = (Goal(LAMP, {"rule": 1.0}),)
    assert story == [((), wanted), (wanted, ()), ((), ()), ((), wanted), (wanted, ()), ((), ())]


def test_a_goal_that_is_active_already_is_reached_each_time_its_trigger_appears(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    days = [["dark", *LAMP], LAMP, ["dark", *LAMP]]
    story = [len(cycle(lit_when_dark, day, None).reached) for day in days]
    assert story == [1, 0, 1]


def test_the_operator_can_want_what_a_rule_has_reached_and_is_told_that_it_is_reached(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    cycle(lit_when_dark, ["dark", *LAMP], None)
    lit_when_dark.set_goal(LAMP, priority=0.5)
    assert lit_when_dark.goals == (Goal(LAMP, {"operator": 0.5}),)
    assert cycle(lit_when_dark, ["dark", *LAMP], None).reached == (Goal(LAMP, {"operator": 0.5}),)
    assert cycle(lit_when_dark, ["dark", *LAMP], None).reached == ()


def test_a_goal_that_both_want_is_reached_once_for_both(
    lit_when_dark: DynamicExpectancyModel, cycle: RunCycle
) -> None:
    lit_when_dark.set_goal(LAMP, priority=0.5)
    assert cycle(lit_when_dark, ["dark", *LAMP], None).reached == (WANTED_BY_BOTH,)
    assert cycle(lit_when_dark, ["dark", *LAMP], None).reached == ()
    assert lit_when_dark.goals == ()


def test_the_goal_of_a_rule_may_have_several_tokens_in_any_order(cycle: RunCycle) -> None:
    model = with_rules((["dark"], ["lamp:on", "door:shut"], 1.0))
    cycle(model, ["door:shut"], "press")
    assert listed_after(model, cycle, ["dark"]) == (Goal(("door:shut", "lamp:on"), {"rule": 1.0}),)
    assert ("door:shut", "lamp:on") in model.signs
    cycle(model, ["dark", "door:shut"], "press")
    assert cycle(model, ["dark", "door:shut", "lamp:on"], None).reached != ()
    cycle(model, ["dark", "door:shut"], None)
    model.sense(["dark", "door:shut"])
    assert model.choose().goal == ("door:shut", "lamp:on")


def test_a_rule_without_a_goal_or_a_finite_priority_is_refused() -> None:
    with pytest.raises(ValueError, match="one Token at least"):
        InherentGoal(when=("dark",), goal=(), priority=1.0)
    with pytest.raises(ValueError, match="expected a finite number"):
        InherentGoal(when=("dark",), goal=LAMP, priority=math.nan)
    with pytest.raises(TypeError, match="found the string 'dark'"):
        InherentGoal(when=cast("Any", "dark"), goal=LAMP, priority=1.0)


# --- Signs that are known only as goals --------------------------------------------------------

BOTH = ("at:A", "drill:out")


def test_a_sign_that_only_a_goal_needed_is_removed_with_the_goal(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    model.set_goal(BOTH, priority=1.0)
    cycle(model, ["at:A"], "E")
    assert BOTH in model.signs
    model.withdraw_goal(BOTH)
    assert model.signs == (("at:A",),)
    model.sense(["at:A"])
    assert model.policy_map() == ()


def test_without_removal_that_sign_stays(make_model: MakeModel) -> None:
    model = make_model(removal=False)
    model.set_goal(BOTH, priority=1.0)
    model.withdraw_goal(BOTH)
    assert model.signs == (BOTH,)


def test_withdrawn_while_active_it_is_removed_once_it_has_left_the_traces(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model(reach=2)
    model.set_goal(BOTH, priority=1.0)
    model.sense(BOTH)
    model.set_goal(BOTH, priority=1.0)
    model.withdraw_goal(BOTH)
    held = [BOTH in model.signs]
    model.perform(None)
    for _ in range(2):
        cycle(model, ["dust"], None)
        held.append(BOTH in model.signs)
    assert held == [True, True, False]


def test_a_reached_goal_is_removed_once_it_has_left_the_traces(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    model.set_goal(BOTH, priority=1.0)
    assert cycle(model, BOTH, None).reached == (Goal(BOTH, {"operator": 1.0}),)
    assert BOTH in model.signs
    cycle(model, ["dust"], None)
    assert BOTH not in model.signs


def test_a_sign_that_is_a_context_outlives_its_goal(make_model: MakeModel, cycle: RunCycle) -> None:
    model = make_model()
    model.set_goal(BOTH, priority=1.0)
    cycle(model, BOTH, "E")
    cycle(model, ["at:B"], None)
    model.set_goal(BOTH, priority=1.0)
    model.withdraw_goal(BOTH)
    assert BOTH in {hypothesis.context for hypothesis in model.hypotheses}
    assert BOTH in model.signs


def test_a_sign_that_a_rule_needs_outlives_the_operators_goal() -> None:
    model = with_rules((["dark"], BOTH, 1.0))
    model.set_goal(BOTH, priority=1.0)
    model.withdraw_goal(BOTH)
    assert model.signs == (BOTH,)


def test_hypotheses_for_a_removed_sign_are_removed_even_with_a_prediction_due(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """The drill came out after E at A once; E was just repeated when the goal is withdrawn."""
    model = make_model(situations=False)
    model.set_goal(BOTH, priority=1.0)
    cycle(model, ["at:A"], "E")
    cycle(model, BOTH, None)
    model.set_goal(BOTH, priority=1.0)
    cycle(model, ["dust"], None)
    cycle(model, ["at:A"], "E")
    assert BOTH in {hypothesis.outcome for hypothesis in model.hypotheses}
    model.withdraw_goal(BOTH)
    assert BOTH not in model.signs
    assert BOTH not in {hypothesis.outcome for hypothesis in model.hypotheses}
    sensed = model.sense(["at:A", "drill:out"])
    assert sensed.active == (("at:A",), ("drill:out",))
    assert (sensed.succeeded, sensed.failed) == (2, 0)
