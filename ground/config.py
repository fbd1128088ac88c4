"""What a mission file says of the ground station. Defaults are project defaults."""

from farside.messages import Mode
from farside.settings import ActionName, Count, NonNegative, PlaceName, Positive, Section


class OverrideAt(Section, frozen=True):
    """Answer the n-th proposal since the goal was sent with `action` instead of consent."""

    proposal: Count
    action: ActionName


class Tour(Section, frozen=True, tag="tour", tag_field="do"):
    """Drive the rover by commands from place to place, one move at a time."""

    places: tuple[PlaceName, ...]


class SwitchMode(Section, frozen=True, tag="mode", tag_field="do"):
    """Turn the routing switch and wait until the rover says that it has."""

    mode: Mode


class Pursue(Section, frozen=True, tag="goal", tag_field="do"):
    """Send a goal; consent to proposals, but for `overrides`, until the goal is known reached."""

    place: PlaceName
    priority: Positive = 2.0
    overrides: tuple[OverrideAt, ...] = ()


class AwaitReached(Section, frozen=True, tag="await", tag_field="do"):
    """Wait until the ground knows that the rover reached a goal that someone else set."""

    place: PlaceName


class WaitUntil(Section, frozen=True, tag="wait", tag_field="do"):
    """Do nothing before this simulated time."""

    until_s: NonNegative


ScriptStep = Tour | SwitchMode | Pursue | AwaitReached | WaitUntil


class GroundConfig(Section, frozen=True):
    """The `[ground]` table.

    Attributes:
        script: what the scripted operator does, in order.
        heartbeat_s: time between heartbeats on the uplink.
        silent_after_s: without a frame for this long the ground takes the rover for silent, and
            sends no new drive commands.
        command_lifetime_s: a command may be obeyed for a round trip, and this long, after it was
            given.
    """

    script: tuple[ScriptStep, ...] = ()
    heartbeat_s: Positive = 2.0
    silent_after_s: Positive = 6.0
    command_lifetime_s: Positive = 20.0
