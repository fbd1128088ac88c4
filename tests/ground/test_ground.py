"""The ground station: what it believes, says and records."""

from msgspec.structs import replace

from farside.control import Mode
from farside.ground import Ground, GroundConfig, ScriptedOperator
from farside.ground.config import (
    AwaitReached,
    OverrideAt,
    Pursue,
    SwitchMode,
)
from farside.link import LinkConfig, LinkTerms, OneWay, rover_endpoint
from farside.link.endpoint.services import SERVICES
from farside.logs import decode
from farside.messages import (
    Command,
    Event,
    GoalReached,
    Heartbeat,
    Override,
    Proposal,
    SetGoal,
    Shown,
    Telemetry,
)
from farside.node import Journal, to_ns
from farside.topics import (
    GROUND_CHART,
    GROUND_FRAME,
    Answer,
    EventLearned,
    OperatorEntry,
    Review,
    Silence,
)
from tests.ground.conftest import CHART, ROVER, make_belief, proposal, telemetry

TICK_NS = to_ns(0.04)
TERMS = LinkTerms.simulated(LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0)), seed=1)

_ASIDE = {GROUND_FRAME.name, GROUND_CHART.name}


class Bench:
    """A ground node alone, with a rover's endpoint in the test's hand."""

    def __init__(self, *script: SwitchMode | Pursue | AwaitReached) -> None:
        self.ground = Ground(
            GroundConfig(),
            ScriptedOperator(script, CHART),
            tick_ns=TICK_NS,
            terms=TERMS,
            rover=ROVER,
            chart=CHART,
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
        self.heard += [arrival.message for arrival in self.rover.received(self.now_ns)]
        self.entries += [decode(record) for record in records if record.topic not in _ASIDE]


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
    arrived = [arrival.message for arrival in bench.rover.received(to_ns(40.0))]
    commands = [message for message in arrived if isinstance(message, Command)]
    assert [command.number for command in commands] == [1]


def answers(bench: Bench) -> list[tuple[int, str, Answer, str | None]]:
    reviews = [entry for entry in bench.entries if isinstance(entry, Review)]
    assert all(review.review.proposal == review.proposal for review in reviews)
    return [(one.proposal, one.action, one.answer, one.override) for one in reviews]


def test_it_notices_silence_and_its_end() -> None:
    bench = Bench()
    bench.live(20.0)
    assert bench.entries == [Silence(silent=True)]
    bench.live(20.5, telemetry(19.0))
    silences = [entry for entry in bench.entries if isinstance(entry, Silence)]
    assert silences[1:] == [Silence(silent=False)]


def test_what_the_operator_waits_for_is_recorded_once() -> None:
    bench = Bench(SwitchMode(mode=Mode.SHARED), AwaitReached(place="B"))
    bench.live(1.0)
    bench.live(2.0, telemetry(0.0, mode=Mode.SHARED, commands_done=1))
    bench.live(9.0)
    assert [entry for entry in bench.entries if isinstance(entry, OperatorEntry)] == [
        OperatorEntry(1, 2, "telemetry that confirms mode shared"),
        OperatorEntry(2, 2, "goal B to be reached, which others set"),
    ]


def test_heartbeats_say_what_was_given_and_heard() -> None:
    bench = Bench(SwitchMode(mode=Mode.SHARED))
    bench.live(1.0)
    bench.live(9.0, telemetry(0.5))
    assert Heartbeat(1, to_ns(0.5), to_ns(0.5)) in bench.heard


def test_a_review_records_the_path_that_was_looked_at() -> None:
    bench = Bench(Pursue(place="B", overrides=(OverrideAt(proposal=1, action="W"),)))
    bench.live(1.0)
    bench.live(2.0, proposal(1))
    assert answers(bench) == [(1, "E", Answer.OVERRIDDEN, "W")]


def test_a_review_is_of_the_proposal_answered_though_a_newer_one_has_arrived() -> None:
    belief = make_belief()
    belief.consider(proposal(1, "N"))
    belief.consider(proposal(2, "E"))
    assert belief.proposal == proposal(2, "E")
    assert belief.proposal_numbered(1) == proposal(1, "N")


def test_the_operator_is_known_to_have_been_shown_what_goes_ahead_without_a_veto() -> None:
    bench = Bench(Pursue(place="B", overrides=(OverrideAt(proposal=2, action="W"),)))
    bench.live(1.0)
    bench.live(2.0, replace(proposal(1), veto_window_s=9.0))
    bench.live(4.0, replace(proposal(2), veto_window_s=9.0))
    bench.live(8.0)
    assert [m for m in bench.heard if isinstance(m, Shown)] == [Shown(1), Shown(2)]
    orders = [m.order for m in bench.heard if isinstance(m, Command)]
    assert orders == [SetGoal(("at:B",), 2.0), Override(2, "W")], "the first needs no word"
    assert answers(bench) == [(2, "E", Answer.OVERRIDDEN, "W")]
