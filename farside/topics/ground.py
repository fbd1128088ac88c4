"""What the ground knew, and when: the messages of `/ground`."""

from enum import StrEnum
from typing import Generic, TypeVar

import msgspec

from farside.control import Failsafe, Mode, OnLoss, Signal
from farside.messages import Event, Meant, Order, ProposedStep, Tokens
from farside.topics.rover import Estimate

T = TypeVar("T")


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
        stale: the items of which something newer was due.
    """

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
    stale: tuple[BeliefItem, ...] = ()


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
