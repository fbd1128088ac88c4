"""The rover as a node: world, senses, drive, pilot and endpoint, stepped together on the tick."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from numpy.random import Generator

from farside.dem import DynamicExpectancyModel
from farside.link.endpoint.endpoint import LinkTerms, StoreState, rover_endpoint
from farside.messages import Command, Failsafe, FailsafeChanged, Telemetry, Tokens
from farside.node import NS_PER_S, Frame, Journal, Step, to_ns, to_s
from farside.places import ACTIONS, BATTERY_LOW, ON_CHARGE, Cell, Chart, place_token
from farside.rover.battery import Battery
from farside.rover.condition import Condition
from farside.rover.config import RoverConfig
from farside.rover.drive import STAND, Move
from farside.rover.events import EventQueue
from farside.rover.failsafe import FailsafeLadder
from farside.rover.goals import Goals
from farside.rover.pilot import Pilot, Undertaking
from farside.rover.senses.estimate import PoseEstimate
from farside.rover.world.body import TruePose, World
from farside.topics import (
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_CYCLE,
    ROVER_ESTIMATE,
    ROVER_FAILSAFE,
    ROVER_STORE,
    TRUTH_BUMP,
    TRUTH_POSE,
    TRUTH_YARD,
    ActionEnded,
    ActionStarted,
    Bump,
    Cycle,
    Estimate,
    FailsafeEntry,
    Pose,
    StoreEntry,
    Yard,
)

_TELEMETRY_NS = NS_PER_S


class RoverStreams(NamedTuple):
    """The rover's random streams, one for each purpose."""

    soil: Generator
    sensors: Generator
    learning: Generator


class Rover:
    """The rover, stepped tick by tick; a `Node`.

    Args:
        config: the `[rover]` table.
        chart: the yard; the rover itself knows only the names of places.
        tick_ns: period of physics and decisions.
        terms: of the link, as agreed with the ground beforehand.
        streams: random streams.
    """

    def __init__(
        self,
        config: RoverConfig,
        chart: Chart,
        *,
        tick_ns: int,
        terms: LinkTerms,
        streams: RoverStreams,
    ) -> None:
        start = TruePose(*chart.centre_m(chart.places[config.start]), 0.0)
        tick_s = to_s(tick_ns)
        self._config, self._chart, self._tick_ns = config, chart, tick_ns
        self._now_ns = 0
        self._journal = Journal()
        self._events = EventQueue(self._journal)
        self._endpoint = rover_endpoint(terms, self._journal)
        self._world = World(chart, config.body, start, tick_s, streams.soil)
        self._estimate = PoseEstimate(start, config.sensors, tick_s, streams.sensors)
        self._battery = Battery(config.battery)
        self._condition = Condition(self._battery, self._journal, self._events)
        self._failsafe = FailsafeLadder(config.failsafe, terms.light_time_ns)
        self._model = DynamicExpectancyModel(
            dict.fromkeys(ACTIONS, config.drive.move_cost_s), config.dem, rng=streams.learning
        )
        mission: dict[Tokens, float] = {
            (place_token(goal.place),): goal.priority for goal in config.goals
        }
        goals = Goals(self._model, mission, self._journal, self._events)
        self._pilot = Pilot(self._model, goals, self._battery, self._journal, self._events)
        self._unheard: deque[Telemetry] = deque()
        self._house_at_ns = 0
        self._report_at_ns = self._reported_ns = 0
        self._store_state = StoreState(0, 0, 0)
        self._move: Move | None = None
        self._doing: Undertaking | None = None
        self._began_ns = 0
        self._commands_taken = 0
        self._tokens: frozenset[str] = frozenset()
        self._stirred = True

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Live tick by tick up to `until_ns`; see `farside.node.Node`."""
        self._endpoint.expect(arrivals)
        if self._now_ns == 0 and until_ns > 0:
            self._begin()
        while self._now_ns < until_ns:
            self._tick()
            for event in self._events.take():
                self._endpoint.send(event, self._now_ns)
            if self._failsafe.state is Failsafe.NOMINAL:
                self._endpoint.forward(self._now_ns)
            self._endpoint.pump(self._now_ns)
            self._now_ns += self._tick_ns
        return Step(self._endpoint.take_sent(), self._journal.take())

    def _begin(self) -> None:
        self._journal.note(TRUTH_YARD, Yard(self._chart.rows, self._chart.cell_m))
        self._journal.note(ROVER_FAILSAFE, FailsafeEntry(self._failsafe.state, 0.0))
        self._condition.begin()
        self._cycle()

    def _tick(self) -> None:
        now_ns = self._journal.now_ns = self._now_ns
        self._endpoint.in_shadow = self._world.in_shadow
        self._listen()
        if self._failsafe.update(now_ns):
            self._tell_failsafe()
        if self._move is not None:
            self._drive(self._move)
        if self._stirred and self._move is None:
            self._stirred = False
            self._decide()
        if now_ns >= self._house_at_ns:
            self._keep_house()
        if now_ns >= self._report_at_ns:
            self._report()

    # --- the link ----------------------------------------------------------------------------

    def _listen(self) -> None:
        for message in self._endpoint.received(self._now_ns):
            self._stirred = True
            if isinstance(message, Command):
                self._commands_taken = message.number
                self._pilot.take(message)
        if self._endpoint.heard_ns is not None:
            self._failsafe.heard(self._endpoint.heard_ns)

    def _tell_failsafe(self) -> None:
        state, silence_ns = self._failsafe.state, self._failsafe.silence_ns(self._now_ns)
        self._journal.note(ROVER_FAILSAFE, FailsafeEntry(state, to_s(silence_ns)))
        self._events.tell(FailsafeChanged(state, silence_ns))
        self._pilot.failsafe(state)
        self._stirred = True

    def _keep_house(self) -> None:
        self._house_at_ns = self._now_ns + _TELEMETRY_NS
        self._flow()
        self._condition.follow_battery()
        self._pilot.feel()
        truth = self._world.pose
        self._journal.note(
            TRUTH_POSE,
            Pose(
                truth.x_m,
                truth.y_m,
                truth.heading_rad,
                self._world.speed_m_s,
                self._chart.tokens[self._chart.cell_at(truth.x_m, truth.y_m)],
                self._battery.charge,
            ),
        )
        own = self._estimate
        self._journal.note(ROVER_ESTIMATE, Estimate(own.x_m, own.y_m, own.heading_rad))
        self._stirred = True
        self._note_store()

    def _note_store(self) -> None:
        state = self._endpoint.store_state
        if state != self._store_state:
            self._store_state = state
            self._journal.note(ROVER_STORE, StoreEntry(*state))

    def _report(self) -> None:
        own = self._estimate
        telemetry = Telemetry(
            time_ns=self._now_ns,
            tokens=tuple(sorted(self._tokens)),
            x_m=own.x_m,
            y_m=own.y_m,
            heading_rad=own.heading_rad,
            battery=self._battery.charge,
            mode=self._pilot.mode,
            failsafe=self._failsafe.state,
            action=self._doing.action if self._doing else None,
            goals=self._pilot.goals,
            commands_done=self._commands_done,
        )
        self._endpoint.send(telemetry, self._now_ns)
        self._keep(telemetry)
        self._reported_ns = self._now_ns
        self._report_by(self._now_ns + _TELEMETRY_NS)

    def _report_by(self, wanted_ns: int) -> None:
        """Send telemetry at `wanted_ns`, or as soon after it as the rate allows.

        What is only stored waits for no rate.
        """
        is_heard = self._failsafe.state is Failsafe.NOMINAL
        interval_ns = self._endpoint.telemetry_interval_ns(self._now_ns) if is_heard else 0
        self._report_at_ns = max(wanted_ns, self._reported_ns + interval_ns)

    def _keep(self, telemetry: Telemetry) -> None:
        """Store telemetry that the ground may have missed, to be forwarded when the link is back.

        An outage is noticed only some time after it began, so what was sent since the last frame
        from the ground is stored as well.
        """
        self._unheard.append(telemetry)
        if self._failsafe.state is Failsafe.NOMINAL:
            while self._unheard and self._unheard[0].time_ns < self._failsafe.heard_ns:
                self._unheard.popleft()
            return
        while self._unheard:
            kept = self._unheard.popleft()
            self._endpoint.store(kept, kept.time_ns)

    @property
    def _commands_done(self) -> int:
        waiting = self._doing.command if self._doing else self._pilot.waiting_command
        return self._commands_taken if waiting is None else waiting - 1

    # --- sensing -----------------------------------------------------------------------------

    def _sense(self) -> frozenset[str]:
        tokens = {self._chart.tokens[self._believed_cell]}
        if self._believed_cell == self._dock:
            tokens.add(ON_CHARGE)
        if self._battery.low:
            tokens.add(BATTERY_LOW)
        return frozenset(tokens)

    @property
    def _believed_cell(self) -> Cell:
        return self._chart.cell_at(self._estimate.x_m, self._estimate.y_m)

    @property
    def _dock(self) -> Cell | None:
        return self._chart.dock

    def _flow(self) -> None:
        x_m, y_m, _ = self._world.pose
        docked = self._chart.cell_at(x_m, y_m) == self._dock
        self._battery.flow(self._now_ns, driving=self._move is not None, docked=docked)

    def _notice(self) -> None:
        """Begin a new cycle if the Tokens changed, or satisfy a new goal, while standing still."""
        met = any(self._tokens.issuperset(goal) for goal in self._pilot.goals)
        if met or self._sense() != self._tokens:
            self._model.perform(None)
            self._cycle()

    def _cycle(self) -> None:
        self._tokens = self._sense()
        sensed = self._pilot.sense(self._tokens)
        self._stirred = True
        self._journal.note(
            ROVER_CYCLE,
            Cycle(
                tokens=sensed.tokens,
                novel=sensed.novel,
                unexpected=sensed.unexpected,
                succeeded=sensed.succeeded,
                failed=sensed.failed,
                created=sensed.created,
                signs=self._model.sign_count,
                hypotheses=self._model.hypothesis_count,
                mean_cm=self._model.mean_cm,
            ),
        )

    # --- acting ------------------------------------------------------------------------------

    def _decide(self) -> None:
        self._notice()
        undertaking = self._pilot.next()
        if undertaking is not None:
            self._undertake(undertaking)
            return
        proposal = self._pilot.propose()
        if proposal is not None:
            self._endpoint.send(proposal, self._now_ns)

    def _undertake(self, undertaking: Undertaking) -> None:
        self._flow()
        home = self._believed_cell
        self._move = Move(
            self._chart.centre_m(home),
            self._chart.centre_m(home.beside(undertaking.action)),
            self._config.drive,
            self._config.body,
            to_s(self._tick_ns),
        )
        self._doing, self._began_ns = undertaking, self._now_ns
        self._journal.note(
            ROVER_ACTION_STARTED,
            ActionStarted(
                undertaking.action, undertaking.chooser, undertaking.command, undertaking.goal
            ),
        )

    def _drive(self, move: Move) -> None:
        if self._now_ns - self._began_ns > to_ns(self._config.drive.give_up_s):
            move.abandon()
        before = self._world.pose
        command = STAND if self._battery.empty else move.command(self._estimate)
        bump_m_s = self._world.step(command.speed_m_s, command.yaw_rad_s)
        after = self._world.pose
        self._estimate.update(after, command.speed_m_s, after.heading_rad - before.heading_rad)
        if bump_m_s is not None:
            move.bumped()
            self._journal.note(TRUTH_BUMP, Bump(after.x_m, after.y_m, bump_m_s))
        if move.stopping and self._world.at_rest:
            self._finish(move)

    def _finish(self, move: Move) -> None:
        assert self._doing is not None  # noqa: S101 - a move is always somebody's undertaking
        self._flow()
        duration_s = to_s(self._now_ns - self._began_ns)
        self._journal.note(
            ROVER_ACTION_ENDED, ActionEnded(self._doing.action, duration_s, move.blocked)
        )
        self._condition.moved(self._doing.action, blocked=move.blocked)
        # Path A3: the DEM learns from what was performed, no matter who chose it.
        self._model.perform(self._doing.action)
        self._move = self._doing = None
        self._cycle()
        self._house_at_ns = self._now_ns
        self._report_by(self._now_ns)
