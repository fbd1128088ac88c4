"""Between which times a schedule is wanted, and what of a schedule is in between."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from farside.link.profile.config import Passes
from farside.link.profile.plans.contacts import Plan, gaps
from farside.node import NEVER_NS, NS_PER_S

FOREVER_S = NEVER_NS / NS_PER_S
"""The end, in simulated time, of what does not end: after 146 years."""


class Window(NamedTuple):
    """The simulated time that the tables of a link cover.

    Attributes:
        begin_s, end_s: from when to when.
        is_whole: whether nothing is after `end_s`, as in a mission; otherwise another window
            follows, and an outage that is under way at the end has its own.
    """

    begin_s: float
    end_s: float
    is_whole: bool = False

    @classmethod
    def of(cls, duration_s: float) -> "Window":
        """A run from beginning to end."""
        return cls(0.0, duration_s, is_whole=True)

    @property
    def plan_end_s(self) -> float:
        """Until when a plan of contacts, which is known as a whole, is wanted."""
        return self.end_s if self.is_whole else FOREVER_S


def count_of(passes: Passes, window: Window) -> int:
    """How many passes begin in a window, or are under way when it begins."""
    first, after = _numbers(passes, window)
    return max(0, after - first)


def gaps_between(passes: Passes, window: Window) -> Iterator[tuple[float, float]]:
    """Begin and end of the outages before, between and after the passes of a window.

    The same numbers in every window that has them: those at its edges begin with the pass before
    it, or the run, and end with the pass after it.
    """
    first, after = _numbers(passes, window)
    begins_s = (passes.first_s + number * passes.period_s for number in range(first, after))
    spans = ((begin_s, begin_s + passes.length_s) for begin_s in begins_s)
    end_s = window.end_s if window.is_whole else passes.first_s + after * passes.period_s
    for begin_s, stop_s in gaps(spans, end_s):
        if stop_s > window.begin_s:
            yield begin_s, stop_s


def _numbers(passes: Passes, window: Window) -> tuple[int, int]:
    """The number of the first pass of a window, and of the first one after it."""
    # One more at the beginning, lest rounding leaves out the one under way.
    first = math.floor((window.begin_s - passes.first_s) / passes.period_s) - 1
    after = math.ceil((window.end_s - passes.first_s) / passes.period_s)
    return max(0, first), max(0, after)


def placed(plan: Plan, start: float | None) -> Plan:
    """A plan counted from the date at which the link starts, in POSIX seconds.

    Without such a date it is left as it is, and so is a plan without dates: its second 0 is then
    the start.
    """
    if start is None or plan.zero is None:
        return plan
    later_s = plan.zero - start
    contacts = (
        one._replace(begin_s=one.begin_s + later_s, end_s=one.end_s + later_s)
        for one in plan.contacts
    )
    ranges = (
        one._replace(begin_s=one.begin_s + later_s, end_s=one.end_s + later_s)
        for one in plan.ranges
    )
    return plan._replace(contacts=tuple(contacts), ranges=tuple(ranges), zero=start)
