"""What the ground knows of the rover, and since when."""

from farside.messages import Event, GoalReached, Proposal, Telemetry, Tokens


class Belief:
    """The newest telemetry, the events without a gap, and the outstanding proposal.

    Attributes:
        telemetry: the newest, by the time when it was so; `None` before the first.
        heard_ns: when any frame last arrived.
        events: all events that have arrived, in the rover's order.
        proposal: the newest proposal.
    """

    def __init__(self) -> None:
        self.telemetry: Telemetry | None = None
        self.heard_ns = 0
        self.events: list[Event] = []
        self.proposal: Proposal | None = None

    def learn(self, telemetry: Telemetry) -> None:
        """Take in telemetry, unless newer telemetry is known."""
        if self.telemetry is None or telemetry.time_ns >= self.telemetry.time_ns:
            self.telemetry = telemetry

    def consider(self, proposal: Proposal) -> None:
        """Take in a proposal, unless a newer one is known."""
        if self.proposal is None or proposal.number > self.proposal.number:
            self.proposal = proposal

    def reached(self, tokens: Tokens, since_event: int = 0) -> bool:
        """Whether a goal is known to be reached, by an event after number `since_event`."""
        return any(event.what == GoalReached(tokens) for event in self.events[since_event:])
