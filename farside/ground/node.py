"""The ground station as a node: what it hears, its operator, and its end of the link."""

from collections.abc import Sequence

from farside.ground.belief import Belief
from farside.ground.config import GroundConfig
from farside.ground.desk import CommandDesk, Sending
from farside.ground.operator import Operator, Situation
from farside.link.endpoint import ground_endpoint
from farside.link.messages import Approve, Heartbeat, Order, Override, Proposal, Telemetry
from farside.link.node import NS_PER_S, Frame, Step, to_ns
from farside.link.records import CommandSent, EventLearned, Journal, Review, Silence

# Telemetry comes every second, and an acknowledgement waits for it.
_ANSWER_MARGIN_NS = 2 * NS_PER_S


class Ground:
    """The ground station, stepped on the grid; a `Node`.

    Args:
        config: the `[ground]` table.
        operator: who decides.
        tick_ns: the grid of decisions.
        round_trip_ns: propagation both ways.
    """

    def __init__(
        self, config: GroundConfig, operator: Operator, *, tick_ns: int, round_trip_ns: int
    ) -> None:
        self._tick_ns = tick_ns
        self._now_ns = 0
        self._operator = operator
        self._endpoint = ground_endpoint()
        self._journal = Journal()
        self._belief = Belief()
        self._desk = CommandDesk(
            answer_ns=round_trip_ns + _ANSWER_MARGIN_NS,
            valid_ns=round_trip_ns + to_ns(config.command_lifetime_s),
        )
        self._heartbeat_ns = to_ns(config.heartbeat_s)
        self._heartbeat_at_ns = 0
        self._silent_after_ns = round_trip_ns + to_ns(config.silent_after_s)
        self._silent = False

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        """Live tick by tick up to `until_ns`; see `farside.link.node.Node`."""
        self._endpoint.expect(arrivals)
        while self._now_ns < until_ns:
            self._tick()
            self._now_ns += self._tick_ns
        return Step(self._endpoint.take_sent(), self._journal.take())

    def _tick(self) -> None:
        now_ns = self._now_ns
        self._listen()
        self._judge_silence()
        if now_ns >= self._heartbeat_at_ns:
            self._heartbeat_at_ns = now_ns + self._heartbeat_ns
            self._endpoint.send(Heartbeat(len(self._belief.events)), now_ns)
        for order in self._operator.act(self._situation()):
            self._note_review(order)
            self._send(self._desk.give(order, now_ns))
        for sending in self._desk.overdue(now_ns):
            self._send(sending)

    def _listen(self) -> None:
        for arrival_ns, message in self._endpoint.received(self._now_ns):
            self._belief.heard_ns = arrival_ns
            match message:
                case Telemetry():
                    self._learn(message)
                case Proposal():
                    self._belief.consider(message)

    def _learn(self, telemetry: Telemetry) -> None:
        self._journal.note(telemetry, self._now_ns, publish_time_ns=telemetry.time_ns)
        for event in self._belief.learn(telemetry):
            self._journal.note(EventLearned(event), self._now_ns, publish_time_ns=event.time_ns)
        self._desk.acknowledge(telemetry.command_acked, self._now_ns)

    def _judge_silence(self) -> None:
        silent = self._now_ns - self._belief.heard_ns >= self._silent_after_ns
        if silent is not self._silent:
            self._silent = silent
            self._journal.note(Silence(silent), self._now_ns)

    def _situation(self) -> Situation:
        telemetry = self._belief.telemetry
        settled = telemetry is not None and telemetry.commands_done == self._desk.last_given
        return Situation(self._now_ns, self._belief, settled, self._silent)

    def _send(self, sending: Sending) -> None:
        command = sending.command
        self._endpoint.send(command, self._now_ns)
        self._journal.note(
            CommandSent(command.number, sending.attempt, command.order), self._now_ns
        )

    def _note_review(self, order: Order) -> None:
        if isinstance(order, Approve | Override) and self._belief.proposal is not None:
            proposal = self._belief.proposal
            override = order.action if isinstance(order, Override) else None
            self._journal.note(
                Review(proposal.number, proposal.action, override, proposal.path), self._now_ns
            )
