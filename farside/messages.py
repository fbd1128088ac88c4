"""What rover and ground say to each other.

The seed's paths (figure 2) in these words: A1 is `Drive`, A2 is `Proposal` with its answers
`Approve` and `Override`, A4 is `SetMode`, A5 is `SetGoal` and `WithdrawGoal`, and S1 is
`Telemetry`.

Commands, proposals and events are sent until they have arrived, in order; of heartbeats and
telemetry only the latest counts. See `farside.link.endpoint.endpoint.SERVICES`.
"""

from enum import StrEnum
from typing import Annotated

import msgspec

Coordinate = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
"""A coordinate in the chart's frame, in metres: farther than any yard reaches (project default)."""


class Mode(StrEnum):
    """Who drives: the operator, the DEM with the operator's consent, or the DEM alone."""

    GUIDED = "guided"
    SHARED = "shared"
    AUTONOMOUS = "autonomous"


class ModeCause(StrEnum):
    """What brought the rover into a mode: the start of the run, the operator, a lost link."""

    START = "start"
    OPERATOR = "operator"
    LINK_LOST = "link lost"


class Failsafe(StrEnum):
    """The failsafe's state: the link is up; silence, so stand still; the link is lost."""

    NOMINAL = "nominal"
    HOLD = "hold"
    LOST = "lost"


class BatteryState(StrEnum):
    """What the battery does: enough charge; wants charging; charges at the dock; no charge left.

    With a flat battery the rover does not move.
    """

    NOMINAL = "nominal"
    LOW = "low"
    CHARGING = "charging"
    FLAT = "flat"


class Chooser(StrEnum):
    """Who chose an action: the operator, the policy map, or exploration."""

    GUIDED = "guided"
    GOAL_DIRECTED = "goal-directed"
    EXPLORATORY = "exploratory"


Tokens = tuple[str, ...]
"""A Sign as it crosses the link or the disk: its Tokens, sorted."""


class _Message(msgspec.Struct, frozen=True, omit_defaults=True):
    pass


# --- uplink: orders, and the command that carries one -----------------------------------------


class Drive(_Message, frozen=True, tag="drive"):
    """Perform one action, in any mode (A1)."""

    action: str


class Approve(_Message, frozen=True, tag="approve"):
    """Perform the proposed action. Refused if that proposal no longer stands (A2)."""

    proposal: int


class Override(_Message, frozen=True, tag="override"):
    """Perform this action in place of the proposed one. Refused like `Approve` (A2)."""

    proposal: int
    action: str


class SetMode(_Message, frozen=True, tag="mode"):
    """Change the mode: the routing switch (A4)."""

    mode: Mode


class SetGoal(_Message, frozen=True, tag="goal"):
    """Put a Sign on the Goal List, or change its priority; the highest comes first (A5)."""

    tokens: Tokens
    priority: float


class WithdrawGoal(_Message, frozen=True, tag="withdraw"):
    """Remove a Sign from the Goal List (A5)."""

    tokens: Tokens


Order = Drive | Approve | Override | SetMode | SetGoal | WithdrawGoal


class Command(_Message, frozen=True, tag="command"):
    """One order from the operator.

    Attributes:
        number: counts from 1 without a gap; the rover takes commands in this order.
        expires_ns: simulated time after which the rover refuses the order. What was right before
            an outage may be wrong after it.
        order: what to do.
    """

    number: int
    expires_ns: int
    order: Order


class Heartbeat(_Message, frozen=True, tag="heartbeat"):
    """A sign of life from the ground."""


Uplink = Command | Heartbeat

# --- downlink: events, proposals, telemetry ----------------------------------------------------


class ModeChanged(_Message, frozen=True, tag="mode"):
    """The mode changed to `mode`."""

    mode: Mode
    why: ModeCause


class FailsafeChanged(_Message, frozen=True, tag="failsafe"):
    """The failsafe changed to `state` after `silence_ns` without a frame from the ground."""

    state: Failsafe
    silence_ns: int


class GoalReached(_Message, frozen=True, tag="reached"):
    """A goal's Sign became active and the goal was removed."""

    tokens: Tokens


class CommandRefused(_Message, frozen=True, tag="refused"):
    """The rover received the command and refused it."""

    number: int
    why: str


class BatteryChanged(_Message, frozen=True, tag="battery"):
    """The battery changed to `state`, at this state of charge (0 to 1)."""

    state: BatteryState
    charge: float


class StuckChanged(_Message, frozen=True, tag="stuck"):
    """The rover cannot move any more, after so many blocked moves in a row; or it moved again."""

    stuck: bool
    moves: int


Happening = (
    ModeChanged | FailsafeChanged | GoalReached | CommandRefused | BatteryChanged | StuckChanged
)


class Event(_Message, frozen=True, tag="event"):
    """Something the operator must learn of, however late. `number` counts from 1."""

    number: int
    time_ns: int
    what: Happening


class ProposedStep(_Message, frozen=True):
    """A step of a proposal's policy path: Sign, best action there, cost from there to the goal."""

    sign: Tokens
    action: str
    cost_to_go: float


class Proposal(_Message, frozen=True, tag="proposal"):
    """The action that the DEM would take next, and the policy path it belongs to (A2).

    Attributes:
        number: counts proposals from 1.
        time_ns: when it was made.
        goal: the top-goal.
        action: the proposed action.
        chooser: goal-directed, or exploratory where no known path leads to the goal.
        path: the best-estimate path to the goal; empty where exploratory.
    """

    number: int
    time_ns: int
    goal: Tokens
    action: str
    chooser: Chooser
    path: tuple[ProposedStep, ...]


class Telemetry(_Message, frozen=True, tag="telemetry"):
    """The state of the rover as the rover sees it (S1).

    Attributes:
        time_ns: when it was so.
        tokens: the Tokens sensed.
        x_m, y_m, heading_rad: the pose estimate, in the chart's frame.
        battery: state of charge, 0 to 1.
        mode, failsafe: their states.
        action: the action under way, `None` when standing still.
        goals: the Goal List, top-goal first.
        commands_done: number of the last command received and, if it was an action, finished.
    """

    time_ns: int
    tokens: Tokens
    x_m: Coordinate
    y_m: Coordinate
    heading_rad: float
    battery: float
    mode: Mode
    failsafe: Failsafe
    action: str | None
    goals: tuple[Tokens, ...]
    commands_done: int


Downlink = Event | Proposal | Telemetry
