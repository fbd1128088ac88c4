"""Silence on the link: what of it the contact plan explains, and how much more means loss."""

from farside.link.endpoint.endpoint import LinkTerms
from farside.node import Direction, to_ns
from farside.rover.config import HEARTBEATS, FailsafeConfig

_REGROWTH = 4


class Silence:
    """Counts the time in which a frame from the ground could have arrived, and none did.

    The countdown to the loss of the link shrinks as fast as such silence lasts, and grows again at
    a quarter of that while the ground is heard: a link that flaps still ends in action. A gap
    between frames that is shorter than `grace_ns` is no silence. So a single lost heartbeat never
    uses up what is left of the countdown.

    Args:
        config: when to hold, and when the link counts as lost.
        terms: of the link: its contacts, light times, and the ground's heartbeat.

    Attributes:
        heard_ns: when the last frame arrived; at first the earliest time at which one can.
        grace_ns: the longest gap that is no silence.
        quiet_ns: time since `heard_ns` that the contact plan does not explain.
        silent: whether that is silence.
        expected: whether the contact plan explains that nothing is heard: it has the uplink closed
            now, or it had, and what has been open since is too short to be silence.
        lost: whether the countdown is used up.
    """

    def __init__(self, config: FailsafeConfig, terms: LinkTerms) -> None:
        self._schedule = terms.schedule
        self._heartbeat_ns = terms.heartbeat_ns
        self.change(config)
        self.heard_ns = terms.light_time_ns
        self._used_ns = 0  # of the countdown, as of `heard_ns`
        self.quiet_ns = 0
        self.silent = self.expected = self.lost = False

    def change(self, config: FailsafeConfig) -> None:
        """Hold, and count the link as lost, by `config` from now on."""
        self._budget_ns = to_ns(config.lost_after_s)
        self.grace_ns = max(to_ns(config.hold_after_s), int(HEARTBEATS * self._heartbeat_ns))

    def heard(self, arrival_ns: int) -> None:
        """A frame arrived from the ground."""
        if arrival_ns <= self.heard_ns:
            return
        self.look(arrival_ns)
        self._used_ns = self._used_now_ns
        self.heard_ns = arrival_ns
        self.quiet_ns = 0
        self.silent = self.lost = False

    def look(self, now_ns: int) -> None:
        """Bring everything up to `now_ns`."""
        elapsed_ns = max(0, now_ns - self.heard_ns)
        self.expected = False
        if elapsed_ns < self.grace_ns:
            self.quiet_ns, self.silent, self.lost = elapsed_ns, False, False
            return
        self.quiet_ns = self._schedule.unheard_ns(Direction.UP, self.heard_ns, now_ns)
        self.silent = self.quiet_ns >= self.grace_ns
        self.expected = not self.silent or not self._schedule.is_heard(Direction.UP, now_ns)
        self.lost = self.silent and self._used_now_ns >= self._budget_ns

    @property
    def countdown_ns(self) -> int:
        """How much more silence is left before the link counts as lost."""
        return self._budget_ns - self._used_now_ns

    @property
    def _used_now_ns(self) -> int:
        if self.quiet_ns >= self.grace_ns:
            return min(self._budget_ns, self._used_ns + self.quiet_ns)
        return max(0, self._used_ns - self.quiet_ns // _REGROWTH)
