"""The ground station: what it believes, what it repeats, and what its script makes it do."""

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from farside.ground import Ground, GroundConfig, ScriptedOperator, Situation
from farside.ground.belief import Belief
from farside.ground.config import OverrideAt, Pursue, SwitchMode, Tour, WaitUntil
from farside.ground.desk import CommandDesk
from farside.link import Chart, rover_endpoint, to_ns
from farside.link.messages import (
    Approve,
    Chooser,
    Command,
    Drive,
    Event,
    Failsafe,
    GoalReached,
    Heartbeat,
    Mode,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.link.records import TOPICS, EventLearned, Review, Silence

CHART = Chart(("######", "#A..B#", "######"), 1.0)
TICK_NS = to_ns(0.04)


def telemetry(t_s=0.0, place="A", **changes):
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
        "command_acked": 0,
        "commands_done": 0,
    }
    return Telemetry(**{**values, **changes})


def proposal(number, action="E"):
    return Proposal(number, ("at:B",), action, Chooser.GOAL_DIRECTED, ())


# --- belief --------------------------------------------------------------------------------------


def test_older_telemetry_does_not_overwrite_newer():
    belief = Belief()
    belief.learn(telemetry(5.0, "B"))
    belief.learn(telemetry(4.0, "A"))
    assert belief.telemetry.tokens == ("at:B",)


@given(st.permutations(range(1, 7)), st.integers(1, 4))
def test_events_are_learned_once_in_order_and_without_a_gap(order, batch):
    events = {n: Event(n, n, GoalReached((f"at:{n}",))) for n in range(1, 7)}
    belief, learned = Belief(), []
    for _ in range(6):  # repeated until acknowledged, as the rover does
        for start in range(0, 6, batch):
            some = tuple(sorted((events[n] for n in order[start : start + batch]), key=_number))
            learned += belief.learn(telemetry(events=some))
    assert learned == [events[n] for n in range(1, 7)]


def _number(event):
    return event.number


# --- the command desk ----------------------------------------------------------------------------


def test_a_command_is_repeated_with_all_after_it_until_it_is_acknowledged():
    desk = CommandDesk(answer_ns=100, valid_ns=1000)
    desk.give(Drive("N"), 0)
    desk.give(Drive("E"), 50)
    assert desk.overdue(99) == []
    assert [(s.command.number, s.attempt) for s in desk.overdue(100)] == [(1, 2), (2, 2)]
    desk.acknowledge(1, 150)
    assert desk.overdue(249) == []
    assert [(s.command.number, s.attempt) for s in desk.overdue(250)] == [(2, 3)]
    desk.acknowledge(2, 300)
    assert desk.overdue(10_000) == []


def test_a_repeated_command_keeps_its_expiry():
    desk = CommandDesk(answer_ns=100, valid_ns=1000)
    first = desk.give(Drive("N"), 7)
    assert desk.overdue(900)[0].command == first.command
    assert first.command.expires_ns == 1007


# --- the scripted operator -----------------------------------------------------------------------


class Scene:
    """An operator and what it is shown."""

    def __init__(self, *script):
        self.operator = ScriptedOperator(script, CHART)
        self.belief = Belief()

    def act(self, t_s=0.0, *, settled=True, silent=False):
        return list(self.operator.act(Situation(to_ns(t_s), self.belief, settled, silent)))


def test_on_a_tour_it_moves_and_waits():
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


def test_it_sends_no_drive_into_silence():
    scene = Scene(Tour(places=("B",)))
    scene.belief.learn(telemetry(1, "A"))
    assert scene.act(silent=True) == []
    assert scene.act() == [Drive("E")]


def test_it_waits_for_the_mode_before_it_goes_on():
    scene = Scene(SwitchMode(mode=Mode.SHARED), Pursue(place="B"))
    assert scene.act() == [SetMode(Mode.SHARED)]
    scene.belief.learn(telemetry(1))
    assert scene.act() == []
    scene.belief.learn(telemetry(2, mode=Mode.SHARED))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]


def test_it_answers_each_proposal_once_and_overrides_where_told():
    scene = Scene(Pursue(place="B", overrides=(OverrideAt(proposal=2, action="W"),)))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    scene.belief.consider(proposal(1))
    assert scene.act() == [Approve(1)]
    assert scene.act() == []
    scene.belief.consider(proposal(2))
    assert scene.act() == [Override(2, "W")]
    scene.belief.consider(proposal(3))
    assert scene.act() == [Approve(3)]


def test_proposals_from_before_the_goal_are_not_answered():
    scene = Scene(Pursue(place="B"))
    scene.belief.consider(proposal(7))
    scene.act()
    assert scene.act() == []
    scene.belief.consider(proposal(8))
    assert scene.act() == [Approve(8)]


def test_a_goal_reached_before_it_was_sent_is_not_this_goal():
    scene = Scene(Pursue(place="B"), SwitchMode(mode=Mode.GUIDED))
    scene.belief.learn(telemetry(events=(Event(1, 0, GoalReached(("at:B",))),)))
    assert scene.act() == [SetGoal(("at:B",), 2.0)]
    assert scene.act() == []
    scene.belief.learn(telemetry(events=(Event(2, 9, GoalReached(("at:B",))),)))
    assert scene.act() == [SetMode(Mode.GUIDED)]


def test_it_waits_for_its_time_and_rests_when_the_script_is_over():
    scene = Scene(WaitUntil(until_s=10.0), SwitchMode(mode=Mode.GUIDED))
    assert scene.act(9.9) == []
    assert scene.act(10.0) == [SetMode(Mode.GUIDED)]
    scene.belief.learn(telemetry())
    assert [scene.act(11.0), scene.act(12.0)] == [[], []]


# --- the node ------------------------------------------------------------------------------------


class Bench:
    """A ground node alone, with a rover's endpoint in the test's hand."""

    def __init__(self, *script):
        self.ground = Ground(
            GroundConfig(),
            ScriptedOperator(script, CHART),
            tick_ns=TICK_NS,
            round_trip_ns=to_ns(2.0),
        )
        self.rover = rover_endpoint()
        self.entries = []
        self.heard = []

    def live(self, until_s, *messages):
        """Go on until then, with these messages from the rover arriving now."""
        for message in messages:
            self.rover.send(message, self.ground._now_ns)
        frames, records = self.ground.advance(to_ns(until_s), self.rover.take_sent())
        self.rover.expect(frames)
        self.heard += [message for _, message in self.rover.received(to_ns(until_s))]
        self.entries += [msgspec.json.decode(r.payload, type=TOPICS[r.topic]) for r in records]


def test_heartbeats_go_out_steadily_and_acknowledge_events():
    bench = Bench()
    bench.live(3.0)
    assert bench.heard == [Heartbeat(0), Heartbeat(0)]
    event = Event(1, 5, GoalReached(("at:A",)))
    bench.live(5.0, telemetry(1.0, events=(event,)))
    assert bench.heard[-1] == Heartbeat(1)
    assert bench.entries[-1] == EventLearned(event)


def test_an_unacknowledged_command_is_sent_again():
    bench = Bench(SwitchMode(mode=Mode.SHARED))
    bench.live(9.0)
    commands = [message for message in bench.heard if isinstance(message, Command)]
    assert [command.number for command in commands] == [1, 1, 1]
    bench.live(30.0, telemetry(9.0, command_acked=1))
    assert len([message for message in bench.heard if isinstance(message, Command)]) == 3


def test_it_notices_silence_and_its_end():
    bench = Bench()
    bench.live(20.0)
    assert bench.entries == [Silence(silent=True)]
    bench.live(20.5, telemetry(19.0))
    assert bench.entries[-1] == Silence(silent=False)


def test_a_review_records_the_path_that_was_looked_at():
    bench = Bench(Pursue(place="B", overrides=(OverrideAt(proposal=1, action="W"),)))
    bench.live(1.0)
    bench.live(2.0, proposal(1))
    assert Review(1, "E", "W", ()) in bench.entries
