"""A model on board, its shadow at the ground, and a real link between them; no wheels."""

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np
from restless import COSTS, PARAMETERS, lists

from farside.dem import DynamicExpectancyModel, ShadowModel
from farside.ground.shadow import Shadow
from farside.link import LinkConfig, LinkTerms, ground_endpoint, rover_endpoint
from farside.link.channel.node import Channel
from farside.messages import Heartbeat, ModelUpdate, Telemetry
from farside.node import Direction, Frame, Journal, Record, to_ns
from farside.rover.config import FailsafeConfig
from farside.rover.control.cycle import ControlCycle
from farside.rover.control.model_updates import ModelUpdates
from farside.rover.events import EventQueue
from farside.rover.failsafe.silence import Silence
from farside.rover.goals import Goals
from farside.rover.telemetry import Reporting
from farside.topics import ROVER_MODEL, GoalSource, ModelSent
from tests.dem.conftest import Event
from tests.ground.conftest import telemetry

TICK_NS = to_ns(0.2)


class Shadowing:
    """Both ends, stepped together in windows of some ticks.

    Attributes:
        model, shadow: on board, and at the ground.
        now_ns: time reached.
        held: what the model held when each update was made, by the number of the update.
        sent: the updates.
        late: the telemetry that arrived, with the time.
    """

    def __init__(self, config: LinkConfig, *, seed: int = 1, window_ticks: int = 1) -> None:
        terms = LinkTerms.simulated(config, seed)
        self.model = DynamicExpectancyModel(COSTS, PARAMETERS, rng=np.random.default_rng(seed))
        self._on_board, self._at_ground = Journal(), Journal()
        self.rover = rover_endpoint(terms, self._on_board)
        self.ground = ground_endpoint(terms, self._at_ground)
        self.goals = Goals(self.model, {}, self._on_board, EventQueue(self._on_board))
        self.cycle = ControlCycle(self.model, self.goals, self._on_board, is_shadowed=True)
        self.silence = Silence(FailsafeConfig(), terms)
        self._reporting = Reporting(self.rover, terms, self.silence, self._on_board)
        self.updates = ModelUpdates(self.cycle, self.rover, terms, self.silence, self._on_board)
        self.shadow = Shadow(ShadowModel(COSTS, PARAMETERS), self._at_ground)
        rngs = {way: np.random.default_rng(seed + n) for n, way in enumerate(Direction)}
        self._channel = Channel(config, rngs)
        self._window_ticks = window_ticks
        self.now_ns = 0
        self.held: OrderedDict[int, tuple[object, ...]] = OrderedDict()
        self.sent: list[ModelSent] = []
        self.records: list[Record] = []
        self.arrived: list[tuple[int, Telemetry]] = []
        self._telemetry_ns = -1

    def live(self, time_s: float, stream: Sequence[Event] = (), every_s: float = 1.0) -> None:
        """Go on for so long, with a cycle of `stream` every so often while there is one left."""
        pending, cycle_at_ns = list(stream), self.now_ns
        end_ns = self.now_ns + to_ns(time_s)
        while self.now_ns < end_ns:
            frames: list[Frame] = []
            began_ns = self.now_ns
            for _ in range(self._window_ticks):
                if pending and self.now_ns >= cycle_at_ns:
                    cycle_at_ns += to_ns(every_s)
                    self._sense(pending.pop(0))
                self._tick_rover()
                self.now_ns += TICK_NS
            frames += self.rover.take_sent()
            end_of_window_ns, self.now_ns = self.now_ns, began_ns
            while self.now_ns < end_of_window_ns:
                self._tick_ground()
                self.now_ns += TICK_NS
            frames += self.ground.take_sent()
            for frame in self._channel.advance(self.now_ns, frames).frames:
                end = self.rover if frame.direction is Direction.UP else self.ground
                end.expect([frame])

    def _sense(self, event: Event) -> None:
        tokens, action, change = event
        if action in COSTS and self.cycle.number:
            self.cycle.perform(action)
        self.cycle.sense(frozenset(tokens))
        match change:
            case "set", sign, priority:
                self.goals.want(tuple(sign), priority, GoalSource.OPERATOR)
            case "withdraw", sign, _:
                self.goals.withdraw(tuple(sign))

    def _tick_rover(self) -> None:
        now_ns = self._on_board.now_ns = self.now_ns
        for arrival in self.rover.received(now_ns):
            if isinstance(arrival.message, Heartbeat):
                self._reporting.acknowledged(arrival.message, now_ns)
                self.updates.heard(arrival.message.model)
        if self.rover.heard_ns is not None:
            self.silence.heard(self.rover.heard_ns)
        self.silence.look(now_ns)
        if self._reporting.is_due(now_ns):
            self._reporting.report(telemetry(now_ns / 1e9))
        self.updates.look(now_ns)
        self._reporting.forward(now_ns)
        self.rover.pump(now_ns)
        for record in self._on_board.take():
            self.records.append(record)
            if record.topic == ROVER_MODEL.name:
                self.sent.append(ROVER_MODEL.decode(record.payload))
                self.held[self.sent[-1].number] = lists(self.model)

    def _tick_ground(self) -> None:
        now_ns = self._at_ground.now_ns = self.now_ns
        for arrival in self.ground.received(now_ns):
            match arrival.message:
                case ModelUpdate():
                    self.shadow.apply(arrival.message)
                case Telemetry():
                    self._telemetry_ns = max(self._telemetry_ns, arrival.message.time_ns)
                    self.arrived.append((now_ns, arrival.message))
        if now_ns % to_ns(2.0) == 0:
            told = Heartbeat(0, self._telemetry_ns, 0, self.shadow.held())
            self.ground.send(told, now_ns)
        self.ground.pump(now_ns)
        self.records += self._at_ground.take()

    @property
    def is_caught_up(self) -> bool:
        """Whether the ground holds what the rover holds, to the last bit."""
        return self.shadow.in_step and lists(self.shadow.model) == lists(self.model)

    def catch_up(self, within_s: float) -> bool:
        """Go on until the shadow has caught up; false if that takes longer."""
        end_ns = self.now_ns + to_ns(within_s)
        while not self.is_caught_up and self.now_ns < end_ns:
            self.live(5.0)
        return self.is_caught_up
