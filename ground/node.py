"""The ground station as a node: its belief, its operator and its endpoint, stepped together."""

from collections.abc import Sequence

from farside.acts import Act, Planned
from farside.dem import ShadowModel
from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.ground.config import GroundConfig
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.moves import MoveTimes
from farside.ground.operators.operator import Operator, Situation
from farside.ground.operators.queued import QueuedOperator, as_logged
from farside.ground.operators.scripted import ScriptedOperator
from farside.ground.outlook import Outlook, RoverTerms
from farside.ground.shadow import Shadow
from farside.ground.view.knowledge import Sources
from farside.ground.view.looking import look
from farside.ground.view.memory import Memory
from farside.ground.view.view import Focus, GroundView
from farside.link.endpoint.endpoint import LinkTerms, ground_endpoint
from farside.messages import (
    Approve,
    CommandReached,
    Drive,
    Event,
    Heartbeat,
    ModelUpdate,
    Order,
    Override,
    Proposal,
    Shown,
    Telemetry,
    Veto,
)
from farside.node import Frame, Journal, Step, to_ns
from farside.places import Chart
from farside.topics import (
    GROUND_CHART,
    GROUND_EVENT,
    GROUND_OPERATOR,
    GROUND_ORDER,
    GROUND_PREDICTION,
    GROUND_PROPOSAL,
    GROUND_REVIEW,
    GROUND_SILENCE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    Answer,
    EventLearned,
    OrderGiven,
    Review,
    Silence,
    Yard,
)

_AGE_SHARE = 8  # a prediction is noted again when what it is made from is so much older


class Ground:
    """The ground station, stepped tick by tick; a `Node`.

    Args:
        config: the `[ground]` table.
        operator: who decides.
        tick_ns: period of decisions.
        terms: of the link, as agreed with the rover beforehand.
        rover: what is known of the rover beforehand.
        chart: the yard, as the ground has it.
        shadow: for the lists of the model on board, empty; `None` where they are not sent.

    Attributes:
        operator: who decides.
        shadow: what is held of the model on board; `None` where it is not sent.
    """

    def __init__(
        self,
        config: GroundConfig,
        operator: Operator,
        *,
        tick_ns: int,
        terms: LinkTerms,
        rover: RoverTerms,
        chart: Chart,
        shadow: ShadowModel | None = None,
    ) -> None:
        self._tick_ns = tick_ns
        self._now_ns = 0
        self._config = config
        self._round_trip_ns = terms.round_trip_ns
        self.operator = operator
        self._journal = Journal()
        self._endpoint = ground_endpoint(terms, self._journal)
        self.shadow = None if shadow is None else Shadow(shadow, self._journal)
        plan = DownlinkPlan(terms)
        self._plan = plan
        self._belief = Belief(plan, self._journal)
        times = MoveTimes(rover.moves)
        self._desk = CommandDesk(
            terms.schedule,
            valid_ns=self._valid_ns(config),
            times=times,
            least_move_ns=rover.least_move_ns,
            action_of=self._action_of,
            journal=self._journal,
            queued_until_ns=self._endpoint.queued_until_ns,
        )
        self._heartbeat_ns = to_ns(config.heartbeat_s)
        self._heartbeat_at_ns = self._predict_at_ns = 0
        self._silence = GroundSilence(plan, to_ns(config.silent_after_s), terms.light_time_ns)
        self._outlook = Outlook(
            self._belief,
            self._desk,
            self._silence,
            shadow=self.shadow,
            times=times,
            alone_after_ns=rover.alone_after_ns,
        )
        self._memory = Memory(terms.schedule)
        self._sources = Sources(
            self._belief,
            self._desk,
            self._silence,
            self._outlook,
            self._memory,
            shadow=self.shadow,
            plan=plan,
            schedule=terms.schedule,
            rover=rover,
            chart=chart,
        )
        self._progress = operator.progress
        self._journal.note(GROUND_CHART, Yard(chart.rows, chart.cell_m))

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Live tick by tick up to `until_ns`; see `farside.node.Node`."""
        self._endpoint.expect(arrivals)
        self._memory.expect(arrivals)
        while self._now_ns < until_ns:
            self._tick()
            self._endpoint.pump(self._now_ns)
            self._now_ns += self._tick_ns
        sent = self._endpoint.take_sent()
        self._memory.send(sent)
        return Step(sent, self._journal.take())

    def look(self, focus: Focus) -> GroundView:
        """What a person at the ground can know at the present; looking changes nothing."""
        now_ns = self._now_ns
        return look(self._sources, focus, now_ns, self._endpoint.queued_until_ns(now_ns))

    def order(self, acts: Sequence[Act]) -> None:
        """Have these orders given on the first tick of the window that is advanced through next.

        Raises:
            TypeError: if the operator takes no orders from outside.
        """
        if not isinstance(self.operator, QueuedOperator):
            raise TypeError(
                f"expected an operator that takes orders, found {type(self.operator).__name__}"
            )
        self.operator.put(acts)

    def change(self, config: GroundConfig, operator: Operator) -> None:
        """Go by `config` from now on, with `operator` at it; the heartbeats stay.

        Where both are scripts, and what the present one has begun is the same in the other, it goes
        on with the other's rest. Otherwise `operator` takes the seat, and begins its own work.
        """
        before, self._config = self._config, config
        self._desk.valid_ns = self._valid_ns(config)
        self._silence.after_ns = to_ns(config.silent_after_s)
        if _orders(config) == _orders(before):
            return
        match self.operator:
            case ScriptedOperator() as present if config.steps is not None:
                if not present.change(config.steps, config.rules):
                    self.operator = operator
            case _:
                self.operator = operator

    def _valid_ns(self, config: GroundConfig) -> int:
        return self._round_trip_ns + to_ns(config.command_lifetime_s)

    def _tick(self) -> None:
        now_ns = self._journal.now_ns = self._now_ns
        self._listen()
        self._judge_silence()
        if now_ns >= self._heartbeat_at_ns:
            self._heartbeat_at_ns = now_ns + self._heartbeat_ns
            self._endpoint.send(self._heartbeat(), now_ns)
            self._predict()
        for command in self._desk.follow(now_ns, silent=self._silence.state.silent):
            self._endpoint.send(command, now_ns)
        for act in self.operator.act(self.situation):
            self._give(as_logged(act))
        if self.operator.progress != self._progress:
            self._progress = self.operator.progress
            self._journal.note(GROUND_OPERATOR, self._progress)

    def _give(self, act: Act) -> None:
        """Note an act as it was given, and do it."""
        self._journal.note(GROUND_ORDER, OrderGiven(act))
        self._memory.give(act)
        self._note_review(act)
        for command in self._desk.give(act, self._now_ns):
            self._endpoint.send(command, self._now_ns)

    def _action_of(self, order: Order) -> str | None:
        match order:
            case Drive() | Override():
                return order.action
            case Approve():
                proposal = self._belief.proposal_numbered(order.proposal)
                return None if proposal is None else proposal.action
            case _:
                return None

    def _predict(self) -> None:
        """Note where the rover is by now; the older what is known, the less often."""
        prediction = None
        if self._now_ns >= self._predict_at_ns:
            prediction = self._outlook.predicted(self._now_ns)
        if prediction is not None:
            self._predict_at_ns = self._now_ns + (self._now_ns - prediction.from_ns) // _AGE_SHARE
            self._journal.note(GROUND_PREDICTION, prediction)

    def _heartbeat(self) -> Heartbeat:
        telemetry, belief = self._belief.telemetry, self._belief
        newest_ns = -1 if telemetry is None else telemetry.time_ns
        held = None if self.shadow is None else self.shadow.held()
        return Heartbeat(self._desk.last_given, newest_ns, belief.unbroken_ns, held)

    def _listen(self) -> None:
        for message, size_byte, stored in self._endpoint.received(self._now_ns):
            match message:
                case Telemetry():
                    if not stored:
                        self._plan.sized(size_byte)
                    self._learn(message, stored=stored)
                case Event():
                    learned = EventLearned(message)
                    self._journal.note(GROUND_EVENT, learned, publish_time_ns=message.time_ns)
                    self._belief.tell(message, self._now_ns)
                    self._memory.tell(message)
                    if isinstance(message.what, CommandReached):
                        self._desk.learn_stage(message.what, message.time_ns, self._now_ns)
                case Proposal():
                    self._journal.note(GROUND_PROPOSAL, message, publish_time_ns=message.time_ns)
                    self._belief.consider(message)
                    if message.veto_window_s is not None:
                        self._endpoint.send(Shown(message.number), self._now_ns)
                        self._memory.show(message.number, self._now_ns)
                case ModelUpdate() if self.shadow is not None:
                    self.shadow.apply(message)
        self._belief.heard_ns = self._endpoint.heard_ns or 0
        self._belief.look(self._now_ns)

    def _learn(self, telemetry: Telemetry, *, stored: bool) -> None:
        if stored:
            # What was found missing late comes behind what is newer: it says itself when it was so.
            self._journal.note(GROUND_STORED_TELEMETRY, telemetry)
        else:
            self._journal.note(GROUND_TELEMETRY, telemetry, publish_time_ns=telemetry.time_ns)
        self._belief.learn(telemetry, self._now_ns, stored=stored)
        self._desk.learn(telemetry, self._now_ns)
        if telemetry is self._belief.telemetry:
            self._outlook.learn(telemetry)

    def _judge_silence(self) -> None:
        if self._silence.look(self._belief.heard_ns, self._now_ns):
            self._journal.note(GROUND_SILENCE, self._silence.state)

    @property
    def situation(self) -> Situation:
        """What an operator knows now."""
        silent = self._silence.state.silent
        return Situation(self._now_ns, self._belief, self._desk, silent, self._outlook)

    @property
    def silence(self) -> Silence:
        """Whether nothing is heard of the rover, and whether that is as planned."""
        return self._silence.state

    def _note_review(self, act: Act) -> None:
        order = act.order if isinstance(act, Planned) else act
        if not isinstance(order, Approve | Override | Veto):
            return
        proposal = self._belief.proposal_numbered(order.proposal)
        if proposal is None:
            return
        match order:
            case Approve():
                answer, override = Answer.APPROVED, None
            case Override():
                answer, override = Answer.OVERRIDDEN, order.action
            case Veto():
                answer, override = Answer.VETOED, None
        self._journal.note(
            GROUND_REVIEW,
            Review(
                proposal=proposal.number,
                action=proposal.action,
                answer=answer,
                review=self._outlook.review(proposal, self._now_ns),
                override=override,
            ),
        )


def _orders(config: GroundConfig) -> tuple[object, ...]:
    """What the `[ground]` table says of who orders, and how."""
    script = None if config.steps is None else (config.steps, config.rules)
    recorded = config.recorded if config.operator == "recorded" else None
    return config.operator, config.operator_options, script, recorded
