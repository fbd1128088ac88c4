"""What the ground knew, and when: the messages of `/ground`."""

import msgspec

from farside.acts import Act
from farside.messages import Event, Meant, Order, ProposedStep


class CommandSent(msgspec.Struct, frozen=True):
    """The ground sent a command: see `Command`."""

    number: int
    order: Order
    expires_ns: int
    meant: Meant | None


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
