"""What a run's log holds: every topic, and the types of their messages.

The first part of a topic's name says who knew: `/truth` what was so, `/rover` what the rover
sensed, thought and did, `/link` the fate of every frame, `/ground` what the ground knew, and when.
"""

from enum import StrEnum
from typing import Annotated, TypeVar, cast

import msgspec

from farside.control import (
    BatteryState,
    Cause,
    Chooser,
    CommandStage,
    Failsafe,
    Mode,
    ModeCause,
)
from farside.frames import FrameEvent, FrameFate, LinkOutage
from farside.messages import (
    Coordinate,
    Event,
    Meant,
    Order,
    Proposal,
    ProposedStep,
    Telemetry,
    Tokens,
)
from farside.node import Topic
from farside.places import Chart

# --- /truth ------------------------------------------------------------------------------------


class Yard(msgspec.Struct, frozen=True):
    """The world, once at the start: the chart's rows from north to south, and its scale.

    Raises:
        ValueError: if no `Chart` can be made of it, or one without a place.
    """

    rows: tuple[str, ...]
    cell_m: Annotated[float, msgspec.Meta(ge=0.01, le=1000)]

    def __post_init__(self) -> None:
        # So that a log with a map that no rover can be on is refused as it is read.
        if not Chart(self.rows, self.cell_m).places:
            raise ValueError("a map without a place")


class Pose(msgspec.Struct, frozen=True):
    """The true pose, and the true state of charge of the battery (0 to 1).

    Metres east and north of the chart's south-west corner; the heading is 0 towards east and grows
    counter-clockwise, without bound.
    """

    x_m: Coordinate
    y_m: Coordinate
    heading_rad: float
    speed_m_s: float
    place: str
    battery: float


class Bump(msgspec.Struct, frozen=True):
    """The rover hit a wall or a rock at this speed."""

    x_m: Coordinate
    y_m: Coordinate
    speed_m_s: float


# --- /rover ------------------------------------------------------------------------------------


class Estimate(msgspec.Struct, frozen=True):
    """The pose estimate on board."""

    x_m: Coordinate
    y_m: Coordinate
    heading_rad: float


class Cycle(msgspec.Struct, frozen=True):
    """One cycle of the DEM up to the choice of an action.

    Attributes:
        tokens: the Tokens sensed.
        novel, unexpected: Signs that triggered creation of hypotheses.
        succeeded, failed: numbers of due predictions that came true, or did not.
        created: number of hypotheses created.
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
    """An action began. `command` is the number of the command behind it, if there is one."""

    action: str
    chooser: Chooser
    command: int | None
    goal: Tokens | None


class ActionEnded(msgspec.Struct, frozen=True):
    """An action ended after `duration_s`; `blocked` if it was given up."""

    action: str
    duration_s: float
    blocked: bool


class ModeEntry(msgspec.Struct, frozen=True):
    """The rover's mode from now on, and what brought it there."""

    mode: Mode
    why: ModeCause


class FailsafeEntry(msgspec.Struct, frozen=True):
    """The failsafe's state from now on.

    Attributes:
        state: the state.
        why: the reason in words, from the failsafe's table.
        causes: all that is so.
        silence_s: the silence that the contact plan does not explain.
        countdown_s: how much more of such silence is left before the link counts as lost.
    """

    state: Failsafe
    why: str
    causes: tuple[Cause, ...]
    silence_s: float
    countdown_s: float


class BatteryEntry(msgspec.Struct, frozen=True):
    """The battery's state from now on, and its state of charge (0 to 1)."""

    state: BatteryState
    charge: float


class StuckEntry(msgspec.Struct, frozen=True):
    """Whether the rover is stuck from now on, and the blocked moves in a row that led to it."""

    stuck: bool
    moves: int


class CommandEntry(msgspec.Struct, frozen=True):
    """A command reached a stage of its life on board.

    Attributes:
        number: its number.
        stage: the stage.
        order: what it orders.
        why: why it ended without being done, or what the operator insisted against.
    """

    number: int
    stage: CommandStage
    order: Order
    why: str | None = None


class Arc(msgspec.Struct, frozen=True):
    """A hypothesis behind a decision: `context ∧ action → outcome`.

    Attributes:
        context, action, outcome: the hypothesis.
        cm: its corroboration measure.
        cost_to_go: cost estimate from the context to the goal by it; `None` without a goal.
    """

    context: Tokens
    action: str
    outcome: Tokens
    cm: float
    cost_to_go: float | None


class Decision(msgspec.Struct, frozen=True):
    """What to do next was decided: begun, or put before the operator.

    Attributes:
        chooser: who chose.
        action: the action.
        goal: the goal that it serves, `None` without one.
        active: the active Signs.
        behind: the hypothesis behind it; `None` where nothing was known of it.
        runner_up: the best hypothesis with another action, `None` without one.
        margin: by how much the runner-up costs more, `None` without one.
        proposal: number of the proposal that was made of it, if one was.
        command: number of the command behind it, if there is one.
    """

    chooser: Chooser
    action: str
    goal: Tokens | None
    active: tuple[Tokens, ...]
    behind: Arc | None
    runner_up: Arc | None
    margin: float | None
    proposal: int | None = None
    command: int | None = None


class ProposalEnded(msgspec.Struct, frozen=True):
    """A proposal does not stand any more, for the reason `why`."""

    number: int
    why: str


class GoalChange(StrEnum):
    """What happened to a goal. A suspended one stays on the list, and nothing is done for it."""

    SET = "set"
    REACHED = "reached"
    WITHDRAWN = "withdrawn"
    SUSPENDED = "suspended"
    RECOVERED = "recovered"


class GoalSource(StrEnum):
    """Who wants a goal: the operator, the mission (preloaded), or the rover itself."""

    OPERATOR = "operator"
    MISSION = "mission"
    INHERENT = "inherent"


class GoalEntry(msgspec.Struct, frozen=True):
    """A change of the Goal List; `why` a goal was suspended."""

    tokens: Tokens
    change: GoalChange
    priority: float
    source: GoalSource
    why: str | None = None


class StoreEntry(msgspec.Struct, frozen=True):
    """What has become of the telemetry that was stored while the link was out.

    Attributes:
        kept: how many messages were stored so far.
        given_up: how many of them were dropped since the store was full.
        waiting: how many are not known to have arrived at the ground.
    """

    kept: int
    given_up: int
    waiting: int


# --- /ground -----------------------------------------------------------------------------------


class CommandSent(msgspec.Struct, frozen=True):
    """The ground sent a command: see `Command`."""

    number: int
    order: Order
    expires_ns: int
    meant: Meant | None


class EventLearned(msgspec.Struct, frozen=True):
    """The ground received an event."""

    event: Event


class OperatorEntry(msgspec.Struct, frozen=True):
    """How far the operator is with the script, and what it waits for from now on.

    Attributes:
        step: the number of the step under way, from 1; 0 before the first.
        of: how many steps there are.
        waiting_for: what has to happen for the script to go on, in words; `None` when it is over.
    """

    step: int
    of: int
    waiting_for: str | None


class Review(msgspec.Struct, frozen=True):
    """The operator answered a proposal; `override` is the action ordered instead, if any."""

    proposal: int
    action: str
    override: str | None
    path: tuple[ProposedStep, ...]
    vetoed: bool = False


class Silence(msgspec.Struct, frozen=True):
    """Whether the rover counts as silent at the ground, from now on."""

    silent: bool


# --- the topics --------------------------------------------------------------------------------

T = TypeVar("T", bound=msgspec.Struct)

TOPICS: dict[str, Topic[msgspec.Struct]] = {}
"""Every topic of Farside's own by name. Each one appears in every log, used or not, as JSON."""


def _topic(name: str, kind: type[T]) -> Topic[T]:
    topic = Topic(name, kind)
    TOPICS[name] = cast("Topic[msgspec.Struct]", topic)
    return topic


TRUTH_YARD = _topic("/truth/yard", Yard)
TRUTH_POSE = _topic("/truth/pose", Pose)
TRUTH_BUMP = _topic("/truth/bump", Bump)

ROVER_ESTIMATE = _topic("/rover/estimate", Estimate)
ROVER_CYCLE = _topic("/rover/cycle", Cycle)
ROVER_ACTION_STARTED = _topic("/rover/action_started", ActionStarted)
ROVER_ACTION_ENDED = _topic("/rover/action_ended", ActionEnded)
ROVER_MODE = _topic("/rover/mode", ModeEntry)
ROVER_FAILSAFE = _topic("/rover/failsafe", FailsafeEntry)
ROVER_BATTERY = _topic("/rover/battery", BatteryEntry)
ROVER_STUCK = _topic("/rover/stuck", StuckEntry)
ROVER_COMMAND = _topic("/rover/command", CommandEntry)
ROVER_GOAL = _topic("/rover/goal", GoalEntry)
ROVER_PROPOSAL = _topic("/rover/proposal", Proposal)
ROVER_PROPOSAL_ENDED = _topic("/rover/proposal_ended", ProposalEnded)
ROVER_DECISION = _topic("/rover/decision", Decision)
ROVER_FRAME = _topic("/rover/frame", FrameEvent)
ROVER_STORE = _topic("/rover/store", StoreEntry)

LINK_FRAME = _topic("/link/frame", FrameFate)
LINK_OUTAGE = _topic("/link/outage", LinkOutage)

GROUND_FRAME = _topic("/ground/frame", FrameEvent)
GROUND_TELEMETRY = _topic("/ground/telemetry", Telemetry)
GROUND_COMMAND = _topic("/ground/command", CommandSent)
GROUND_EVENT = _topic("/ground/event", EventLearned)
GROUND_PROPOSAL = _topic("/ground/proposal", Proposal)
GROUND_REVIEW = _topic("/ground/review", Review)
GROUND_OPERATOR = _topic("/ground/operator", OperatorEntry)
GROUND_SILENCE = _topic("/ground/silence", Silence)
