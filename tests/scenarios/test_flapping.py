"""A link that is open for a second or two at a time: what can get through gets through.

The outages are at the rover's end, and no schedule foresees them. A round trip outlasts an opening,
so nothing that the ground sends upon hearing the rover arrives in time.
"""

from collections.abc import Callable, Iterator, Sequence
from heapq import heappop, heappush
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.control import Failsafe, Mode
from farside.link import LinkConfig, LinkTerms, OneWay, ground_endpoint, rover_endpoint
from farside.link.endpoint.endpoint import Endpoint
from farside.messages import (
    Command,
    Event,
    GoalReached,
    Heartbeat,
    SetGoal,
    Telemetry,
)
from farside.node import NEVER_NS, Direction, Frame, Journal, to_ns, to_s

TICK_NS = to_ns(0.1)
UP_BIT_S, DOWN_BIT_S = 2_000, 64_000  # as in the first mission
MINUTE_S = 60.0


class Air:
    """One direction: transmits one frame after the other, and loses what meets an outage."""

    def __init__(self, direction: Direction, light_s: float, rate_bit_s: int) -> None:
        self._is_up = direction is Direction.UP
        self._light_ns, self._rate_bit_s = to_ns(light_s), rate_bit_s
        self._free_ns = 0
        self._waiting: list[tuple[int, int, Frame]] = []
        self.sent_byte = 0

    def carry(self, frames: Sequence[Frame], now_ns: int, opening: "Opening") -> list[Frame]:
        """The frames that will arrive; call it at every moment at which something is sent."""
        for frame in frames:
            heappush(self._waiting, (-frame.priority, frame.sequence, frame))
        arriving = []
        while self._waiting:
            frame = heappop(self._waiting)[2]
            begin_ns = max(now_ns, self._free_ns)
            self._free_ns = begin_ns + to_ns(8 * len(frame.payload) / self._rate_bit_s)
            self.sent_byte += len(frame.payload)
            arrival_ns = self._free_ns + self._light_ns
            if self._is_up:
                passes = opening.has(arrival_ns)
            else:
                passes = opening.has(begin_ns) and opening.has(self._free_ns)
            if passes:
                arriving.append(Frame(frame.direction, frame.sequence, arrival_ns, frame.payload))
        return arriving


class Opening:
    """Open for `open_s` in every `period_s`, the first time from `phase_s` on."""

    def __init__(self, open_s: float, period_s: float, phase_s: float) -> None:
        self._open_ns, self._period_ns = to_ns(open_s), to_ns(period_s)
        self._phase_ns = to_ns(phase_s)

    def has(self, time_ns: int) -> bool:
        return (time_ns - self._phase_ns) % self._period_ns < self._open_ns

    def __repr__(self) -> str:
        times_s = (to_s(ns) for ns in (self._open_ns, self._period_ns, self._phase_ns))
        return "open for {} s in every {} s from {} s on".format(*times_s)


class Flapping:
    """Ground, rover, and between them the link; `talk` adds heartbeats and telemetry."""

    def __init__(self, opening: Opening, light_s: float = 1.28, *, talk: bool = False) -> None:
        config = LinkConfig(
            up=OneWay(delay_s=light_s, rate_bit_s=UP_BIT_S),
            down=OneWay(delay_s=light_s, rate_bit_s=DOWN_BIT_S),
        )
        terms = LinkTerms.simulated(config, seed=1)
        self.ground = ground_endpoint(terms, Journal())
        self.rover = rover_endpoint(terms, Journal())
        self.at_ground: list[Any] = []
        self.at_rover: list[Any] = []
        self.now_ns = 0
        self._opening, self._talk = opening, talk
        self.up = Air(Direction.UP, light_s, UP_BIT_S)
        self.down = Air(Direction.DOWN, light_s, DOWN_BIT_S)

    def live(self, until_s: float, *, done: Callable[[], object] = lambda: False) -> float:
        """Go on until then, or until it is `done`; returns when that was, in seconds."""
        until_ns = to_ns(until_s)
        while self.now_ns < until_ns:
            if self._talk:
                self._chat()
            self._advance(self.ground, self.rover, self.at_ground, self.up)
            self._advance(self.rover, self.ground, self.at_rover, self.down)
            if done():
                break
            due_ns = min(self._due_ns(self.ground), self._due_ns(self.rover))
            if self._talk:
                due_ns = min(due_ns, self.now_ns + to_ns(1) - self.now_ns % to_ns(1))
            due_ns = -(-due_ns // TICK_NS) * TICK_NS
            self.now_ns = min(until_ns, max(self.now_ns + TICK_NS, due_ns))
        return to_s(self.now_ns)

    def until_heard(self, messages: list[Any], limit_s: float = 40 * MINUTE_S) -> float:
        """When the first of them was heard, or the limit, in seconds."""
        return self.live(limit_s, done=lambda: messages)

    def until_known(self, end: Endpoint[Any, Any], limit_s: float = 40 * MINUTE_S) -> float:
        """When this end knew that all that it sent has arrived, or the limit, in seconds."""
        return self.live(limit_s, done=lambda: end._sender.is_done)

    def _chat(self) -> None:
        if self.now_ns % to_ns(2) == 0:
            self.ground.send(Heartbeat(), self.now_ns)
        if self.now_ns % to_ns(1) == 0:
            self.rover.send(telemetry(self.now_ns), self.now_ns)

    def _advance(
        self, end: Endpoint[Any, Any], other: Endpoint[Any, Any], heard: list[Any], air: Air
    ) -> None:
        heard.extend(
            message
            for message, *_ in end.received(self.now_ns)
            if not isinstance(message, Heartbeat | Telemetry)
        )
        end.pump(self.now_ns)
        other.expect(air.carry(end.take_sent(), self.now_ns, self._opening))

    def _due_ns(self, end: Endpoint[Any, Any]) -> int:
        return min([end._wake_ns, *(entry[0] for entry in end._inbox[:1]), NEVER_NS])


def telemetry(time_ns: int) -> Telemetry:
    return Telemetry(
        time_ns=time_ns,
        tokens=("at:A",),
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        battery=1.0,
        mode=Mode.GUIDED,
        failsafe=Failsafe.NOMINAL,
        action=None,
        goals=(),
        commands_done=0,
    )


def command(number: int = 1) -> Command:
    return Command(number, 99, SetGoal(("at:A",), 2.0))


PERIODS_S = range(20, 65, 2)
OPENINGS_S = [1.0, 1.5, 2.0]


def openings(open_s: float, phases: int = 4) -> Iterator[Opening]:
    """All periods from 20 to 64 s, each begun at so many phases."""
    for period_s in PERIODS_S:
        for phase in range(phases):
            yield Opening(open_s, period_s, 3 + period_s * (phase + 0.5) / phases)


@pytest.mark.parametrize("open_s", OPENINGS_S)
def test_a_command_is_taken_within_20_minutes_and_known_to_be_within_40(open_s: float) -> None:
    for opening in openings(open_s):
        link = Flapping(opening)
        link.ground.send(command(), 0)
        assert link.until_heard(link.at_rover) < 20 * MINUTE_S, opening
        assert link.until_known(link.ground) < 40 * MINUTE_S
        assert link.at_rover == [command()]


@pytest.mark.parametrize("open_s", OPENINGS_S)
def test_nor_does_hearing_each_other_lock_the_retries_to_the_openings(open_s: float) -> None:
    """Telemetry comes in every opening, and what is sent upon it always arrives too late."""
    for opening in openings(open_s):
        link = Flapping(opening, talk=True)
        link.ground.send(command(), 0)
        assert link.until_heard(link.at_rover) < 30 * MINUTE_S, opening
        assert link.until_known(link.ground) < 40 * MINUTE_S
        assert link.at_rover == [command()]


@pytest.mark.parametrize("talk", [False, True])
@pytest.mark.parametrize("open_s", OPENINGS_S)
def test_an_event_of_the_rover_arrives_and_the_rover_learns_it(open_s: float, talk: bool) -> None:
    """The report on it leaves a round trip after the opening, so only its repeats can arrive."""
    event = Event(1, 0, GoalReached(("at:A",)))
    for opening in openings(open_s):
        link = Flapping(opening, talk=talk)
        link.rover.send(event, 0)
        assert link.until_heard(link.at_ground) < 20 * MINUTE_S, opening
        assert link.until_known(link.rover) < 40 * MINUTE_S
        assert link.at_ground == [event]


@pytest.mark.parametrize("open_s", OPENINGS_S)
def test_of_ten_commands_the_first_is_not_held_up_by_the_others(open_s: float) -> None:
    commands = [command(number) for number in range(1, 11)]
    for opening in openings(open_s, phases=2):
        link = Flapping(opening)
        for one in commands:
            link.ground.send(one, 0)
        assert link.until_heard(link.at_rover) < 20 * MINUTE_S, opening
        assert link.until_known(link.ground, 90 * MINUTE_S) < 90 * MINUTE_S, opening
        assert link.at_rover == commands


def test_the_probes_take_about_a_tenth_of_the_uplink() -> None:
    for count in (1, 10):
        link = Flapping(Opening(0.0, 60.0, 0.0))
        for number in range(count):
            link.ground.send(command(number), 0)
        link.live(20 * MINUTE_S)
        share = 8 * link.up.sent_byte / UP_BIT_S / (20 * MINUTE_S)
        assert 0.1 < share < 0.13, "a tenth for the segments, and what is around them"


@settings(deadline=None)
@given(
    period_s=st.floats(10, 90),
    open_s=st.floats(1, 3),
    phase=st.floats(0, 1),
    light_s=st.floats(0, 3),
    talk=st.booleans(),
)
def test_whatever_the_period_a_command_arrives_within_forty_times_the_openings_it_should_take(
    period_s: float, open_s: float, phase: float, light_s: float, talk: bool
) -> None:
    """Were the probes sent at random, one opening in `probe_s` / `open_s` would meet one.

    Then not even one command in e⁴⁰ would take as long as this. Of 22,000 drawn from these ranges,
    the slowest took 16 times what it should. What locks to the period never arrives.
    """
    probe_s = max(3.4, 2 * light_s + 1.4)  # on average: a tenth of the rate, or a round trip
    limit_s = 40 * period_s * max(1.0, probe_s / open_s)
    link = Flapping(Opening(open_s, period_s, phase * period_s), light_s, talk=talk)
    link.ground.send(command(), 0)
    assert link.until_known(link.ground, limit_s) < limit_s
    assert link.at_rover == [command()]
