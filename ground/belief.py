"""What the ground knows of the rover."""

from collections import OrderedDict

from farside.messages import Event, GoalReached, Proposal, Telemetry, Tokens
from farside.node import NS_PER_S

_USUAL_INTERVALS = 3
_MARGIN_NS = 5 * NS_PER_S
_PROPOSALS_KEPT = 64  # an answer to an older one would be refused on board


class Belief:
    """The newest telemetry, all events, and the latest proposals.

    Attributes:
        telemetry: the newest by the rover's time stamp; `None` before the first.
        unbroken_ns: since when telemetry has been coming without a gap, by its time stamps; -1
            before the first.
        heard_ns: when a frame last arrived.
        events: all events received, in the rover's order and without a gap.
        proposal: the newest proposal; `None` before the first.
    """

    def __init__(self) -> None:
        self.telemetry: Telemetry | None = None
        self.unbroken_ns = -1
        self._interval_ns = 0
        self.heard_ns = 0
        self.events: list[Event] = []
        self.proposal: Proposal | None = None
        self._proposals: OrderedDict[int, Proposal] = OrderedDict()

    def learn(self, telemetry: Telemetry) -> None:
        """Keep telemetry unless newer telemetry is known."""
        if self.telemetry is None:
            self.telemetry, self.unbroken_ns = telemetry, telemetry.time_ns
            return
        interval_ns = telemetry.time_ns - self.telemetry.time_ns
        if interval_ns < 0:
            return
        # A message or two lost by chance are no gap.
        if interval_ns > _USUAL_INTERVALS * self._interval_ns + _MARGIN_NS:
            self.unbroken_ns = telemetry.time_ns
        self._interval_ns = interval_ns
        self.telemetry = telemetry

    def consider(self, proposal: Proposal) -> None:
        """Keep a proposal; the newest is `proposal`."""
        self._proposals[proposal.number] = proposal
        if len(self._proposals) > _PROPOSALS_KEPT:
            self._proposals.popitem(last=False)
        if self.proposal is None or proposal.number > self.proposal.number:
            self.proposal = proposal

    def proposal_numbered(self, number: int) -> Proposal | None:
        """The proposal with this number, if it has arrived."""
        return self._proposals.get(number)

    def reached(self, tokens: Tokens, since_event: int = 0) -> bool:
        """Whether an event after the first `since_event` ones says that a goal was reached."""
        return any(event.what == GoalReached(tokens) for event in self.events[since_event:])
