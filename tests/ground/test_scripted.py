"""The scripted operator: what its script makes it do."""

from msgspec.structs import replace

from farside.acts import Act
from farside.control import CommandStage, Mode
from farside.ground import ScriptedOperator, Situation
from farside.ground.config import (
    AwaitReached,
    OverrideAt,
    Pursue,
    ScriptStep,
    SwitchMode,
    Tour,
    WaitUntil,
)
from farside.messages import (
    Approve,
    CommandReached,
    Drive,
    Event,
    GoalReached,
    Order,
    Override,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.node import to_ns
from farside.places import Chart
from farside.topics import OperatorEntry
from tests.ground.conftest import CHART, make_belief, make_desk, make_outlook, proposal, telemetry


class Scene:
    """An operator and what it is shown."""

    def __init__(self, *script: ScriptStep, chart: Chart = CHART) -> None:
        self.operator = ScriptedOperator(script, chart)
        self.belief = make_belief()
        self.desk = make_desk(valid_ns=10**9)
        self.learn(telemetry(0.0, "nowhere"))

    def learn(self, telemetry: Telemetry, *, settled: bool = True) -> None:
        """Telemetry arrives, which says that all commands are over unless told otherwise."""
        if settled:
            telemetry = replace(telemetry, commands_done=self.desk.last_given)
        self.belief.learn(telemetry, telemetry.time_ns)
        self.desk.learn(telemetry)

    def end(self, stage: CommandStage) -> None:
        """The last command is known to have ended like this."""
        self.desk.learn_stage(CommandReached(self.desk.last_given, stage, "for a reason"))

    def act(self, t_s: float = 0.0, *, silent: bool = False) -> list[Act]:
        now_ns = to_ns(t_s)
        outlook = make_outlook(self.belief, self.desk)
        situation = Situation(now_ns, self.belief, self.desk, silent, outlook)
        orders = list(self.operator.act(situation))
        for order in orders:
            assert isinstance(order, Order)
            self.desk.give(order, now_ns)
        return orders


def test_on_a_tour_it_moves_and_waits() -> None:
    scene = Scene(Tour(places=("B", "A")))
    assert scene.act() == [], "it does not know yet where the rover is"
    assert scene.operator.progress.waiting_for == "the rover to know where it is"
    scene.learn(telemetry(1, "A"))
    assert scene.act() == [Drive("E")]
    assert scene.act() == []
    scene.learn(telemetry(2, "2,1"))
    assert scene.act() == [Drive("E")]
    scene.learn(telemetry(3, "2,1"))
    scene.end(CommandStage.FAILED)
    assert scene.act() == [Drive("E")], "the move failed, so it is tried again"
    scene.learn(telemetry(4, "B"))
    assert scene.act() == [Drive("W")]


def test_on_a_tour_it_insists_on_what_was_refused() -> None:
    scene = Scene(Tour(places=("B",)))
    scene.learn(telemetry(1, "A"))
    assert scene.act() == [Drive("E")]
    scene.end(CommandStage.REFUSED)
    scene.learn(telemetry(2, "A"))
    assert scene.act() == [Drive("E", force=True)]
    scene.learn(telemetry(3, "2,1"))
    assert scene.act() == [Drive("E")]


def test_a_rover_that_does_not_know_where_it_is_is_waited_for() -> None:
    scene = Scene(Tour(places=("B",)))
    scene.learn(telemetry(1, tokens=("battery:low",)))
    assert scene.act() == []
    assert scene.operator.progress.waiting_for == "the rover to know where it is"
    scene.learn(telemetry(2, "A"))
    assert scene.act() == [Drive("E")]


def test_a_rover_that_noise_puts_behind_a_wall_is_waited_for() -> None:
    chart = Chart(("#######", "#A.#.B#", "#######"), 1.0)
    scene = Scene(Tour(places=("A",)), chart=chart)
    scene.learn(telemetry(1, "B"))
    assert scene.act() == []
    assert "no way leads" in scene.operator.progress.waiting_for
    scene.learn(telemetry(2, "2,1"))
    assert scene.act() == [Drive("W")]


def test_what_came_too_late_is_ordered_again() -> None:
    scene = Scene(SwitchMode(mode=Mode.SHARED), Pursue(place="B"))
    scene.act()
    scene.end(CommandStage.EXPIRED)
    scene.learn(telemetry(1))
    assert scene.act() == [SetMode(Mode.SHARED)]
    scene.learn(telemetry(2, mode=Mode.SHARED))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    scene.end(CommandStage.EXPIRED)
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    assert scene.act() == []


def test_with_a_low_battery_a_refused_tour_goes_by_the_dock() -> None:
    chart = Chart(("#######", "#A.D.B#", "#######"), 1.0)
    scene = Scene(Tour(places=("B", "A")), chart=chart)
    scene.learn(telemetry(1, tokens=("at:4,1", "battery:low")))
    assert scene.act() == [Drive("E")]
    scene.end(CommandStage.REFUSED)
    scene.learn(telemetry(2, tokens=("at:4,1", "battery:low")))
    assert scene.act() == [Drive("W")]
    scene.learn(telemetry(3, tokens=("at:D", "battery:low", "on_charge")))
    assert scene.act() == []
    assert scene.operator.progress.waiting_for == "the rover to be charged"
    scene.learn(telemetry(4, tokens=("at:D", "on_charge")))
    assert scene.act() == [Drive("E")]


def test_it_sends_no_drive_into_silence() -> None:
    scene = Scene(Tour(places=("B",)))
    scene.learn(telemetry(1, "A"))
    assert scene.act(silent=True) == []
    assert scene.act() == [Drive("E")]


def test_it_waits_for_the_mode_before_it_goes_on() -> None:
    scene = Scene(SwitchMode(mode=Mode.SHARED), Pursue(place="B"))
    assert scene.act() == [SetMode(Mode.SHARED)]
    scene.learn(telemetry(1))
    assert scene.act() == []
    scene.learn(telemetry(2, mode=Mode.SHARED))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]


def test_it_answers_each_proposal_once_and_overrides_where_told() -> None:
    scene = Scene(Pursue(place="B", overrides=(OverrideAt(proposal=2, action="W"),)))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    scene.belief.consider(proposal(1))
    assert scene.act() == [Approve(1)]
    assert scene.act() == []
    scene.belief.consider(proposal(2))
    assert scene.act() == [Override(2, "W")]
    scene.belief.consider(proposal(3))
    assert scene.act() == [Approve(3)]


def test_proposals_from_before_the_goal_are_not_answered() -> None:
    scene = Scene(Pursue(place="B"))
    scene.belief.consider(proposal(7))
    scene.act()
    assert scene.act() == []
    scene.belief.consider(proposal(8))
    assert scene.act() == [Approve(8)]


def test_a_goal_reached_before_it_was_sent_is_not_this_goal() -> None:
    scene = Scene(Pursue(place="B"), SwitchMode(mode=Mode.GUIDED))
    scene.belief.tell(Event(1, 0, GoalReached(("at:B",))), 0)
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    assert scene.act() == []
    scene.belief.tell(Event(2, 9, GoalReached(("at:B",))), 0)
    assert scene.act() == [SetMode(Mode.GUIDED)]


def test_it_waits_for_its_time_and_rests_when_the_script_is_over() -> None:
    scene = Scene(WaitUntil(until_s=10.0), SwitchMode(mode=Mode.GUIDED))
    assert scene.act(9.9) == []
    assert scene.act(10.0) == [SetMode(Mode.GUIDED)]
    scene.learn(telemetry())
    assert [scene.act(11.0), scene.act(12.0)] == [[], []]


def test_it_says_where_it_has_got_to_and_what_it_waits_for() -> None:
    scene = Scene(
        Tour(places=("B",)), SwitchMode(mode=Mode.SHARED), Pursue(place="A"), WaitUntil(until_s=9)
    )
    assert scene.operator.progress == OperatorEntry(0, 4, None)
    scene.act()
    assert scene.operator.progress == OperatorEntry(1, 4, "the rover to know where it is")
    scene.learn(telemetry(1, "A"))
    scene.act()
    assert scene.operator.progress == OperatorEntry(1, 4, "the rover to be at B")
    scene.learn(telemetry(1, "B"))
    scene.act()
    assert scene.operator.progress == OperatorEntry(2, 4, "telemetry that confirms mode shared")
    scene.learn(telemetry(2, "B", mode=Mode.SHARED))
    scene.act()
    assert scene.operator.progress == OperatorEntry(3, 4, "goal A to be reached")
    scene.belief.tell(Event(1, 0, GoalReached(("at:A",))), 0)
    scene.act(3)
    assert scene.operator.progress == OperatorEntry(4, 4, "9 s")
    scene.act(9)
    assert scene.operator.progress == OperatorEntry(4, 4, None)


def test_only_what_happens_after_a_step_began_counts_unless_it_says_otherwise() -> None:
    for already in (False, True):
        scene = Scene(AwaitReached(place="B", already=already), SwitchMode(mode=Mode.GUIDED))
        scene.belief.tell(Event(1, 0, GoalReached(("at:B",))), 0)
        assert bool(scene.act()) is already
        scene.belief.tell(Event(2, 0, GoalReached(("at:B",))), 0)
        assert bool(scene.act()) is not already


def test_a_script_that_is_over_goes_on_with_what_is_added_to_it() -> None:
    scene, shared = Scene(WaitUntil(until_s=1)), SwitchMode(mode=Mode.SHARED)
    for t_s in (1, 2, 3):
        assert scene.act(t_s) == []
    assert scene.operator.progress == OperatorEntry(1, 1, None)

    assert not scene.operator.change([shared], ())
    assert scene.operator.change([WaitUntil(until_s=1)], ())
    assert scene.act(4) == []
    assert scene.operator.change([WaitUntil(until_s=1), shared], ())
    assert scene.act(5) == [SetMode(Mode.SHARED)]
    assert scene.operator.progress.step == 2
