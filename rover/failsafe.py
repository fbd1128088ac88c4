"""The failsafe: what silence on the link means."""

from farside.messages import Failsafe
from farside.node import to_ns
from farside.rover.config import FailsafeConfig


class FailsafeLadder:
    """Nominal, hold, lost: a ladder climbed as the time without a frame from the ground grows.

    Any frame returns it to nominal.

    Args:
        config: when to hold, and when the link counts as lost.
        first_heard_ns: the earliest time a frame can arrive; silence counts from there.

    Attributes:
        heard_ns: when the last frame arrived.
        state: the rung.
    """

    def __init__(self, config: FailsafeConfig, first_heard_ns: int) -> None:
        self.heard_ns = first_heard_ns
        self._hold_ns = to_ns(config.hold_after_s)
        self._lost_ns = to_ns(config.lost_after_s)
        self.state = Failsafe.NOMINAL

    def heard(self, arrival_ns: int) -> None:
        """A frame arrived from the ground."""
        self.heard_ns = max(self.heard_ns, arrival_ns)

    def silence_ns(self, now_ns: int) -> int:
        """Time since the last frame."""
        return max(0, now_ns - self.heard_ns)

    def update(self, now_ns: int) -> bool:
        """Update the state to the silence at `now_ns`; true if it changed."""
        silence_ns = self.silence_ns(now_ns)
        state = Failsafe.NOMINAL
        if silence_ns >= self._lost_ns:
            state = Failsafe.LOST
        elif silence_ns >= self._hold_ns:
            state = Failsafe.HOLD
        changed, self.state = state is not self.state, state
        return changed
