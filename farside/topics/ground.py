"""What the ground knew, and when: the messages of `/ground`."""

from enum import StrEnum

import msgspec

from farside.control import CommandStage, TakeBackChance, Verdict
from farside.messages import Event, Meant, Order, ProposedStep, When


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
