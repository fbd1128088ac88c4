"""The sinks: what the motors of a stick or a pad do at a moment, so that a hand feels a cue.

They are handed what is to be felt again and again, and tell the motors only what changes.
"""

from typing import Protocol

from farside.console.stick.cues import TABLE, force_of, rumble_of
from farside.console.stick.intention import Felt
from farside.node import NS_PER_S

_LASTS_MS = 1000  # a rumble that is not renewed ends by itself, should this process die
_RENEW_NS = 500_000_000
_MS = 1_000_000


class Sink(Protocol):
    """Makes a person feel."""

    def play(self, felt: Felt, now_ns: int) -> None:
        """Let this be felt now, in wall time."""
        ...


class Rumbling(Protocol):
    """The motors of a pad."""

    def rumble(self, strength: float, for_ms: int) -> None:
        """Rumble this strongly, 0 to 1, for so many wall milliseconds or until told otherwise."""
        ...


class Forcing(Protocol):
    """The motors of a stick with force feedback; x to the east, y to the north, each -1 to 1."""

    def spring(self, level: float, x: float, y: float) -> None:
        """Draw the stick to a place with a spring of this strength, 0 to 1."""
        ...

    def constant(self, level: float, x: float, y: float) -> None:
        """Push the stick in a direction with this strength, -1 to 1."""
        ...


class RumbleSink:
    """Plays cues on a pad: two short pulses, one long, or one that rises."""

    def __init__(self, motors: Rumbling) -> None:
        self._motors = motors
        self._level = 0.0
        self._told_ns = 0

    def play(self, felt: Felt, now_ns: int) -> None:
        """See `Sink`."""
        level = round(_rumble(felt, now_ns), 2)
        is_ending = level > 0 and now_ns - self._told_ns >= _RENEW_NS
        if level != self._level or is_ending:
            self._level, self._told_ns = level, now_ns
            self._motors.rumble(level, _LASTS_MS)


def _rumble(felt: Felt, now_ns: int) -> float:
    """How strongly a pad rumbles at this moment, 0 to 1."""
    rumble = rumble_of(felt.cue, felt.near)
    if not rumble.pulses:
        return rumble.strength
    played_ms = (now_ns - felt.since_ns) // _MS
    pulse, within_ms = divmod(played_ms, rumble.pulse_ms + rumble.pause_ms)
    return rumble.strength if pulse < rumble.pulses and within_ms < rumble.pulse_ms else 0.0


class ForceSink:
    """Plays cues on a stick with force feedback: resistance, a pull, or shaking."""

    def __init__(self, motors: Forcing) -> None:
        self._motors = motors
        self._spring = (0.0, 0.0, 0.0)
        self._constant = (0.0, 0.0, 0.0)

    def play(self, felt: Felt, now_ns: int) -> None:
        """See `Sink`."""
        force = force_of(felt.cue, felt.near)
        east, north = TABLE.directions.get(felt.action, (0.0, 0.0))
        spring = (round(force.spring, 2), force.centre * east, force.centre * north)
        if spring != self._spring:
            self._spring = spring
            self._motors.spring(*spring)
        halves = int((now_ns - felt.since_ns) * 2 * force.shake_hz) // NS_PER_S
        shake = round(force.shake, 2)
        constant = (-shake if halves % 2 else shake, east, north) if shake else (0.0, 0.0, 0.0)
        if constant != self._constant:
            self._constant = constant
            self._motors.constant(*constant)
