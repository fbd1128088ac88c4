"""When word from the rover is due at the ground, by all that both ends know beforehand."""

from farside.link.endpoint.endpoint import LinkTerms, telemetry_interval_ns
from farside.node import NEVER_NS, NS_PER_S, Direction
from farside.topics import Silence

REPORT_NS = NS_PER_S
"""The rover reports once a second, or as often as the rate allows."""

_MARGIN_NS = NS_PER_S  # for what is sent first, and for jitter
_TYPICAL_BYTE = 400  # of telemetry, before the first has come


class DownlinkPlan:
    """Says when word of something on board is due at the ground.

    It counts what both ends know: light time, contacts, rate, and the interval in which the rover
    reports. On top comes a second for what is sent first, and for jitter (project default).

    Args:
        terms: of the link.
    """

    def __init__(self, terms: LinkTerms) -> None:
        self._schedule = terms.schedule
        self._size_byte = _TYPICAL_BYTE

    def sized(self, size_byte: int) -> None:
        """A message of telemetry is about this long on the link."""
        self._size_byte = size_byte

    def due_ns(self, made_ns: int, size_byte: int | None = None) -> int:
        """When what is made at `made_ns` is due at the ground, if it waits for nothing else.

        `NEVER_NS` if the contact plan never lets it through.

        Args:
            made_ns: when it is made on board.
            size_byte: its length; that of telemetry by default.
        """
        size_byte = self._size_byte if size_byte is None else size_byte
        _, end_ns = self._schedule.sends_ns(Direction.DOWN, made_ns, size_byte)
        if end_ns >= NEVER_NS:
            return NEVER_NS
        return end_ns + self._schedule.delay_ns(Direction.DOWN, end_ns) + _MARGIN_NS

    def next_due_ns(self, so_ns: int) -> int:
        """When something newer is due than what was so at `so_ns`.

        The next report follows after the interval that the rate allows, or that long after the
        contact in which it can be sent begins.
        """
        made_ns = so_ns + self.interval_ns(so_ns)
        begin_ns, _ = self._schedule.sends_ns(Direction.DOWN, made_ns, self._size_byte)
        if begin_ns >= NEVER_NS:
            return NEVER_NS
        return self.due_ns(
            made_ns if begin_ns == made_ns else begin_ns + self.interval_ns(begin_ns)
        )

    def is_closed(self, now_ns: int) -> bool:
        """Whether nothing can arrive now: by the plan, the rover did not send a light time ago."""
        return not self._schedule.is_heard(Direction.DOWN, now_ns)

    def interval_ns(self, now_ns: int) -> int:
        """In which interval the rover reports at `now_ns`, if the rate allows no more often."""
        # As if stored telemetry waited, which the ground cannot know.
        rate_ns = telemetry_interval_ns(self._schedule, now_ns, self._size_byte, beside_stored=True)
        return max(REPORT_NS, rate_ns)


class GroundSilence:
    """Whether the rover counts as silent: something was due for so long, and nothing is heard.

    Args:
        plan: when word is due.
        after_ns: for how long beyond that.
        light_time_ns: before which nothing can be heard.

    Attributes:
        after_ns: as given.
        state: as of the last `look`.
    """

    def __init__(self, plan: DownlinkPlan, after_ns: int, light_time_ns: int) -> None:
        self._plan, self.after_ns = plan, after_ns
        self._light_time_ns = light_time_ns
        self._heard_ns = -1
        self._due_ns = 0
        self.state = Silence(silent=False)

    def look(self, heard_ns: int, now_ns: int) -> bool:
        """Bring the state up to `now_ns`; true if it has changed.

        Args:
            heard_ns: when a frame last arrived, 0 before the first.
            now_ns: the present.
        """
        if heard_ns != self._heard_ns:
            self._heard_ns = heard_ns
            self._due_ns = self._plan.next_due_ns(max(0, heard_ns - self._light_time_ns))
        silent = now_ns - self._due_ns >= self.after_ns
        quiet = not silent and now_ns - heard_ns >= self.after_ns + self._light_time_ns
        before, self.state = self.state, Silence(silent, quiet and self._plan.is_closed(now_ns))
        return self.state != before

    @property
    def due_ns(self) -> int:
        """When the next word is due, as of the last `look`; `NEVER_NS` if it is not."""
        return self._due_ns

    @property
    def since_ns(self) -> int | None:
        """Since when something was due and nothing is heard; `None` while that is no silence."""
        return self._due_ns if self.state.silent else None
