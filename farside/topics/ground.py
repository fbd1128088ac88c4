"""What the ground knew, and when: the messages of `/ground`."""

from enum import StrEnum
from typing import Generic, TypeVar

import msgspec

from farside.acts import Act
from farside.control import (
    CommandStage,
    Failsafe,
    Mode,
    OnLoss,
    Signal,
    TakeBackChance,
    Verdict,
)
from farside.messages import Event, Meant, Order, ProposedStep, Tokens, When
from farside.topics.rover import Estimate

T = TypeVar("T")


class StageDue(msgspec.Struct, frozen=True):
    """When a stage of a command is due on board, by plan and by what was known when it was given.

    Attributes:
        stage: taken, begun or done.
        expected_ns: when it is expected.
        due_ns: when it is due: expected, with a margin of 1 s.
        told_due_ns: when word of it is due at the ground, with a margin of 5 s.
    """

    stage: CommandStage
    expected_ns: int
    due_ns: int
    told_due_ns: int


class CommandSent(msgspec.Struct, frozen=True):
    """The ground sent a command: see `Command`; `dues` are those of its stages, in order."""

    number: int
    order: Order
    expires_ns: int
    meant: Meant | None
    when: When | None = None
    dues: tuple[StageDue, ...] = ()


class LifeEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """What the ground can say of a command from now on: of one of its stages, or as a whole.

    Attributes:
        number: the command.
        stage: the stage; `None` if only the chance to take it back has changed.
        verdict: on the stage.
        due_ns, told_due_ns: see `StageDue`; of an end, whichever it is, those of being done.
        so_ns: when the stage was so on board; `None` while that is not known.
        take_back: whether the command can be taken back; it may be too late where nothing is said.
        take_back_until_ns: until when for sure.
        why: why it ended without being done.
    """

    number: int
    stage: CommandStage | None = None
    verdict: Verdict | None = None
    due_ns: int | None = None
    told_due_ns: int | None = None
    so_ns: int | None = None
    take_back: TakeBackChance = TakeBackChance.OPEN
    take_back_until_ns: int | None = None
    why: str | None = None


class HeldFate(StrEnum):
    """What happens to what is held at the ground: another order joins it, or it is over."""

    HELD = "held"
    RELEASED = "released"
    GIVEN_UP = "given up"


class HeldEntry(msgspec.Struct, frozen=True):
    """What the ground holds until the link is up.

    Attributes:
        number: of holding; not that of a command.
        orders: what is held under it, in order.
        fate: what becomes of it now.
        commands: the numbers under which it was sent, when it is released.
    """

    number: int
    orders: tuple[Order, ...]
    fate: HeldFate
    commands: tuple[int, ...] = ()


class OrderGiven(msgspec.Struct, frozen=True):
    """The operator, whoever that is, gave an order, as it was given."""

    act: Act


class EventLearned(msgspec.Struct, frozen=True):
    """The ground received an event."""

    event: Event


class OperatorEntry(msgspec.Struct, frozen=True):
    """How far the operator is with the script, and what it waits for from now on.

    Attributes:
        step: the number of the step under way, from 1; 0 before the first.
        of: how many steps there are.
        waiting_for: what has to happen for the script to go on, in words; `None` when it is over.
        left: what the operator gave up, each with the reason, in words.
    """

    step: int
    of: int
    waiting_for: str | None
    left: tuple[str, ...] = ()


class PathReview(msgspec.Struct, frozen=True, omit_defaults=True):
    """A way to a goal, over what the ground knows.

    Attributes:
        goal: the goal.
        action: the first action.
        path: the way: of a proposal, or by the shadow's lists.
        age_s: for how long it has been made.
        cost_to_go: estimated cost to the goal, in the unit of the action costs (s).
        probability: that it goes as planned, the product of the C_m of its steps by the shadow's
            lists; `None` where they do not know a step.
        chance: the same by how often such moves came true; see `farside.ground.foresight`.
        in_step: whether the shadow holds the very lists that the way was computed from.
        conflicts: what the ground has learned or sent since, in words.
        runner_up: the best other first action by the shadow's lists, `None` without one.
        margin: by how much that costs more.
        proposal: the number of the proposal, `None` where nobody proposed it.
    """

    goal: Tokens
    action: str
    path: tuple[ProposedStep, ...]
    age_s: float
    cost_to_go: float
    probability: float | None = None
    chance: float | None = None
    in_step: bool = False
    conflicts: tuple[str, ...] = ()
    runner_up: str | None = None
    margin: float | None = None
    proposal: int | None = None


class Answer(StrEnum):
    """How the operator answered a proposal."""

    APPROVED = "approved"
    OVERRIDDEN = "overridden"
    VETOED = "vetoed"


class Review(msgspec.Struct, frozen=True, omit_defaults=True):
    """The operator answered a proposal.

    Attributes:
        proposal: its number.
        action: what it proposed.
        answer: the answer.
        override: the action ordered instead, if any.
        review: what the ground found of its path.
    """

    proposal: int
    action: str
    answer: Answer
    review: PathReview
    override: str | None = None


class Silence(msgspec.Struct, frozen=True):
    """Whether the rover counts as silent at the ground, from now on.

    Attributes:
        silent: nothing is heard, though something was due.
        expected: nothing is heard, and the contact plan explains it.
    """

    silent: bool
    expected: bool = False


class LearnedBy(StrEnum):
    """What told the ground: telemetry, or an event."""

    TELEMETRY = "telemetry"
    EVENT = "event"


class BeliefItem(StrEnum):
    """What the ground believes of the rover, item by item; see `BeliefEntry`."""

    PLACE = "place"
    POSE = "pose"
    BATTERY = "battery"
    MODE = "mode"
    FAILSAFE = "failsafe"
    ACTION = "action"
    GOALS = "goals"
    SIGNAL = "signal"
    PROPOSAL = "proposal"
    ON_LOSS = "on_loss"
    ALONE_GOALS = "alone_goals"


class Known(msgspec.Struct, Generic[T], frozen=True):
    """A value that the ground knows: when it was so, when it was learned, and by what."""

    value: T
    so_ns: int
    learned_ns: int
    by: LearnedBy


class BeliefEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """What the ground believes of the rover, from now on; `None` for what it never learned.

    Attributes:
        stale: the items of which something newer was due.
        place: the Token of the place where the rover believes to be, `None` if it does not know.
        pose: the estimate on board.
        battery: state of charge, 0 to 1.
        mode, failsafe: their states.
        action: the action under way, `None` when standing still.
        goals: the Goal List, top-goal first.
        signal: strength of the radio's signal.
        proposal: number of the proposal that stands.
        on_loss: what the rover will do when the link is lost.
        alone_goals: the goals that it will pursue then.
    """

    stale: tuple[BeliefItem, ...]
    place: Known[str | None] | None = None
    pose: Known[Estimate] | None = None
    battery: Known[float] | None = None
    mode: Known[Mode] | None = None
    failsafe: Known[Failsafe] | None = None
    action: Known[str | None] | None = None
    goals: Known[tuple[Tokens, ...]] | None = None
    signal: Known[Signal] | None = None
    proposal: Known[int | None] | None = None
    on_loss: Known[OnLoss] | None = None
    alone_goals: Known[tuple[Tokens, ...]] | None = None


class Likely(msgspec.Struct, frozen=True):
    """A Sign that is predicted to be active, and with what probability."""

    sign: Tokens
    probability: float


class Prediction(msgspec.Struct, frozen=True, omit_defaults=True):
    """Where the rover is predicted to be.

    Attributes:
        at_ns: when.
        from_ns: the time stamp of the telemetry that it is computed from.
        likely: the Signs of places with their probabilities, the most probable first; those of
            less than a hundredth are left out.
        unknown: the probability that it is anywhere else, or that nothing is known of where.
        command: the command after which it will be there; `None` for where it is now.
    """

    at_ns: int
    from_ns: int
    likely: tuple[Likely, ...]
    unknown: float
    command: int | None = None


class ShadowEntry(msgspec.Struct, frozen=True):
    """The shadow of the model on board, after an update or when it fell out of step.

    Attributes:
        number: number of the newest update applied, 0 for none.
        check: CRC-32 of its lists.
        in_step: whether they are known to be those that the rover had after that update.
        why: why not; `None` if they are.
        signs, hypotheses: sizes of its lists.
        cycles: how many cycles of the model the update covers.
    """

    number: int
    check: int
    in_step: bool
    why: str | None
    signs: int
    hypotheses: int
    cycles: int
