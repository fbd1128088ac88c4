"""How fast simulated time passes for a person: pause, speed, and warps that end by themselves."""

from enum import StrEnum

from farside.node import NEVER_NS, NS_PER_S

SPEEDS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 1000.0)
"""Simulated seconds per wall second that the keys step through."""

LONGEST_WINDOW_NS = NS_PER_S
"""No window is longer, so that nothing is learned much later than it arrives (project default)."""

READABLE_SPEED = 60.0
"""Up to this speed a person still follows what is shown (project default)."""

_WINDOW_WALL_S = 0.1
_SHORTEST_NS = 1
_AHEAD_S = 0.3  # of wall time: what a machine that stood still for long does not make up for


class Until(StrEnum):
    """What time can be warped to: news from the rover, or the next contact by plan."""

    ARRIVAL = "something arrives"
    CONTACT = "the next contact"


class Pacing:
    """Says up to when a run may go on. It is told of wall time that passes, and of what happens.

    Args:
        speed: simulated seconds per wall second, to begin with.

    Attributes:
        speed: as asked for; kept while time stands, and during a warp.
        paused: whether time stands.
        until: what it is warped to, at any speed; `None` without a warp.
        slowed: why it went back to 1x by itself; empty if it did not, or somebody has chosen since.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self.paused = False
        self.until: Until | None = None
        self.slowed = ""
        self._stands_by = False
        self._target_ns = 0.0
        self._stop_ns = NEVER_NS

    def pass_wall(self, wall_s: float, reached_ns: int) -> None:
        """So much wall time has passed since the last call, and the run has got so far."""
        if self.paused or self.until is not None:
            self._target_ns = reached_ns
            return
        most_ns = reached_ns + self.speed * _AHEAD_S * NS_PER_S
        self._target_ns = min(self._target_ns + self.speed * wall_s * NS_PER_S, most_ns)

    def allows(self, reached_ns: int) -> bool:
        """Whether the run may go on from where it has got to."""
        if self.paused:
            return False
        return self.until is not None or reached_ns < self._target_ns

    def window_ns(self, now_ns: int) -> int:
        """The longest window from now on, so that what is due is not passed by, above 0."""
        wanted = LONGEST_WINDOW_NS
        if self.until is None:
            wanted = min(wanted, round(self.speed * _WINDOW_WALL_S * NS_PER_S))
        if now_ns < self._stop_ns:
            wanted = min(wanted, self._stop_ns - now_ns)
        return max(_SHORTEST_NS, wanted)

    @property
    def is_hurried(self) -> bool:
        """Whether time passes so fast that nobody reads along."""
        return not self.paused and (self.until is not None or self.speed > READABLE_SPEED)

    # --- what happens --------------------------------------------------------------------------

    def expect(self, moment_ns: int) -> None:
        """A window is to end at this moment, if none does before: a decision is due then."""
        self._stop_ns = moment_ns

    def slow(self, why: str, *, above: float = 1.0) -> None:
        """Back to 1x from a warp, or from a speed above `above`: something needs a decision."""
        if self.until is None and self.speed <= above:
            return
        self.until, self.speed, self.slowed = None, 1.0, why

    def arrive(self, until: Until, why: str) -> None:
        """What a warp may have waited for has come."""
        if self.until is until:
            self.slow(why)

    def stand_by(self) -> None:
        """Let time stand until somebody is here."""
        self.pause()
        self._stands_by = True

    def begin(self) -> None:
        """Somebody is here: time that stood by passes; one that somebody has stopped does not."""
        if self._stands_by:
            self._stands_by = False
            self.play()

    # --- what somebody chooses -----------------------------------------------------------------

    def pause(self) -> None:
        """Let time stand."""
        self.paused, self.until = True, None

    def play(self) -> None:
        """Let it pass."""
        self.paused, self.slowed = False, ""

    def set_speed(self, speed: float) -> None:
        """Let it pass at a speed, and no warp.

        Raises:
            ValueError: if it is none between the least and the greatest of `SPEEDS`.
        """
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            least, most = SPEEDS[0], SPEEDS[-1]
            raise ValueError(f"expected a speed from {least:g} to {most:g}, found {speed:g}")
        self.speed, self.until, self.slowed = speed, None, ""
        self.paused = False

    def step(self, *, faster: bool) -> None:
        """The next higher or lower of `SPEEDS`."""
        if faster:
            speed = min((s for s in SPEEDS if s > self.speed), default=self.speed)
        else:
            speed = max((s for s in SPEEDS if s < self.speed), default=self.speed)
        self.set_speed(speed)

    def warp(self, until: Until) -> None:
        """Let time pass as fast as it can until something happens."""
        self.until, self.paused, self.slowed = until, False, ""
