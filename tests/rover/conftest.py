"""A rover on a bench: no link, no ground, orders handed over and telemetry read."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar, cast

import msgspec
import numpy as np
import pytest
from numpy.random import Generator

from farside.control import CommandStage
from farside.dem import DynamicExpectancyModel
from farside.link import LinkConfig, LinkTerms, OneWay, ground_endpoint
from farside.logs import LogEntry
from farside.messages import (
    Command,
    CommandReached,
    Drive,
    Event,
    Heartbeat,
    Meant,
    Order,
    Proposal,
    Shown,
    Telemetry,
    Uplink,
    When,
)
from farside.node import Frame, Journal, Topic, to_ns, to_s
from farside.places import ACTIONS, Chart
from farside.rover import Rover, RoverConfig, RoverStreams
from farside.topics import ROVER_COMMAND, CommandEntry

Entry = TypeVar("Entry", bound=msgspec.Struct)
Happened = TypeVar("Happened", bound=msgspec.Struct)

TICK_NS = to_ns(0.04)
TERMS = LinkTerms.simulated(LinkConfig(up=OneWay(delay_s=0.0), down=OneWay(delay_s=0.0)), seed=1)

YARD = (
    "########",
    "#A....B#",
    "#.####.#",
    "#D.o..C#",
    "########",
)


def model(config: RoverConfig, rng: Generator) -> DynamicExpectancyModel:
    """The controller on the bench: the model that missions have."""
    costs = dict.fromkeys(ACTIONS, config.drive.move_cost_s)
    return DynamicExpectancyModel(costs, config.dem, rng=rng)


class Bench:
    """Drives a rover node by itself, with a ground that is heard whenever `link_up`."""

    def __init__(self, config: RoverConfig, rows: tuple[str, ...] = YARD, seed: int = 1) -> None:
        self.chart = Chart(rows, 1.0)
        soil, sensors, learning = (np.random.default_rng([seed, n]) for n in range(3))
        self.rover = Rover(
            config,
            self.chart,
            tick_ns=TICK_NS,
            terms=TERMS,
            controller=model,
            streams=RoverStreams(soil, sensors, learning),
        )
        self.link_up = True
        self.given_but_not_arrived = 0  # commands that heartbeats tell of
        self.now_ns = 0
        self.entries: list[LogEntry] = []
        self.telemetry: Telemetry | None = None
        self.proposals: list[Proposal] = []
        self.events: list[Event] = []
        self.frames: list[Frame] = []
        self._ground = ground_endpoint(TERMS, Journal())
        self._commands = 0
        self.run(TICK_NS)

    def order(
        self,
        order: Order,
        *,
        expires_s: float = 1e6,
        meant: Meant | None = None,
        when: When | None = None,
    ) -> int:
        """Send a command; it arrives with the next tick."""
        self._commands += 1
        command = Command(self._commands, to_ns(expires_s), order, meant, when)
        self._ground.send(command, self.now_ns)
        return self._commands

    def say(self, word: Uplink) -> None:
        """Send anything; it arrives with the next tick."""
        self._ground.send(word, self.now_ns)

    def show(self, proposal: int) -> None:
        """Say that the operator was shown a proposal."""
        self.say(Shown(proposal))

    def end_of(self, number: int) -> CommandEntry:
        """The last stage of a command."""
        return [entry for entry in self.of(ROVER_COMMAND) if entry.number == number][-1]

    def told(self, kind: type[Happened]) -> list[Happened]:
        """What the rover has told of this kind."""
        return [event.what for event in self.events if isinstance(event.what, kind)]

    @property
    def not_done(self) -> list[CommandReached]:
        """What the rover has told of commands that ended without being done."""
        ends = [one for one in self.told(CommandReached) if one.stage.is_last]
        return [one for one in ends if one.stage is not CommandStage.DONE]

    def run(self, time_ns: int) -> None:
        """Live on for a while."""
        until_ns = self.now_ns + time_ns
        while self.now_ns < until_ns:
            if self.link_up and self.now_ns % to_ns(2) == 0:
                self._ground.send(self._heartbeat(), self.now_ns)
            self.now_ns += TICK_NS
            self._ground.pump(self.now_ns)
            sent = self._ground.take_sent()
            frames, records = self.rover.advance(self.now_ns, sent if self.link_up else [])
            self._read(frames)
            self.entries += map(LogEntry.of, records)

    def _heartbeat(self) -> Heartbeat:
        given = self._commands + self.given_but_not_arrived
        return Heartbeat(given, self.telemetry.time_ns if self.telemetry else -1)

    def run_s(self, time_s: float) -> None:
        """Live on for so many seconds."""
        self.run(to_ns(time_s))

    def until(self, happened: Callable[[], object], within_s: float = 120.0) -> float:
        """Live on until something has happened; the time when it had."""
        deadline_ns = self.now_ns + to_ns(within_s)
        while not happened():
            assert self.now_ns < deadline_ns, f"nothing of the kind within {within_s} s"
            self.run(TICK_NS)
        return to_s(self.now_ns)

    def do(self, actions: str, *, force: bool = False) -> None:
        """Command moves and wait until they are done."""
        for action in actions:
            number = self.order(Drive(action, force))
            self.until(partial(self._has_done, number))

    def _has_done(self, number: int) -> bool:
        return self.telemetry.commands_done >= number

    def of(self, topic: Topic[Entry]) -> list[Entry]:
        """All entries of a topic."""
        return [cast("Entry", one.message) for one in self.entries if one.topic == topic.name]

    def _read(self, frames: Sequence[Frame]) -> None:
        self.frames += frames
        self._ground.expect(frames)
        for message, *_ in self._ground.received(self.now_ns):
            match message:
                case Telemetry():
                    self.telemetry = message
                case Event():
                    self.events.append(message)
                case Proposal():
                    self.proposals.append(message)


@pytest.fixture
def bench() -> Callable[..., Bench]:
    """Makes a bench: `bench(start="D", ...)`, with the keys of the `[rover]` table."""

    def make(rows: tuple[str, ...] = YARD, seed: int = 1, **config: Any) -> Bench:
        return Bench(msgspec.convert({"start": "D", **config}, RoverConfig), rows, seed)

    return make
