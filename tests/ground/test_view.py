"""What a person at the ground can know: options, goals, failsafe, and what will happen anyway."""

from collections.abc import Sequence

import msgspec
import numpy as np
import pytest

from farside.acts import Act
from farside.control import (
    BatteryState,
    CommandStage,
    Failsafe,
    Mode,
    OnLoss,
)
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel
from farside.frames import OutageReason
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.moves import MoveTimes
from farside.ground.outlook import Outlook
from farside.ground.shadow import Shadow
from farside.ground.view.knowledge import Sources
from farside.ground.view.looking import look
from farside.ground.view.memory import Memory
from farside.ground.view.view import Focus, GoalSource, GroundView, Option, OptionKind
from farside.link import LinkConfig, LinkTerms, OneWay
from farside.link.profile.config import Blackout
from farside.messages import (
    Approve,
    BatteryChanged,
    CommandReached,
    Drive,
    Event,
    FailsafeChanged,
    Happening,
    ModelUpdate,
    Proposal,
    SetGoal,
    SetMode,
    SetOnLoss,
    StuckChanged,
    Telemetry,
    Veto,
    WithdrawGoal,
)
from farside.node import Direction, Frame, Journal, to_ns
from farside.places import ACTIONS, Chart
from tests.ground.conftest import MOVES, ROVER, make_belief, make_desk, telemetry

LINK = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0))
YARD = Chart(("######", "#.~.o#", "#A..B#", "######"), 1.0)
CORRIDOR = ("A", "2,1", "3,1", "B")


def driven(*bumps: str) -> ShadowModel:
    """The shadow of a model that was driven along the corridor, and bumped at A these ways."""
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 1.0), Parameters(), rng=np.random.default_rng(1)
    )
    model.record_changes()
    model.sense(["at:A"])
    for _ in range(4):
        for action, places in (("E", CORRIDOR[1:]), ("W", CORRIDOR[-2::-1])):
            for place in places:
                model.perform(action)
                model.sense([f"at:{place}"])
    for action in bumps:
        model.perform(action)
        model.sense(["at:A"])
    shadow = ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters())
    shadow.apply(model.take_delta())
    return shadow


class Stand:
    """A ground that was told this, at 10 s of light time 1 s, and gave these acts."""

    def __init__(
        self, *heard: Telemetry, model: ShadowModel | None = None, link: LinkConfig = LINK
    ) -> None:
        terms = LinkTerms.simulated(link, seed=1)
        self.now_ns = to_ns(10.0)
        self.belief, self.desk = make_belief(link), make_desk(link, valid_ns=to_ns(60.0))
        self.memory, plan, times = Memory(terms.schedule), DownlinkPlan(terms), MoveTimes(MOVES)
        self.silence = GroundSilence(plan, to_ns(6.0), to_ns(1.0))
        shadow = Shadow(model or driven(), Journal())
        outlook = Outlook(
            self.belief,
            self.desk,
            self.silence,
            shadow=shadow,
            times=times,
            alone_after_ns=ROVER.alone_after_ns,
        )
        self.sources = Sources(
            self.belief,
            self.desk,
            self.silence,
            outlook,
            self.memory,
            shadow=shadow,
            plan=plan,
            schedule=terms.schedule,
            rover=ROVER,
            chart=YARD,
        )
        for message in heard:
            self.belief.learn(message, self.now_ns)
            self.desk.learn(message, self.now_ns)
        if heard:
            self.belief.heard_ns = self.now_ns
        self.silence.look(self.belief.heard_ns, self.now_ns)
        heartbeat = Frame(Direction.UP, 0, self.now_ns, bytes(20))
        self.memory.send([heartbeat])

    def tell(self, *happened: Happening, at_s: float = 9.0) -> "Stand":
        for number, what in enumerate(happened, start=self.belief.last_event + 1):
            event = Event(number, to_ns(at_s), what)
            self.belief.tell(event, self.now_ns)
            self.memory.tell(event)
            if isinstance(what, CommandReached):
                self.desk.learn_stage(what, to_ns(at_s), self.now_ns)
        return self

    def give(self, *acts: Act) -> "Stand":
        for act in acts:
            self.memory.give(act)
            self.desk.give(act, self.now_ns)
        return self

    def propose(self, proposal: Proposal) -> "Stand":
        self.belief.consider(proposal)
        self.memory.show(proposal.number, self.now_ns)
        return self

    def view(self, focus: Focus | None = None, after_s: float = 0.0) -> GroundView:
        now_ns = self.now_ns + to_ns(after_s)
        self.silence.look(self.belief.heard_ns, now_ns)
        return look(self.sources, focus or Focus(), now_ns, now_ns)


def option(view: GroundView, action: str) -> Option:
    return next(option for option in view.options if option.action == action)


def stand_at(place: str, *bumps: str, **changes: object) -> Stand:
    return Stand(telemetry(9.0, place, **changes), model=driven(*bumps))


def proposal(action: str = "E", veto_window_s: float | None = None) -> Proposal:
    return Proposal(14, to_ns(9.5), ("at:B",), action, (), veto_window_s)


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


def test_before_anything_is_heard_nothing_is_claimed() -> None:
    view = Stand().view(after_s=-8.0)
    assert view.if_nothing == (
        "nothing has been heard of the rover yet: it stands and waits for your orders"
    )
    assert (view.failsafe.state, view.start, view.predicted) == (None, (), None)
    assert {one.why for one in view.options} == {("it is not known where it would begin",)}


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
