"""What the ground knows of the rover."""

from farside.messages import Event, GoalReached, Proposal, Telemetry, Tokens


class Belief:
    """The newest telemetry, all events, and the newest proposal.

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

    def learn(self, telemetry: Telemetry) -> None:
        """Keep telemetry unless newer telemetry is known."""
        if self.telemetry is None or telemetry.time_ns >= self.telemetry.time_ns:
            self.telemetry = telemetry

    def consider(self, proposal: Proposal) -> None:
        """Keep a proposal unless a newer one is known."""
        if self.proposal is None or proposal.number > self.proposal.number:
            self.proposal = proposal

    def reached(self, tokens: Tokens, since_event: int = 0) -> bool:
        """Whether an event after the first `since_event` ones says that a goal was reached."""
        return any(event.what == GoalReached(tokens) for event in self.events[since_event:])
