"""What a run's log holds: one struct a topic, and the `Journal` in which a node keeps them.

The topic says who knew it: `/truth` what was so, `/rover` what the rover sensed, thought and did,
`/link` the fate of every frame, `/ground` what the ground knew, and when.
"""

from enum import StrEnum

import msgspec

from farside.link.messages import (
    Chooser,
    Event,
    Failsafe,
    Mode,
    Order,
    PathStep,
    Proposal,
    Telemetry,
    Tokens,
)
from farside.link.node import Direction, Record

# --- /truth ------------------------------------------------------------------------------------


class Yard(msgspec.Struct, frozen=True):
    """The world, once at the start: the chart's rows from north to south, and its scale."""

    rows: tuple[str, ...]
    cell_m: float


class Pose(msgspec.Struct, frozen=True):
    """Where the rover really is, and its true battery charge (0 to 1).

    Metres east and north of the chart's south-west corner; the heading is 0 towards east and grows
    counter-clockwise, without bound.
    """

    x_m: float
    y_m: float
    heading_rad: float
    speed_m_s: float
    place: str
    battery: float


class Bump(msgspec.Struct, frozen=True):
    """The rover ran into a wall or a rock at this speed."""

    x_m: float
    y_m: float
    speed_m_s: float


# --- /rover ------------------------------------------------------------------------------------


class Estimate(msgspec.Struct, frozen=True):
    """Where the rover believes that it is."""

    x_m: float
    y_m: float
    heading_rad: float


class Cycle(msgspec.Struct, frozen=True):
    """One cycle of the DEM up to the choice of an action.

    Attributes:
        tokens: what was sensed.
        novel, unexpected: Signs that triggered creation.
        succeeded, failed: how many due predictions came true, or did not.
        created: how many hypotheses were made.
        signs, hypotheses: sizes of the lists after the cycle.
        mean_cm: mean C_m of all hypotheses, 0 without any.
    """

    tokens: Tokens
    novel: tuple[Tokens, ...]
    unexpected: tuple[Tokens, ...]
    succeeded: int
    failed: int
    created: int
    signs: int
    hypotheses: int
    mean_cm: float


class ActionStarted(msgspec.Struct, frozen=True):
    """The rover began an action. `command` is the number of the command behind a guided one."""

    action: str
    chooser: Chooser
    command: int | None
    goal: Tokens | None


class ActionEnded(msgspec.Struct, frozen=True):
    """The rover ended an action after `duration_s`; `blocked` if something stood in the way."""

    action: str
    duration_s: float
    blocked: bool


class ModeEntry(msgspec.Struct, frozen=True):
    """The rover's mode from now on, and why."""

    mode: Mode
    why: str


class FailsafeEntry(msgspec.Struct, frozen=True):
    """The failsafe's state from now on, and the silence that it judged by."""

    state: Failsafe
    silence_s: float


class CommandTaken(msgspec.Struct, frozen=True):
    """A command was taken: obeyed, or refused for a reason (`None` when obeyed)."""

    number: int
    order: Order
    refused: str | None


class GoalChange(StrEnum):
    """What happened to a goal."""

    SET = "set"
    REACHED = "reached"
    WITHDRAWN = "withdrawn"


class GoalSource(StrEnum):
    """Whose goal it is: sent by the operator, preloaded, or inherent to the rover."""

    OPERATOR = "operator"
    MISSION = "mission"
    INHERENT = "inherent"


class GoalEntry(msgspec.Struct, frozen=True):
    """A change of the Goal List."""

    tokens: Tokens
    change: GoalChange
    priority: float
    source: GoalSource


# --- /link -------------------------------------------------------------------------------------


class Fate(StrEnum):
    """What became of a frame in the channel: arrived, or why not."""

    DELIVERED = "delivered"
    LOST = "lost"
    OUTAGE = "outage"
    QUEUE_FULL = "queue-full"


class FrameFate(msgspec.Struct, frozen=True):
    """The end of a frame in the channel, logged when it came about.

    Attributes:
        direction, sequence: the frame's id.
        size_byte: length of its payload.
        queued_ns: when the sender handed it over.
        sent_ns, sent_end_ns: first and last bit leaving; both `queued_ns` if it never left.
        arrival_ns: last bit at the other end, `None` unless delivered.
        fate: what became of it.
    """

    direction: Direction
    sequence: int
    size_byte: int
    queued_ns: int
    sent_ns: int
    sent_end_ns: int
    arrival_ns: int | None
    fate: Fate


class LinkOutage(msgspec.Struct, frozen=True):
    """An outage of one direction begins (`down` true) or ends. `reason`: `blackout`."""

    direction: Direction
    down: bool
    reason: str


# --- /ground -----------------------------------------------------------------------------------


class CommandSent(msgspec.Struct, frozen=True):
    """The ground put a command on the uplink; `attempt` counts from 1."""

    number: int
    attempt: int
    order: Order


class EventLearned(msgspec.Struct, frozen=True):
    """The ground learned of an event on the rover."""

    event: Event


class Review(msgspec.Struct, frozen=True):
    """The operator answered a proposal. `override` is the action put in its place, if any."""

    proposal: int
    action: str
    override: str | None
    path: tuple[PathStep, ...]


class Silence(msgspec.Struct, frozen=True):
    """Whether the ground hears the rover, from now on."""

    silent: bool


TOPICS: dict[str, type[msgspec.Struct]] = {
    "/truth/yard": Yard,
    "/truth/pose": Pose,
    "/truth/bump": Bump,
    "/rover/estimate": Estimate,
    "/rover/cycle": Cycle,
    "/rover/action_started": ActionStarted,
    "/rover/action_ended": ActionEnded,
    "/rover/mode": ModeEntry,
    "/rover/failsafe": FailsafeEntry,
    "/rover/command": CommandTaken,
    "/rover/goal": GoalEntry,
    "/rover/proposal": Proposal,
    "/link/frame": FrameFate,
    "/link/outage": LinkOutage,
    "/ground/telemetry": Telemetry,
    "/ground/command": CommandSent,
    "/ground/event": EventLearned,
    "/ground/review": Review,
    "/ground/silence": Silence,
}
"""The type of each topic of Farside's own. Every one appears in the log as JSON."""

_TOPIC_OF = {kind: topic for topic, kind in TOPICS.items()}
_encode = msgspec.json.Encoder(order="deterministic").encode


class Journal:
    """Collects a node's records in order, encoded, until they are taken."""

    def __init__(self) -> None:
        self._records: list[Record] = []

    def note(
        self, entry: msgspec.Struct, time_ns: int, *, publish_time_ns: int | None = None
    ) -> None:
        """Record `entry`, known at `time_ns`, true at `publish_time_ns` (the same by default).

        Raises:
            KeyError: if `TOPICS` has no topic for the type of `entry`.
        """
        since = time_ns if publish_time_ns is None else publish_time_ns
        self._records.append(Record(_TOPIC_OF[type(entry)], time_ns, since, _encode(entry)))

    def take(self) -> list[Record]:
        """The records since the last call."""
        taken, self._records = self._records, []
        return taken
