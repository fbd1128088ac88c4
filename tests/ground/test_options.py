"""What a person is told of each action that could be ordered now, in every situation."""

from collections.abc import Sequence

import numpy as np
import pytest
from view_stand import Stand, option, stand_at

from farside.control import (
    BatteryState,
    CommandStage,
    Failsafe,
    Mode,
)
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel
from farside.ground.view.view import OptionKind
from farside.messages import (
    BatteryChanged,
    CommandReached,
    Drive,
    FailsafeChanged,
    Happening,
    SetMode,
    StuckChanged,
)
from farside.places import ACTIONS, Chart
from tests.ground.conftest import telemetry

# --- options ---------------------------------------------------------------------------------


def test_every_action_has_an_option_in_the_order_of_the_list() -> None:
    assert [one.action for one in stand_at("A").view().options] == list(ACTIONS)


def test_a_move_that_leads_on_is_free_and_says_where_to() -> None:
    found = option(stand_at("A").view(), "E")
    assert (found.kind, found.severity, found.why) == (OptionKind.FREE, 0.0, ())
    assert found.likely[0].sign == ("at:2,1",)
    assert found.likely[0].probability > 0.9


@pytest.mark.parametrize(
    ("place", "action", "kind", "why"),
    [
        ("A", "S", OptionKind.INVALID, "a wall is there on the chart"),
        ("B", "N", OptionKind.INVALID, "a rock is there on the chart"),
        ("A", "N", OptionKind.FREE, "not tried here yet"),
        ("2,1", "N", OptionKind.PROBLEMATIC, "leads out of coverage"),
    ],
)
def test_what_the_model_does_not_know_the_chart_does(
    place: str, action: str, kind: OptionKind, why: str
) -> None:
    found = option(stand_at(place).view(), action)
    assert (found.kind, found.why) == (kind, (why,))


def test_a_rover_with_an_empty_model_can_be_driven() -> None:
    empty = ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters())
    view = Stand(telemetry(9.0, "A"), model=empty).view()
    assert {one.action for one in view.options if one.kind is OptionKind.FREE} == {"N", "E"}


def test_behind_a_move_that_the_model_does_not_know_the_chart_says_where_it_begins() -> None:
    empty = ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters())
    view = Stand(telemetry(9.0, "A"), model=empty).give(Drive("E"), Drive("E")).view()

    onward = option(view, "E")
    assert onward.kind is OptionKind.FREE
    assert onward.why == ("not tried here yet", "begins at 3,1 by the chart alone")
    assert option(view, "S").why == ("a wall is there on the chart",)


def test_a_wall_that_was_met_is_invalid_though_the_chart_has_none() -> None:
    found = option(stand_at("A", "N", "N").view(), "N")
    assert (found.kind, found.severity, found.why) == (
        OptionKind.INVALID,
        1.0,
        ("a wall was met here",),
    )


def test_a_way_that_was_blocked_and_was_free_is_problematic() -> None:
    found = option(stand_at("A", "E").view(), "E")
    assert found.kind is OptionKind.PROBLEMATIC
    assert found.why[0].startswith("blocked here before (")
    assert 0 < found.severity < 0.5


def test_an_option_begins_where_what_is_on_its_way_leads() -> None:
    view = stand_at("A").give(Drive("E"), Drive("E"), Drive("E")).view()
    assert view.start[0].sign == ("at:B",)
    assert option(view, "N").why == ("a rock is there on the chart",)
    back = option(view, "W")
    assert (back.kind, back.why) == (
        OptionKind.PROBLEMATIC,
        ("command 3, on its way, goes E",),
    )


def test_an_order_in_autonomous_mode_says_that_it_takes_over() -> None:
    found = option(stand_at("A", mode=Mode.AUTONOMOUS).view(), "E")
    assert (found.kind, found.why) == (
        OptionKind.FREE,
        ("you take over by it: the mode will be guided",),
    )


def test_a_mode_on_its_way_speaks_against_driving() -> None:
    found = option(stand_at("A").give(SetMode(Mode.SHARED)).view(), "E")
    assert found.why == ("command 1, on its way, brings mode shared",)


@pytest.mark.parametrize(
    ("happened", "kind", "why"),
    [
        ([BatteryChanged(BatteryState.FLAT, 0.0)], OptionKind.INVALID, "the battery is flat"),
        (
            [FailsafeChanged(Failsafe.SAFE, "the rover tilts too much", 0)],
            OptionKind.INVALID,
            "the rover tilts too much",
        ),
        (
            [FailsafeChanged(Failsafe.SAFE, "the rover is stuck", 0), StuckChanged(True, 10)],
            OptionKind.PROBLEMATIC,
            "the rover is stuck",
        ),
    ],
)
def test_what_is_wrong_with_the_rover_speaks_against_every_action(
    happened: Sequence[Happening], kind: OptionKind, why: str
) -> None:
    found = option(stand_at("A").tell(*happened, at_s=9.5).view(), "E")
    assert (found.kind, found.why) == (kind, (why,))


@pytest.mark.parametrize(
    ("stage", "why"),
    [
        (CommandStage.FAILED, "blocked here just now"),
        (CommandStage.REFUSED, "refused here just now: too little charge"),
    ],
)
def test_what_the_gate_would_refuse_again_is_invalid(stage: CommandStage, why: str) -> None:
    stand = stand_at("A").give(Drive("E"))
    stand.tell(CommandReached(1, stage, "too little charge"), at_s=9.5)
    found = option(stand.view(), "E")
    assert (found.kind, found.why) == (OptionKind.INVALID, (why,))


def test_what_may_leave_too_little_charge_for_the_way_to_the_dock_is_problematic() -> None:
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 2.0), Parameters(), rng=np.random.default_rng(1)
    )
    model.record_changes()
    dock, rest = (
        ["at:D", "on_charge"],
        ["at:2,1"],
    )
    model.sense(dock)
    for _ in range(6):
        for action, tokens in (("E", rest), ("E", ["at:3,1"]), ("W", rest), ("W", dock)):
            model.perform(action)
            model.sense(tokens)
    shadow = ShadowModel(dict.fromkeys(ACTIONS, 2.0), Parameters())
    shadow.apply(model.take_delta())
    for battery, kind in ((1.0, OptionKind.FREE), (0.002, OptionKind.PROBLEMATIC)):
        stand = Stand(telemetry(9.0, "2,1", battery=battery), model=shadow)
        stand.sources = stand.sources._replace(chart=Chart(("#####", "#D..#", "#####"), 1.0))
        assert option(stand.view(), "E").kind is kind
        assert option(stand.view(), "W").kind is OptionKind.FREE, "it leads there"
