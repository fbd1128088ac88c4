"""What rover and ground say to each other.

The seed's paths (figure 2) in these words: A1 is `Drive`, A2 is `Proposal` with its answers
`Approve`, `Override` and `Veto`, A4 is `SetMode`, A5 is `SetGoal` and `WithdrawGoal`, and S1 is
`Telemetry`.

Commands, proposals and events are sent until they have arrived, in order; of heartbeats and
telemetry only the latest counts. See `farside.link.endpoint.services`.
"""

from typing import Annotated

import msgspec

from farside.control import BatteryState, CommandStage, Failsafe, Mode, ModeCause, OnLoss, Signal

Coordinate = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
"""A coordinate in the chart's frame, in metres: farther than any yard reaches (project default)."""


Tokens = tuple[str, ...]
"""A Sign as it crosses the link or the disk: its Tokens, sorted."""


class _Message(msgspec.Struct, frozen=True, omit_defaults=True):
    pass


# --- uplink: orders, and the command that carries one -----------------------------------------


class Drive(_Message, frozen=True, tag="drive"):
    """Perform one action (A1). In autonomous mode the operator takes over by it.

    `force` insists, where the safety gate would refuse.
    """

    action: str
    force: bool = False


class Approve(_Message, frozen=True, tag="approve"):
    """Perform the proposed action. Refused if that proposal no longer stands (A2)."""

    proposal: int


class Override(_Message, frozen=True, tag="override"):
    """Perform this action in place of the proposed one. Refused like `Approve` (A2)."""

    proposal: int
    action: str
    force: bool = False


class Veto(_Message, frozen=True, tag="veto"):
    """Do not perform the proposed action (A2). Nothing is proposed again in this situation."""

    proposal: int


class SetMode(_Message, frozen=True, tag="mode"):
    """Change the mode: the routing switch (A4)."""

    mode: Mode


class SetGoal(_Message, frozen=True, tag="goal"):
    """Put a Sign on the Goal List, or change its priority; the highest comes first (A5).

    A priority that is no finite number is refused; JSON, and so the log, has `None` for it.
    """

    tokens: Tokens
    priority: float | None


class WithdrawGoal(_Message, frozen=True, tag="withdraw"):
    """Remove a Sign from the Goal List, or from the mission goals, whoever wanted it (A5)."""

    tokens: Tokens


class TakeBack(_Message, frozen=True, tag="take-back"):
    """Withdraw a command that has not begun. Refused if it has."""

    number: int


class SetOnLoss(_Message, frozen=True, tag="on-loss"):
    """Say what the rover is to do from now on when the link is lost."""

    on_loss: OnLoss


Order = Drive | Approve | Override | Veto | SetMode | SetGoal | WithdrawGoal | TakeBack | SetOnLoss

ACTS = Drive | Approve | Override
"""The orders that have the rover act; all others change a setting."""


class Meant(_Message, frozen=True):
    """The situation that an order was meant for. It is refused in another one.

    Attributes:
        mode: the mode that the rover was expected to be in.
        place: the Token of the place that the action was to begin at; `None` if the order says no
            place.
        after: the number of the command that the action was to follow on, in place of a place.
    """

    mode: Mode
    place: str | None = None
    after: int | None = None


class When(_Message, frozen=True):
    """When a command that was received may begin. Where both are said, both must be so.

    Attributes:
        after: once this command is done. If it ends otherwise, this one is refused.
        at_ns: not before this time on the rover's clock.
    """

    after: int | None = None
    at_ns: int | None = None


class Command(_Message, frozen=True, tag="command"):
    """One order from the operator.

    Attributes:
        number: counts from 1 without a gap; the rover takes commands in this order.
        expires_ns: simulated time after which the rover does not begin it. What was right before
            an outage may be wrong after it.
        order: what to do.
        meant: the situation that it was meant for; `None` for any.
        when: what it waits for on board; `None` for nothing.
    """

    number: int
    expires_ns: int
    order: Order
    meant: Meant | None = None
    when: When | None = None


class ModelHeld(_Message, frozen=True):
    """What the ground holds of the lists of the model on board.

    Attributes:
        number: number of the newest update that it has applied, 0 for none.
        check: CRC-32 of its lists.
        wants_whole: whether it needs all lists anew.
    """

    number: int
    check: int
    wants_whole: bool = False


class Heartbeat(_Message, frozen=True, tag="heartbeat"):
    """A sign of life from the ground.

    Attributes:
        last_command: the number of the newest command that the ground has given.
        telemetry_ns: time stamp of the newest telemetry that the ground has received, -1 if none.
        unbroken_ns: since when it has been coming without a gap, by its time stamps.
        model: what it holds of the model on board; `None` where that is not sent.
    """

    last_command: int = 0
    telemetry_ns: int = -1
    unbroken_ns: int = -1
    model: ModelHeld | None = None


class Shown(_Message, frozen=True, tag="shown"):
    """A proposal has been put before the operator: the veto window may run."""

    proposal: int


Uplink = Command | Heartbeat | Shown

# --- downlink: events, proposals, telemetry ----------------------------------------------------


class ModeChanged(_Message, frozen=True, tag="mode"):
    """The mode changed to `mode`."""

    mode: Mode
    why: ModeCause


class FailsafeChanged(_Message, frozen=True, tag="failsafe"):
    """The failsafe came into `state`, or has another reason `why` for it.

    `silence_ns` is the silence so far that the contact plan does not explain.
    """

    state: Failsafe
    why: str
    silence_ns: int


class LinkBack(_Message, frozen=True, tag="link-back"):
    """The link is back after it was lost, and what the rover did meanwhile.

    Attributes:
        silence_ns: time between the frames from the ground before and after.
        moves: how many moves it made, however they ended.
        bumps: how many of them were blocked.
        reached: the goals that it reached.
    """

    silence_ns: int
    moves: int
    bumps: int
    reached: tuple[Tokens, ...]


class GoalReached(_Message, frozen=True, tag="reached"):
    """A goal's Sign became active and the goal was removed."""

    tokens: Tokens


class GoalAside(_Message, frozen=True, tag="aside"):
    """A goal is put aside, since it cannot be pursued now; or taken up again (`why` is `None`)."""

    tokens: Tokens
    why: str | None


class CommandReached(_Message, frozen=True, tag="stage"):
    """A command was taken, has begun, or is over: at the time of the event, to the tick.

    That it was taken is told only where it reaches no other stage at that moment: any other one
    says, unless that was told before, that it was taken then, too. That it waits is never told.
    `why` gives the reason of an end that is not done.
    """

    number: int
    stage: CommandStage
    why: str | None = None


class CommandForced(_Message, frozen=True, tag="forced"):
    """A command began although the safety gate had refused it, since the operator insisted."""

    number: int
    why: str


class CommandsMissing(_Message, frozen=True, tag="missing"):
    """The rover hears the ground, but commands up to `last` do not arrive; or now they have."""

    missing: bool
    last: int


class BatteryChanged(_Message, frozen=True, tag="battery"):
    """The battery changed to `state`, at this state of charge (0 to 1)."""

    state: BatteryState
    charge: float


class StuckChanged(_Message, frozen=True, tag="stuck"):
    """The rover cannot move any more, after so many blocked moves in a row; or it moved again."""

    stuck: bool
    moves: int


Happening = (
    ModeChanged
    | FailsafeChanged
    | LinkBack
    | GoalReached
    | GoalAside
    | CommandReached
    | CommandForced
    | CommandsMissing
    | BatteryChanged
    | StuckChanged
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
        path: the best-estimate path to the goal.
        veto_window_s: with consent by veto, for how long after the operator was shown it the rover
            waits before it acts; `None` with consent by approval.
        model_check: CRC-32 of the lists that it was computed from; `None` where the model is not
            sent to the ground.
        last_command: number of the newest command that had been received.
    """

    number: int
    time_ns: int
    goal: Tokens
    action: str
    path: tuple[ProposedStep, ...]
    veto_window_s: float | None = None
    model_check: int | None = None
    last_command: int = 0


class Telemetry(_Message, frozen=True, tag="telemetry"):
    """The state of the rover as the rover sees it (S1).

    Attributes:
        time_ns: when it was so.
        tokens: the Tokens sensed.
        x_m, y_m, heading_rad: the pose estimate, in the chart's frame.
        battery: state of charge, 0 to 1.
        mode, failsafe: their states.
        action: the action under way, `None` when standing still.
        since_ns: since when it has been under way, or the rover has stood still.
        goals: the Goal List, top-goal first, those put aside last.
        commands_done: every command up to this number is over, done or not.
        begun: number of the command whose action is under way.
        waiting: numbers of the commands that wait to begin, in order.
        proposal: number of the proposal that stands.
        signal: strength of the radio's signal.
        on_loss: what the rover will do when the link is lost.
        alone_goals: the goals that it will pursue then, as of now, top-goal first.
        tilt_rad: by how much it tilts; `None` while it stands level.
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
    begun: int | None = None
    waiting: tuple[int, ...] = ()
    proposal: int | None = None
    signal: Signal = Signal.STRONG
    on_loss: OnLoss = OnLoss.AUTONOMY
    alone_goals: tuple[Tokens, ...] = ()
    since_ns: int = 0
    tilt_rad: float | None = None


class ModelUpdate(_Message, frozen=True, tag="model"):
    """The changes of the lists of the model on board, for the shadow of it at the ground.

    Attributes:
        number: counts updates from 1.
        time_ns: when it was made.
        cycles: how many cycles of the model it covers.
        check: CRC-32 of the lists after it.
        delta: a `farside.dem.Delta` as MessagePack.
    """

    number: int
    time_ns: int
    cycles: int
    check: int
    delta: bytes


Downlink = Event | Proposal | Telemetry | ModelUpdate
