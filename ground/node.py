"""The ground station as a node: its belief, its operator and its endpoint, stepped together."""

from collections.abc import Sequence

from farside.acts import Act, Discard, Planned
from farside.dem import ShadowModel
from farside.ground.belief import Belief
from farside.ground.commands import CommandDesk
from farside.ground.config import GroundConfig
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.operators.operator import Operator, Situation
from farside.ground.operators.queued import QueuedOperator, as_logged
from farside.ground.shadow import Shadow
from farside.link.endpoint.endpoint import LinkTerms, ground_endpoint
from farside.messages import (
    Approve,
    CommandEnded,
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
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_OPERATOR,
    GROUND_ORDER,
    GROUND_PROPOSAL,
    GROUND_REVIEW,
    GROUND_SILENCE,
    GROUND_TELEMETRY,
    Answer,
    CommandSent,
    EventLearned,
    OrderGiven,
    Review,
)


class Ground:
    """The ground station, stepped tick by tick; a `Node`.

    Args:
        config: the `[ground]` table.
        operator: who decides.
        tick_ns: period of decisions.
        terms: of the link, as agreed with the rover beforehand.
        shadow: for the lists of the model on board, empty; `None` where they are not sent.

    Attributes:
        shadow: what is held of the model on board; `None` where it is not sent.
    """

    def __init__(
        self,
        config: GroundConfig,
        operator: Operator,
        *,
        tick_ns: int,
        terms: LinkTerms,
        shadow: ShadowModel | None = None,
    ) -> None:
        self._tick_ns = tick_ns
        self._now_ns = 0
        self._operator = operator
        self._journal = Journal()
        self._endpoint = ground_endpoint(terms, self._journal)
        self.shadow = None if shadow is None else Shadow(shadow, self._journal)
        plan = DownlinkPlan(terms)
        self._plan = plan
        self._belief = Belief(plan, self._journal)
        self._desk = CommandDesk(terms.round_trip_ns + to_ns(config.command_lifetime_s))
        self._heartbeat_ns = to_ns(config.heartbeat_s)
        self._heartbeat_at_ns = 0
        self._silence = GroundSilence(plan, to_ns(config.silent_after_s), terms.light_time_ns)
        self._progress = operator.progress

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Live tick by tick up to `until_ns`; see `farside.node.Node`."""
        self._endpoint.expect(arrivals)
        while self._now_ns < until_ns:
            self._tick()
            self._endpoint.pump(self._now_ns)
            self._now_ns += self._tick_ns
        return Step(self._endpoint.take_sent(), self._journal.take())

    def order(self, acts: Sequence[Act]) -> None:
        """Have these orders given on the first tick of the window that is advanced through next.

        Raises:
            TypeError: if the operator takes no orders from outside.
        """
        if not isinstance(self._operator, QueuedOperator):
            raise TypeError(
                f"expected an operator that takes orders, found {type(self._operator).__name__}"
            )
        self._operator.put(acts)

    def _tick(self) -> None:
        now_ns = self._journal.now_ns = self._now_ns
        self._listen()
        self._judge_silence()
        if now_ns >= self._heartbeat_at_ns:
            self._heartbeat_at_ns = now_ns + self._heartbeat_ns
            self._endpoint.send(self._heartbeat(), now_ns)
        for act in self._operator.act(self._situation()):
            self._give(as_logged(act))
        if self._operator.progress != self._progress:
            self._progress = self._operator.progress
            self._journal.note(GROUND_OPERATOR, self._progress)

    def _give(self, act: Act) -> None:
        """Note an act as it was given, and do it."""
        self._journal.note(GROUND_ORDER, OrderGiven(act))
        if isinstance(act, Planned | Discard):
            raise TypeError(f"expected an order to be sent at once, found {act}")
        self._note_review(act)
        command = self._desk.give(act, self._now_ns)
        self._endpoint.send(command, self._now_ns)
        self._journal.note(
            GROUND_COMMAND,
            CommandSent(command.number, command.order, command.expires_ns, command.meant),
        )

    def _heartbeat(self) -> Heartbeat:
        telemetry, belief = self._belief.telemetry, self._belief
        newest_ns = -1 if telemetry is None else telemetry.time_ns
        held = None if self.shadow is None else self.shadow.held()
        return Heartbeat(self._desk.last_given, newest_ns, belief.unbroken_ns, held)

    def _listen(self) -> None:
        for message, size_byte, stored in self._endpoint.received(self._now_ns):
            match message:
                case Telemetry():
                    self._journal.note(GROUND_TELEMETRY, message, publish_time_ns=message.time_ns)
                    if not stored:
                        self._plan.sized(size_byte)
                    self._belief.learn(message, self._now_ns, stored=stored)
                    self._desk.learn(message)
                case Event():
                    learned = EventLearned(message)
                    self._journal.note(GROUND_EVENT, learned, publish_time_ns=message.time_ns)
                    self._belief.tell(message, self._now_ns)
                    if isinstance(message.what, CommandEnded):
                        self._desk.learn_end(message.what)
                case Proposal():
                    self._journal.note(GROUND_PROPOSAL, message, publish_time_ns=message.time_ns)
                    self._belief.consider(message)
                    if message.veto_window_s is not None:
                        self._endpoint.send(Shown(message.number), self._now_ns)
                case ModelUpdate():
                    if self.shadow is not None:
                        self.shadow.apply(message)
        self._belief.heard_ns = self._endpoint.heard_ns or 0
        self._belief.look(self._now_ns)

    def _judge_silence(self) -> None:
        if self._silence.look(self._belief.heard_ns, self._now_ns):
            self._journal.note(GROUND_SILENCE, self._silence.state)

    def _situation(self) -> Situation:
        return Situation(self._now_ns, self._belief, self._desk, self._silence.state.silent)

    def _note_review(self, order: Order) -> None:
        if not isinstance(order, Approve | Override | Veto):
            return
        proposal = self._belief.proposal_numbered(order.proposal)
        if proposal is None:
            return
        override = order.action if isinstance(order, Override) else None
        review = self._situation().review(proposal)
        self._journal.note(
            GROUND_REVIEW,
            Review(proposal.number, proposal.action, _ANSWERS[type(order)], review, override),
        )


_ANSWERS = {
    Approve: Answer.APPROVED,
    Override: Answer.OVERRIDDEN,
    Veto: Answer.VETOED,
}
