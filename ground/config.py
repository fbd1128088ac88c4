"""The `[ground]` table of a mission file. Defaults are project defaults."""

from msgspec import field

from farside.control import Mode
from farside.settings import (
    ActionName,
    Count,
    NonNegative,
    Options,
    PlaceName,
    Positive,
    Section,
)


class OverrideAt(Section, frozen=True):
    """Answer one proposal with an action of the operator's own instead of approval.

    Attributes:
        proposal: which one, counted from 1 since the goal was sent.
        action: the action to perform instead: `N`, `E`, `S` or `W`.
    """

    proposal: Count
    action: ActionName


class Tour(Section, frozen=True, tag="tour", tag_field="do"):
    """Drive the rover by commands from place to place, one move at a time.

    Attributes:
        places: where to, in this order.
    """

    places: tuple[PlaceName, ...]


class SwitchMode(Section, frozen=True, tag="mode", tag_field="do"):
    """Change the mode and wait until telemetry confirms it.

    Attributes:
        mode: the mode to change to.
    """

    mode: Mode


class Pursue(Section, frozen=True, tag="goal", tag_field="do"):
    """Send a goal; answer proposals until it is known to be reached.

    They are approved, except for `overrides`. What would be carried out without a veto needs no
    approval.

    Attributes:
        place: the goal.
        priority: its priority; the rover pursues the goal with the highest.
        overrides: the proposals to answer with another action.
    """

    place: PlaceName
    priority: Positive = 2.0
    overrides: tuple[OverrideAt, ...] = ()


class AwaitReached(Section, frozen=True, tag="await", tag_field="do"):
    """Wait until a goal that someone else set is known to be reached.

    Attributes:
        place: that goal.
        already: whether it counts, too, if that was known before this step began.
    """

    place: PlaceName
    already: bool = False


class WaitUntil(Section, frozen=True, tag="wait", tag_field="do"):
    """Wait until a time.

    Attributes:
        until_s: that simulated time.
    """

    until_s: NonNegative


ScriptStep = Tour | SwitchMode | Pursue | AwaitReached | WaitUntil


class GroundConfig(Section, frozen=True):
    """The ground station: its operator, and what it sends by itself.

    Attributes:
        operator: who decides at the ground: `scripted`; the name of an installed operator; or
            `module:Class` of one's own, see `docs/extend.md`.
        operator_options: what an operator other than `scripted` is made with.
        script: the steps of the scripted operator, in order.
        heartbeat_s: interval between heartbeats on the uplink.
        silent_after_s: the rover counts as silent when no frame has arrived for this long beyond a
            round trip; no drive command is sent then.
        command_lifetime_s: a command expires this long, plus a round trip, after it was given.
            After one that expired the next ones may take four times as long, up to sixteen times,
            until one is done.
    """

    operator: str = "scripted"
    operator_options: Options = field(default_factory=dict)
    script: tuple[ScriptStep, ...] = ()
    heartbeat_s: Positive = 2.0
    silent_after_s: Positive = 6.0
    command_lifetime_s: Positive = 20.0
