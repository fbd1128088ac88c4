"""The rover as a node: world, senses, drive, pilot and endpoint, stepped together on the tick."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from numpy.random import Generator

from farside.control import OnLoss, Signal
from farside.link.endpoint.endpoint import LinkTerms, rover_endpoint
from farside.messages import Command, Heartbeat, Shown, Telemetry, Tokens
from farside.node import NS_PER_S, Frame, Journal, Step, to_ns, to_s
from farside.places import (
    BATTERY_LOW,
    LINK_UP,
    ON_CHARGE,
    Cell,
    Chart,
    is_place_token,
    place_token,
)
from farside.rover.battery import Battery
from farside.rover.commands import Commands
from farside.rover.condition import Condition
from farside.rover.config import RoverConfig
from farside.rover.control.authority import Conditions, Parts
from farside.rover.control.cycle import ControlCycle
from farside.rover.control.model_updates import ModelUpdates
from farside.rover.control.proposals import Proposals
from farside.rover.controller import Controller, change_aversions
from farside.rover.drive import STAND, Move
from farside.rover.events import EventQueue
from farside.rover.failsafe.gate import SafetyGate
from farside.rover.failsafe.silence import Silence
from farside.rover.failsafe.track import Track
from farside.rover.failsafe.watch import FailsafeWatch
from farside.rover.goals import Goals
from farside.rover.pilot import Pilot, Undertaking
from farside.rover.senses.estimate import PoseEstimate
from farside.rover.senses.radio import Radio
from farside.rover.telemetry import Reporting
from farside.rover.world.body import TruePose, World
from farside.rover.world.faults import Faults
from farside.topics import (
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_ESTIMATE,
    TRUTH_BUMP,
    TRUTH_POSE,
    TRUTH_YARD,
    ActionEnded,
    ActionStarted,
    Bump,
    Estimate,
    Pose,
    Yard,
)

_HOUSEKEEPING_NS = NS_PER_S


class RoverStreams(NamedTuple):
    """The rover's random streams, one for each purpose."""

    soil: Generator
    sensors: Generator
    learning: Generator


ControllerMaker = Callable[[RoverConfig, Generator], Controller]
"""Makes the controller on board, from the `[rover]` table and a random stream of its own."""


class _Doing(NamedTuple):
    """The action under way."""

    undertaking: Undertaking
    move: Move
    began_ns: int
    start: frozenset[str]


class Rover:
    """The rover, stepped tick by tick; a `Node`.

    Args:
        config: the `[rover]` table.
        chart: the yard; the rover itself knows only the names of places.
        tick_ns: period of physics and decisions.
        terms: of the link, as agreed with the ground beforehand.
        streams: random streams.
        controller: makes the controller on board.

    Attributes:
        config: the `[rover]` table in force.
        controller: the controller on board, which learns from everything that is done.
        pilot: decides who drives, and what to begin next.
        parts: what the pilot works with: goals, commands, proposals, silence, failsafe, battery.
        world, estimate: where the rover is, and where it believes to be.
        faults: what goes wrong with it.
    """

    def __init__(
        self,
        config: RoverConfig,
        chart: Chart,
        *,
        tick_ns: int,
        terms: LinkTerms,
        streams: RoverStreams,
        controller: ControllerMaker,
    ) -> None:
        start = TruePose(*chart.centre_m(chart.places[config.start]), 0.0)
        tick_s = to_s(tick_ns)
        self.config, self._chart, self._tick_ns = config, chart, tick_ns
        self._now_ns = self._house_at_ns = 0
        self._journal = journal = Journal()
        self._events = events = EventQueue(journal)
        self._endpoint = rover_endpoint(terms, journal)
        self.world = World(chart, config.body, start, tick_s, streams.soil)
        self.faults = Faults(config.faults)
        self._radio = Radio(chart) if chart.shadow else None
        self.estimate = PoseEstimate(start, config.sensors, tick_s, streams.sensors)
        self._battery = Battery(config.battery)
        self._condition = Condition(self._battery, journal, events)
        self._silence = Silence(config.failsafe, terms)
        self._reporting = Reporting(self._endpoint, terms, self._silence, journal)
        self.controller = brain = controller(config, streams.learning)
        change_aversions(brain, {}, config.aversions)
        mission: dict[Tokens, float] = {
            (place_token(goal.place),): goal.priority for goal in config.goals
        }
        self._goals = Goals(brain, mission, journal, events)
        self._cycle = ControlCycle(
            brain, self._goals, journal, is_shadowed=config.is_shadowed, memory=config.memory
        )
        self._updates = ModelUpdates(self._cycle, self._endpoint, terms, self._silence, journal)
        self._commands = Commands(terms.round_trip_ns, journal, events)
        self._proposals = Proposals(
            config.consent, terms.round_trip_ns, self._silence.grace_ns, journal
        )
        self._watch = FailsafeWatch(self._silence, journal, events)
        self._to_signal, self._to_dock = Track(), Track()
        self._gate = SafetyGate(
            brain, self._to_dock, self._battery, config.drive, config.battery.reserve
        )
        self.parts = Parts(
            cycle=self._cycle,
            goals=self._goals,
            commands=self._commands,
            proposals=self._proposals,
            silence=self._silence,
            watch=self._watch,
            gate=self._gate,
            tracks={(LINK_UP,): self._to_signal, (ON_CHARGE,): self._to_dock},
            battery=self._battery,
            journal=journal,
            events=events,
        )
        self.pilot = Pilot(self.parts, config.failsafe, has_dock=chart.dock is not None)
        self._doing: _Doing | None = None
        self._stands_since_ns = 0
        self._least_move_ns = to_ns(config.drive.least_move_s(chart.cell_m))
        # What to begin is asked only after something has changed, and once a second.
        self._stirred = True

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Live tick by tick up to `until_ns`; see `farside.node.Node`."""
        self._endpoint.expect(arrivals)
        if self._now_ns == 0 and until_ns > 0:
            self._begin()
        while self._now_ns < until_ns:
            self._tick()
            self._commands.tell_taken()
            for event in self._events.take():
                self._endpoint.send(event, self._now_ns)
            self._updates.look(self._now_ns)
            self._reporting.forward(self._now_ns)
            self._endpoint.pump(self._now_ns)
            self._now_ns += self._tick_ns
        return Step(self._endpoint.take_sent(), self._journal.take())

    def _begin(self) -> None:
        self._journal.note(TRUTH_YARD, Yard(self._chart.rows, self._chart.cell_m))
        self._watch.begin()
        self._condition.begin()
        self._cycle.sense(self._sensed())
        self._follow_tracks(None)

    def _tick(self) -> None:
        now_ns = self._journal.now_ns = self._now_ns
        self._endpoint.in_shadow = self.world.in_shadow
        self._listen()
        if self._doing is not None:
            self._drive(self._doing)
        conditions = self._conditions()
        if self.pilot.look(conditions, now_ns):
            self._stirred = True
        if conditions.tilted and self._doing is not None:
            self._doing.move.abandon()
        if self._stirred and self._doing is None:
            self._stirred = False
            self._decide()
        if now_ns >= self._house_at_ns:
            self._keep_house()
        if self._reporting.is_due(now_ns):
            self._reporting.report(self._telemetry())

    # --- the link ------------------------------------------------------------------------------

    def _listen(self) -> None:
        for arrival in self._endpoint.received(self._now_ns):
            self._stirred = True
            match message := arrival.message:
                case Command():
                    self.pilot.orders.take(message, self._now_ns)
                case Heartbeat():
                    self.pilot.orders.heartbeat(message, self._now_ns)
                    self._reporting.acknowledged(message, self._now_ns)
                    self._updates.heard(message.model)
                case Shown():
                    self.pilot.orders.shown(message.proposal, self._now_ns)
        if self._endpoint.heard_ns is not None:
            self._silence.heard(self._endpoint.heard_ns)

    def _telemetry(self) -> Telemetry:
        own, authority = self.estimate, self.pilot.authority
        standing = self._proposals.standing
        alone = authority.on_loss is OnLoss.AUTONOMY
        return Telemetry(
            time_ns=self._now_ns,
            tokens=tuple(sorted(self._cycle.tokens)),
            x_m=own.x_m,
            y_m=own.y_m,
            heading_rad=own.heading_rad,
            battery=self._battery.charge,
            mode=authority.mode,
            failsafe=self._watch.state,
            action=self._doing.undertaking.action if self._doing else None,
            goals=self._goals.listed,
            commands_done=self._commands.done_up_to,
            begun=self._commands.begun_number,
            waiting=self._commands.waiting,
            proposal=None if standing is None else standing.number,
            signal=self._signal,
            on_loss=authority.on_loss,
            alone_goals=self._goals.for_alone if alone else (),
            since_ns=self._doing.began_ns if self._doing else self._stands_since_ns,
            tilt_rad=self.faults.tilt_rad(self._now_ns) or None,
        )

    def _keep_house(self) -> None:
        self._house_at_ns = self._now_ns + _HOUSEKEEPING_NS
        self._flow()
        self._gate.look()
        self._condition.follow_battery()
        truth = self.world.pose
        self._journal.note(
            TRUTH_POSE,
            Pose(
                truth.x_m,
                truth.y_m,
                truth.heading_rad,
                self.world.speed_m_s,
                self._chart.tokens[self._true_cell],
                self._battery.charge,
            ),
        )
        own = self.estimate
        self._journal.note(ROVER_ESTIMATE, Estimate(own.x_m, own.y_m, own.heading_rad))
        self._stirred = True
        self._reporting.note_store()

    # --- sensing -------------------------------------------------------------------------------

    def _sensed(self) -> frozenset[str]:
        tokens: set[str] = set()
        if self.faults.has_position(self._now_ns):
            tokens.add(self._chart.tokens[self._believed_cell])
            if self._believed_cell == self._chart.dock:
                tokens.add(ON_CHARGE)
        if self._battery.low:
            tokens.add(BATTERY_LOW)
        if self._radio is not None and self._has_signal:
            tokens.add(LINK_UP)
        return frozenset(tokens)

    def _conditions(self) -> Conditions:
        return Conditions(
            place=self._place,
            signal=self._signal,
            stuck=self._condition.stuck,
            tilted=self.faults.tilt_rad(self._now_ns) >= self.config.failsafe.tilt_limit_rad,
        )

    def _follow_tracks(self, move: str | None) -> None:
        tokens = self._cycle.tokens
        place = next(filter(is_place_token, sorted(tokens)), None)
        if place is None:
            self._to_signal.lose()
            self._to_dock.lose()
            return
        self._to_signal.at(place, is_end=self._has_signal, move=move)
        self._to_dock.at(place, is_end=ON_CHARGE in tokens, move=move)

    @property
    def _place(self) -> str | None:
        if not self.faults.has_position(self._now_ns):
            return None
        return self._chart.tokens[self._believed_cell]

    @property
    def _signal(self) -> Signal:
        return Signal.STRONG if self._radio is None else self._radio.signal(self._true_cell)

    @property
    def _has_signal(self) -> bool:
        return self._signal is not Signal.NONE

    @property
    def _believed_cell(self) -> Cell:
        return self._chart.cell_at(self.estimate.x_m, self.estimate.y_m)

    @property
    def _true_cell(self) -> Cell:
        x_m, y_m, _ = self.world.pose
        return self._chart.cell_at(x_m, y_m)

    def _flow(self) -> None:
        self._battery.flow(
            self._now_ns,
            driving=self._doing is not None,
            docked=self._true_cell == self._chart.dock,
        )

    # --- acting --------------------------------------------------------------------------------

    def _decide(self) -> None:
        self._cycle.follow(self._sensed())
        undertaking = self.pilot.next()
        if undertaking is not None:
            self._undertake(undertaking)
            return
        proposal = self.pilot.propose()
        if proposal is not None:
            self._endpoint.send(proposal, self._now_ns)

    def _undertake(self, undertaking: Undertaking) -> None:
        self._flow()
        home = self._believed_cell
        move = Move(
            self._chart.centre_m(home),
            self._chart.centre_m(home.beside(undertaking.action)),
            self.config.drive,
            self.config.body,
            to_s(self._tick_ns),
        )
        self._doing = _Doing(undertaking, move, self._now_ns, self._cycle.tokens)
        # Path A3: the controller learns from what is performed, no matter who chose it.
        self._cycle.perform(undertaking.action)
        self._journal.note(
            ROVER_ACTION_STARTED,
            ActionStarted(
                undertaking.action, undertaking.chooser, undertaking.command, undertaking.goal
            ),
        )

    def _drive(self, doing: _Doing) -> None:
        move = doing.move
        if self._now_ns - doing.began_ns > to_ns(self.config.drive.give_up_s):
            move.abandon()
        before = self.world.pose
        command = STAND if self._battery.empty else move.command(self.estimate)
        bump_m_s = self.world.step(command.speed_m_s, command.yaw_rad_s)
        after = self.world.pose
        turned_rad = after.heading_rad - before.heading_rad
        fixes = self.faults.has_position(self._now_ns)
        self.estimate.update(after, command.speed_m_s, turned_rad, fixes=fixes)
        if bump_m_s is not None:
            move.bumped()
            self._journal.note(TRUTH_BUMP, Bump(after.x_m, after.y_m, bump_m_s))
        over = move.stopping and self.world.at_rest
        # Where a fix has it arrive sooner than the ground may count on, it stands until then.
        if over and (move.blocked or self._now_ns - doing.began_ns >= self._least_move_ns):
            self._finish(doing)

    def _finish(self, doing: _Doing) -> None:
        self._flow()
        action, blocked = doing.undertaking.action, doing.move.blocked
        duration_s = to_s(self._now_ns - doing.began_ns)
        self._journal.note(ROVER_ACTION_ENDED, ActionEnded(action, duration_s, blocked))
        self._condition.moved(action, blocked=blocked)
        self._doing = None
        self._stands_since_ns = self._now_ns
        self._cycle.sense(self._sensed())
        self._follow_tracks(action)
        self.pilot.ended(action, doing.start, duration_s, blocked=blocked)
        self._gate.look()
        self._stirred = True
        self._house_at_ns = self._now_ns
        self._reporting.soon(self._now_ns)
