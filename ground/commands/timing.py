"""By the contact plan: when a command reaches the rover, and when word of it is back."""

from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, NS_PER_S, Direction

MARGIN_NS = NS_PER_S
"""By how much a stage on board may be later than expected and is not late yet (project default).

It covers jitter, ticks, and frames that go first.
"""
_TOLD_MARGIN_NS = 5 * NS_PER_S  # for a lost frame: telemetry says it again (project default)
_WORD_BYTE = 512  # an event, behind telemetry that is being sent
_WITHDRAWAL_BYTE = 256  # an order to take back, behind a heartbeat that is being sent


class Timing:
    """Answers from the schedule. A time that never comes is `NEVER_NS`.

    Args:
        schedule: light times, rates and contacts, as both ends know them.
    """

    def __init__(self, schedule: Schedule) -> None:
        self._schedule = schedule

    @property
    def round_trip_ns(self) -> int:
        """The light time both ways at the start of the run."""
        up, down = (self._schedule.delay_ns(way, 0) for way in Direction)
        return up + down

    def is_open(self, now_ns: int) -> bool:
        """Whether by plan what is sent up now arrives."""
        return self._schedule.opens_ns(Direction.UP, now_ns) == now_ns

    def leaves_ns(self, ready_ns: int, size_byte: int) -> int:
        """When the last bit of what is ready to be sent up at `ready_ns` leaves."""
        return min(NEVER_NS, self._schedule.sends_ns(Direction.UP, ready_ns, size_byte)[1])

    def arrives_ns(self, leaves_ns: int) -> int:
        """When what has left the ground by `leaves_ns` is at the rover."""
        return min(NEVER_NS, leaves_ns + self._schedule.delay_ns(Direction.UP, leaves_ns))

    def told_ns(self, so_ns: int) -> int:
        """When word of what is so on board at `so_ns` is due at the ground: with 5 s of margin."""
        ends_ns = self._schedule.sends_ns(Direction.DOWN, so_ns, _WORD_BYTE)[1]
        light_ns = self._schedule.delay_ns(Direction.DOWN, ends_ns)
        return min(NEVER_NS, ends_ns + light_ns + _TOLD_MARGIN_NS)

    def withdrawn_ns(self, ready_ns: int) -> int:
        """When at the latest an order to take back is due at the rover, if nothing goes wrong."""
        leaves_ns = self.leaves_ns(ready_ns, _WITHDRAWAL_BYTE)
        return min(NEVER_NS, self.arrives_ns(leaves_ns) + MARGIN_NS)

    def withdraw_until_ns(self, ready_ns: int, by_ns: int) -> int | None:
        """Until when to take back so that it is due by `by_ns`; `None` if it is too late."""
        slack_ns = by_ns - self.withdrawn_ns(ready_ns)
        if slack_ns < 0:
            return None
        early_ns, late_ns = ready_ns, by_ns + 1
        # Mostly light time, rate and contact are the same then.
        if self.withdrawn_ns(ready_ns + slack_ns) == by_ns:
            early_ns = ready_ns + slack_ns
            if self.withdrawn_ns(early_ns + 1) > by_ns:
                return early_ns
        while late_ns - early_ns > 1:
            middle_ns = (early_ns + late_ns) // 2
            if self.withdrawn_ns(middle_ns) <= by_ns:
                early_ns = middle_ns
            else:
                late_ns = middle_ns
        return early_ns
