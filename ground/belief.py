"""What the ground knows of the rover."""

from collections import OrderedDict

from farside.messages import Event, GoalReached, Proposal, Telemetry, Tokens

_PROPOSALS_KEPT = 64  # an answer to an older one would be refused on board


class Belief:
    """The newest telemetry, all events, and the latest proposals.

    Attributes:
        telemetry: the newest by the rover's time stamp; `None` before the first.
        heard_ns: when a frame last arrived.
        events: all events received, in the rover's order and without a gap.
        proposal: the newest proposal; `None` before the first.
    """

    def __init__(self) -> None:
        self.telemetry: Telemetry | None = None
        self.heard_ns = 0
        self.events: list[Event] = []
        self.proposal: Proposal | None = None
        self._proposals: OrderedDict[int, Proposal] = OrderedDict()

    def learn(self, telemetry: Telemetry) -> None:
        """Keep telemetry unless newer telemetry is known."""
        if self.telemetry is None or telemetry.time_ns >= self.telemetry.time_ns:
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
