"""The ground station: what it believes, and what its script makes it do."""

from typing import Any

from farside.control import Chooser, Failsafe, Mode
from farside.ground import Ground, GroundConfig, ScriptedOperator, Situation
from farside.ground.belief import Belief
from farside.ground.commands import CommandDesk
from farside.ground.config import AwaitReached, OverrideAt, Pursue, SwitchMode, Tour, WaitUntil
from farside.link import LinkConfig, LinkTerms, OneWay, rover_endpoint
from farside.link.endpoint.endpoint import SERVICES
from farside.logs import decode
from farside.messages import (
    Approve,
    Command,
    Drive,
    Event,
    GoalReached,
    Heartbeat,
    Order,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.node import Journal, to_ns
from farside.places import Chart
from farside.topics import GROUND_FRAME, EventLearned, OperatorEntry, Review, Silence

CHART = Chart(("######", "#A..B#", "######"), 1.0)
TICK_NS = to_ns(0.04)
TERMS = LinkTerms.simulated(LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0)), seed=1)


def telemetry(t_s: float = 0.0, place: str = "A", **changes: Any) -> Telemetry:
    values = {
        "time_ns": to_ns(t_s),
        "tokens": (f"at:{place}",),
        "x_m": 0.0,
        "y_m": 0.0,
        "heading_rad": 0.0,
        "battery": 1.0,
        "mode": Mode.GUIDED,
        "failsafe": Failsafe.NOMINAL,
        "action": None,
        "goals": (),
        "commands_done": 0,
    }
    return Telemetry(**{**values, **changes})


def proposal(number: int, action: str = "E") -> Proposal:
    return Proposal(number, 0, ("at:B",), action, Chooser.GOAL_DIRECTED, ())


# --- belief --------------------------------------------------------------------------------------


def test_older_telemetry_does_not_overwrite_newer() -> None:
    belief = Belief()
    belief.learn(telemetry(5.0, "B"))
    belief.learn(telemetry(4.0, "A"))
    assert belief.telemetry.tokens == ("at:B",)


# --- the command desk ----------------------------------------------------------------------------


def test_commands_are_numbered_without_a_gap_and_expire() -> None:
    desk = CommandDesk(valid_ns=1000)
    assert desk.give(Drive("N"), 7) == Command(1, 1007, Drive("N"))
    assert desk.give(Drive("E"), 9) == Command(2, 1009, Drive("E"))
    assert desk.last_given == 2


# --- the scripted operator -----------------------------------------------------------------------


class Scene:
    """An operator and what it is shown."""

    def __init__(self, *script: Tour | SwitchMode | Pursue | WaitUntil) -> None:
        self.operator = ScriptedOperator(script, CHART)
        self.belief = Belief()

    def act(self, t_s: float = 0.0, *, settled: bool = True, silent: bool = False) -> list[Order]:
        return list(self.operator.act(Situation(to_ns(t_s), self.belief, settled, silent)))


def test_on_a_tour_it_moves_and_waits() -> None:
    scene = Scene(Tour(places=("B", "A")))
    assert scene.act() == [], "it does not know yet where the rover is"
    scene.belief.learn(telemetry(1, "A"))
    assert scene.act() == [Drive("E")]
    assert scene.act(settled=False) == []
    scene.belief.learn(telemetry(2, "2,1"))
    assert scene.act() == [Drive("E")]
    scene.belief.learn(telemetry(3, "2,1"))
    assert scene.act() == [Drive("E")], "the move failed, so it is tried again"
    scene.belief.learn(telemetry(4, "B"))
    assert scene.act() == [Drive("W")]


def test_it_sends_no_drive_into_silence() -> None:
    scene = Scene(Tour(places=("B",)))
    scene.belief.learn(telemetry(1, "A"))
    assert scene.act(silent=True) == []
    assert scene.act() == [Drive("E")]


def test_it_waits_for_the_mode_before_it_goes_on() -> None:
    scene = Scene(SwitchMode(mode=Mode.SHARED), Pursue(place="B"))
    assert scene.act() == [SetMode(Mode.SHARED)]
    scene.belief.learn(telemetry(1))
    assert scene.act() == []
    scene.belief.learn(telemetry(2, mode=Mode.SHARED))
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
    scene.belief.events.append(Event(1, 0, GoalReached(("at:B",))))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    assert scene.act() == []
    scene.belief.events.append(Event(2, 9, GoalReached(("at:B",))))
    assert scene.act() == [SetMode(Mode.GUIDED)]


def test_it_waits_for_its_time_and_rests_when_the_script_is_over() -> None:
    scene = Scene(WaitUntil(until_s=10.0), SwitchMode(mode=Mode.GUIDED))
    assert scene.act(9.9) == []
    assert scene.act(10.0) == [SetMode(Mode.GUIDED)]
    scene.belief.learn(telemetry())
    assert [scene.act(11.0), scene.act(12.0)] == [[], []]


def test_it_says_where_it_has_got_to_and_what_it_waits_for() -> None:
    scene = Scene(
        Tour(places=("B",)), SwitchMode(mode=Mode.SHARED), Pursue(place="A"), WaitUntil(until_s=9)
    )
    assert scene.operator.progress == OperatorEntry(0, 4, None)
    scene.act()
    assert scene.operator.progress == OperatorEntry(1, 4, "the rover to be at B")
    scene.belief.learn(telemetry(1, "B"))
    scene.act()
    assert scene.operator.progress == OperatorEntry(2, 4, "telemetry that confirms mode shared")
    scene.belief.learn(telemetry(2, "B", mode=Mode.SHARED))
    scene.act()
    assert scene.operator.progress == OperatorEntry(3, 4, "goal A to be reached")
    scene.belief.events.append(Event(1, 0, GoalReached(("at:A",))))
    scene.act(3)
    assert scene.operator.progress == OperatorEntry(4, 4, "9 s")
    scene.act(9)
    assert scene.operator.progress == OperatorEntry(4, 4, None)


# --- the node ------------------------------------------------------------------------------------


class Bench:
    """A ground node alone, with a rover's endpoint in the test's hand."""

    def __init__(self, *script: SwitchMode | Pursue | AwaitReached) -> None:
        self.ground = Ground(
            GroundConfig(),
            ScriptedOperator(script, CHART),
            tick_ns=TICK_NS,
            terms=TERMS,
        )
        self.rover = rover_endpoint(TERMS, Journal())
        self.now_ns = 0
        self.entries: list[object] = []
        self.heard: list[object] = []

    def live(self, until_s: float, *messages: Event | Telemetry | Proposal) -> None:
        """Go on until then, with these messages from the rover arriving now."""
        for message in messages:
            self.rover.send(message, self.now_ns)
        frames, records = self.ground.advance(to_ns(until_s), self.rover.take_sent())
        self.rover.expect(frames)
        self.now_ns = to_ns(until_s)
        self.heard += list(self.rover.received(self.now_ns))
        self.entries += [decode(record) for record in records if record.topic != GROUND_FRAME.name]


def test_heartbeats_go_out_steadily_and_events_are_learned() -> None:
    bench = Bench()
    bench.live(3.0)
    assert bench.heard == [Heartbeat(), Heartbeat()]
    event = Event(1, 5, GoalReached(("at:A",)))
    bench.live(5.0, event)
    assert EventLearned(event) in bench.entries


def test_a_command_goes_out_once_and_again_where_no_answer_comes() -> None:
    bench = Bench(SwitchMode(mode=Mode.SHARED))
    frames, _ = bench.ground.advance(to_ns(30.0), [])
    copies = [frame for frame in frames if frame.priority == SERVICES[Command].priority]
    assert len(copies) > 1
    bench.rover.expect(frames)
    commands = [m for m in bench.rover.received(to_ns(40.0)) if isinstance(m, Command)]
    assert [command.number for command in commands] == [1]


def test_it_notices_silence_and_its_end() -> None:
    bench = Bench()
    bench.live(20.0)
    assert bench.entries == [Silence(silent=True)]
    bench.live(20.5, telemetry(19.0))
    assert bench.entries[-1] == Silence(silent=False)


def test_what_the_operator_waits_for_is_recorded_once() -> None:
    bench = Bench(SwitchMode(mode=Mode.SHARED), AwaitReached(place="B"))
    bench.live(1.0)
    bench.live(2.0, telemetry(0.0, mode=Mode.SHARED, commands_done=1))
    bench.live(9.0)
    assert [entry for entry in bench.entries if isinstance(entry, OperatorEntry)] == [
        OperatorEntry(1, 2, "telemetry that confirms mode shared"),
        OperatorEntry(2, 2, "goal B to be reached, which others set"),
    ]


def test_a_review_records_the_path_that_was_looked_at() -> None:
    bench = Bench(Pursue(place="B", overrides=(OverrideAt(proposal=1, action="W"),)))
    bench.live(1.0)
    bench.live(2.0, proposal(1))
    assert Review(1, "E", "W", ()) in bench.entries
