"""When one direction is out: as scheduled, and as commanded during the run."""

import math
from bisect import bisect_right
from collections.abc import Sequence

from farside.frames import OutageReason
from farside.link.profile.schedule import Outage
from farside.node import NEVER_NS


class Outages:
    """The outages of one direction.

    Args:
        scheduled: in order and without overlaps.
    """

    def __init__(self, scheduled: Sequence[Outage]) -> None:
        self._schedule(scheduled)
        # The end of one that lasts is infinite.
        self._commanded: list[tuple[int, float]] = []

    def reschedule(
        self, now_ns: int, scheduled: Sequence[Outage], since_ns: int | None = None
    ) -> list[Outage]:
        """From `now_ns` on, be out as in another schedule; what was before stays.

        Args:
            now_ns: the present.
            scheduled: in order and without overlaps.
            since_ns: what ended before, nobody asks for any more, so it is forgotten; `now_ns` if
                absent.

        Returns:
            those that begin or end now or later.
        """
        ours = zip(self._begins_ns, self._ends_ns, self._reasons, strict=True)
        since_ns = now_ns if since_ns is None else since_ns
        kept = [
            Outage(begin_ns, min(end_ns, now_ns), reason)
            for begin_ns, end_ns, reason in ours
            if begin_ns < now_ns and end_ns >= since_ns
        ]
        self._commanded = [one for one in self._commanded if one[1] >= since_ns]
        coming = [
            outage._replace(begin_ns=max(outage.begin_ns, now_ns))
            for outage in scheduled
            if outage.end_ns > now_ns
        ]
        if kept and coming:
            last, first = kept[-1], coming[0]
            if (last.end_ns, last.reason) == (first.begin_ns, first.reason) and (
                last.end_ns == now_ns
            ):
                kept.pop()
                coming[0] = first._replace(begin_ns=last.begin_ns)
        self._schedule(outages := [*kept, *coming])
        return [outage for outage in outages if outage.end_ns >= now_ns]

    def _schedule(self, outages: Sequence[Outage]) -> None:
        self._begins_ns = [outage.begin_ns for outage in outages]
        self._ends_ns = [outage.end_ns for outage in outages]
        self._reasons = [outage.reason for outage in outages]

    @property
    def is_commanded(self) -> bool:
        """Whether the direction has been commanded out."""
        return bool(self._commanded) and self._commanded[-1][1] == math.inf

    def toggle(self, now_ns: int) -> None:
        """Command the direction out, or back to its schedule if it was."""
        if self.is_commanded:
            self._commanded[-1] = self._commanded[-1][0], now_ns
        else:
            self._commanded.append((now_ns, math.inf))

    def reasons(
        self, starts_ns: Sequence[int], ends_ns: Sequence[int]
    ) -> Sequence[OutageReason | None] | None:
        """For each span, why the direction is out at any moment of it; `None` if it never is.

        Both ends belong to a span.
        """
        if self._reason(min(starts_ns), max(ends_ns)) is None:
            return None
        return list(map(self._reason, starts_ns, ends_ns))

    def at(self, now_ns: int) -> Outage | None:
        """The outage at `now_ns`. One that was commanded has no known end, so `NEVER_NS`."""
        if self.is_commanded:
            return Outage(self._commanded[-1][0], NEVER_NS, OutageReason.CONTROL)
        first = bisect_right(self._ends_ns, now_ns)
        if first < len(self._ends_ns) and self._begins_ns[first] <= now_ns:
            return Outage(self._begins_ns[first], self._ends_ns[first], self._reasons[first])
        return None

    def _reason(self, start_ns: int, end_ns: int) -> OutageReason | None:
        first = bisect_right(self._ends_ns, start_ns)
        if first < len(self._ends_ns) and self._begins_ns[first] <= end_ns:
            return self._reasons[first]
        if any(begin_ns <= end_ns and start_ns < stop_ns for begin_ns, stop_ns in self._commanded):
            return OutageReason.CONTROL
        return None
