"""What a person at the ground can know: proposal, goals, failsafe, and what will happen anyway."""

from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from view_stand import CORRIDOR, Stand, option, proposal, stand_at

from farside.acts import Act, Planned
from farside.control import (
    BatteryState,
    Failsafe,
    Mode,
    OnLoss,
)
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel
from farside.frames import OutageReason
from farside.ground.view.view import Focus, GoalSource, OptionKind
from farside.link import LinkConfig, OneWay
from farside.link.profile.config import Blackout
from farside.messages import (
    Approve,
    BatteryChanged,
    Drive,
    FailsafeChanged,
    Happening,
    ModelUpdate,
    SetGoal,
    SetOnLoss,
    Veto,
    WithdrawGoal,
)
from farside.node import NS_PER_S, to_ns
from farside.places import ACTIONS
from tests.ground.conftest import telemetry

# --- the proposal ----------------------------------------------------------------------------


def test_what_is_proposed_is_marked_until_it_is_answered() -> None:
    stand = stand_at("A", mode=Mode.SHARED).propose(proposal())
    found = option(stand.view(), "E")
    assert (found.kind, found.why) == (OptionKind.PROPOSED, ("proposed, to B",))
    assert stand.view().review is not None
    assert stand.view().veto_until_ns is None
    assert stand.view().if_nothing == "the rover stands and waits for your word"

    view = stand.give(Approve(14)).view()
    assert option(view, "E").kind is OptionKind.PROBLEMATIC
    assert option(view, "E").why == ("your answer to proposal 14 is on its way",)


def test_after_a_veto_nothing_more_is_proposed() -> None:
    stand = stand_at("A", mode=Mode.SHARED, goals=(("at:B",),)).propose(proposal())
    assert stand.give(Veto(14)).view().if_nothing == (
        "the rover carries out command 1, then stands, and proposes nothing more from here"
    )


def test_a_veto_window_says_until_when_a_veto_comes_in_time() -> None:
    """Shown is at the rover at 11 s; a veto takes a second, and a second counts as margin."""
    stand = stand_at("A", mode=Mode.SHARED).propose(proposal(veto_window_s=6.0))
    assert stand.view().veto_until_ns == to_ns(15.0)
    assert stand.view().if_nothing == "the rover goes E in 7.0 s at the earliest"
    late = stand.view(after_s=6.0)
    assert late.veto_until_ns == to_ns(15.0)
    assert late.if_nothing == "the rover goes E in 1.0 s at the earliest"


# --- goals -----------------------------------------------------------------------------------


def test_goals_are_those_on_board_and_those_on_their_way() -> None:
    stand = stand_at("A", goals=(("at:B",), ("on_charge",)))
    stand.give(SetGoal(("at:2,1",), 3.0), WithdrawGoal(("at:B",)))
    found = {goal.tokens[0]: goal for goal in stand.view().goals}
    assert (found["at:2,1"].source, found["at:2,1"].is_sent) == (GoalSource.OPERATOR, True)
    assert (found["at:B"].source, found["at:B"].is_withdrawn) == (GoalSource.MISSION, True)
    assert found["on_charge"].source is GoalSource.ROVER


def test_the_heat_is_the_cost_from_every_known_place() -> None:
    view = stand_at("A").view(Focus(goal=("at:B",), heat=True))
    costs = {one.place: one.cost_to_go for one in view.heat}
    assert set(costs) == {f"at:{place}" for place in CORRIDOR}
    assert costs["at:B"] == 0.0
    assert costs["at:A"] > costs["at:2,1"] > costs["at:3,1"] > 0
    assert view.path is not None
    assert view.path.cost_to_go == costs["at:A"]
    assert stand_at("A").view(Focus(goal=("at:B",))).heat == ()


# --- the failsafe ----------------------------------------------------------------------------


def test_the_countdown_begins_when_the_newest_frame_arrives() -> None:
    failsafe = stand_at("A", alone_goals=(("at:B",), ("at:A",))).view().failsafe
    assert (failsafe.holds_ns, failsafe.alone_ns) == (to_ns(21.0), to_ns(41.0))
    assert failsafe.will == "holds 10 s into a silence, alone at 30 s: goes to B, then A"


def test_in_a_silence_it_began_when_the_rover_is_known_to_have_heard() -> None:
    stand = stand_at("A", alone_goals=(("at:B",),))
    view = stand.view(after_s=20.0)
    assert view.silent_since_ns is not None
    assert view.failsafe.alone_ns == to_ns(9.0 - 10.0 + 30.0) + to_ns(2.0), "light time is no gap"
    assert view.if_nothing.startswith(
        "nothing is heard, though it should be: if the rover hears nothing either, it "
    )


def test_without_goals_or_leave_it_is_never_alone() -> None:
    assert stand_at("A").view().failsafe.alone_ns is None
    forbidden = stand_at("A", alone_goals=(("at:B",),)).give(SetOnLoss(OnLoss.HOLD))
    assert forbidden.view().failsafe.alone_ns is None
    assert forbidden.view().failsafe.will.endswith("it may not act alone")


def test_planned_silence_does_not_count() -> None:
    closed = Blackout(start_s=12.0, end_s=112.0, reason=OutageReason.PASS)
    link = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0), blackouts=(closed,))
    view = Stand(telemetry(9.0, "A", alone_goals=(("at:B",),)), link=link).view()
    assert view.failsafe.holds_ns == to_ns(121.0)
    assert (view.up.is_open, view.up.changes_ns) == (True, to_ns(11.0))
    assert (view.down.is_open, view.down.changes_ns) == (True, to_ns(13.0))


# --- if the operator does nothing --------------------------------------------------------------

B = ("at:B",)


@pytest.mark.parametrize(
    ("changes", "acts", "sentence"),
    [
        ({}, [], "stands and waits for your orders"),
        ({}, [Drive("E")], "carries out command 1 (E), then stands and waits for your orders"),
        ({"mode": Mode.SHARED}, [], "stands: it has no goal"),
        ({"mode": Mode.SHARED, "goals": (B,)}, [], "stands, and proposes nothing now"),
        (
            {"mode": Mode.SHARED},
            [SetGoal(B, 2.0)],
            "carries out command 1, then proposes its next step to B",
        ),
        ({"mode": Mode.AUTONOMOUS, "goals": (B,)}, [], "goes on to B by itself"),
        ({"mode": Mode.AUTONOMOUS}, [], "stands: it has no goal"),
        (
            {"mode": Mode.AUTONOMOUS, "goals": (B,)},
            [Drive("E")],
            "carries out command 1 (E), then stands and waits for your orders",
        ),
        (
            {"mode": Mode.AUTONOMOUS, "goals": (("at:nowhere",),)},
            [],
            "stands, unless it knows a way to nowhere",
        ),
    ],
)
def test_if_the_operator_does_nothing(
    changes: dict[str, object], acts: Sequence[Act], sentence: str
) -> None:
    assert stand_at("A", **changes).give(*acts).view().if_nothing == f"the rover {sentence}"


@pytest.mark.parametrize(
    ("happened", "sentence"),
    [
        (BatteryChanged(BatteryState.FLAT, 0.0), "stands: its battery is flat"),
        (FailsafeChanged(Failsafe.SAFE, "it is stuck", 0), "stands: it is stuck"),
        (FailsafeChanged(Failsafe.HOLD, "nothing is heard", 0), "stands: nothing is heard"),
        (
            FailsafeChanged(Failsafe.ALONE, "the link is lost", 0),
            "has lost the link, and goes on to B by itself",
        ),
    ],
)
def test_if_the_operator_does_nothing_while_something_is_wrong(
    happened: Happening, sentence: str
) -> None:
    stand = stand_at("A", mode=Mode.AUTONOMOUS, goals=(B,), alone_goals=(B,))
    assert stand.tell(happened, at_s=9.5).view().if_nothing == f"the rover {sentence}"


def test_what_is_held_here_goes_out_by_itself() -> None:
    closed = Blackout(start_s=5.0, end_s=112.0, reason=OutageReason.PASS)
    link = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0), blackouts=(closed,))
    stand = Stand(telemetry(4.0, "A"), link=link).give(Planned(Drive("E"), link_up=True))
    assert stand.view().if_nothing == (
        "the rover stands and waits for your orders; "
        "the order held here will be sent once the link is up"
    )


def test_what_has_expired_is_not_carried_out() -> None:
    stand = stand_at("A").give(Drive("E"))
    expires_ns = stand.desk.live[0].command.expires_ns
    for after_ns, said in ((0, "carries out command 1 (E), then"), (1, "stands")):
        stand.belief.heard_ns = expires_ns + after_ns
        after_s = (expires_ns + after_ns - stand.now_ns) / NS_PER_S
        assert stand.view(after_s=after_s).if_nothing.startswith(f"the rover {said}")


def test_before_anything_is_heard_nothing_is_claimed() -> None:
    view = Stand().view(after_s=-8.0)
    assert view.if_nothing == (
        "nothing has been heard of the rover yet: it stands and waits for your orders"
    )
    assert (view.failsafe.state, view.start, view.predicted) == (None, (), None)
    assert {one.why for one in view.options} == {("it is not known where it would begin",)}


def test_how_long_the_battery_lasts_at_rest_is_told_but_on_the_dock() -> None:
    assert Stand(telemetry(9.0, "A", battery=0.5)).view().rest_s == 0.5 * 1e5 / 10.0 - 1.0
    docked = Stand(telemetry(9.0, "A", tokens=("at:A", "on_charge"))).view()
    assert docked.rest_s is None


def test_surprises_are_the_share_of_the_most_credible_expectations_that_failed() -> None:
    """After eight moves that came true and one bump, of which only the most credible fell due."""
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 1.0), Parameters(), rng=np.random.default_rng(1)
    )
    model.record_changes()
    stand = Stand(telemetry(9.0, "A"), model=ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters()))
    shadow = stand.sources.shadow
    assert shadow is not None

    def update(*moves: tuple[str, str]) -> None:
        for action, place in moves:
            model.perform(action)
            model.sense([place])
        delta = model.take_delta()
        packed = msgspec.msgpack.encode(delta)
        shadow.apply(ModelUpdate(delta.number, to_ns(9.0), 1, model.lists_check(), packed))
        assert shadow.why is None

    model.sense(["at:A"])
    update(*[("E", "at:2,1"), ("W", "at:A")] * 3)
    assert stand.view().surprises is None, "a whole says nothing of what came true"
    update(*[("E", "at:2,1"), ("W", "at:A")] * 2)
    assert stand.view().surprises == 0.0
    update(("E", "at:A"))
    assert stand.view().surprises == pytest.approx(1 / 5)
    assert stand.view().cm == pytest.approx(model.mean_cm)
    assert stand.view(after_s=400.0).surprises is None, "that was long ago"
