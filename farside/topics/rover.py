"""What the rover sensed, thought and did: the messages of `/rover`."""

from enum import StrEnum

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
from farside.messages import Coordinate, Order, Tokens


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


class PolicyMapPlace(msgspec.Struct, frozen=True):
    """A Sign on the policy map: see `farside.dem.PolicyValue`."""

    sign: Tokens
    value: float
    action: str | None
    depth: int


class PolicyMapEntry(msgspec.Struct, frozen=True):
    """The policy map of the top-goal, as it was when that became the top-goal.

    Attributes:
        goal: the top-goal; `None` from when there is none.
        places: every Sign that can reach it, ordered by value, then Sign.
    """

    goal: Tokens | None
    places: tuple[PolicyMapPlace, ...] = ()


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


class ModelSent(msgspec.Struct, frozen=True):
    """An update of the model on board was made for its shadow at the ground.

    Attributes:
        number: its number.
        size_byte: its length, without what carries it.
        cycles: how many cycles of the model it covers.
        whole: whether it is all lists, and not their changes.
    """

    number: int
    size_byte: int
    cycles: int
    whole: bool
