"""Contact plans: when one node can send to another, at what rate, and at what light time.

Read by `farside.link.profile.plans.ion` and `farside.link.profile.plans.hdtn`. All times of a plan
are those of sending.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

from farside.frames import OutageReason
from farside.link.profile.config import Affected, Blackout, DelayPoint, OneWay, RateStep
from farside.link.profile.schedule import Delay
from farside.node import to_ns, to_s

_STEP_S = 1e-6  # how long a step takes in a delay table, which is linear between its points
_PAIRS_SHOWN = 20

UNLIMITED_BIT_S = 10**18
"""The rate of a contact for which a plan sets no limit."""


class ContactPlanError(ValueError):
    """A contact plan is invalid, or has no link between these nodes. Says where and why."""


class Contact(NamedTuple):
    """`source` can send to `dest` from `begin_s` up to, not including, `end_s`.

    The rate is `UNLIMITED_BIT_S` where the plan sets no limit.
    """

    begin_s: float
    end_s: float
    source: int
    dest: int
    rate_bit_s: int


class Range(NamedTuple):
    """What `source` sends to `dest` from `begin_s` up to `end_s` has the light time `owlt_s`."""

    begin_s: float
    end_s: float
    source: int
    dest: int
    owlt_s: float


class PairProblem(NamedTuple):
    """Why a line of a plan cannot be used: it refuses the pairs of nodes that it is about.

    Attributes:
        source, dest: the nodes of the line; None where it does not say which, so that it may be
            about any.
        text: which line of the file, what was expected and what was found.
    """

    source: int | None
    dest: int | None
    text: str

    def is_about(self, one: int, other: int) -> bool:
        """Whether the line is about these two nodes, in either direction, or may be."""
        ways = ((one, other), (other, one))
        return any(self.source in {None, a} and self.dest in {None, b} for a, b in ways)


class Plan(NamedTuple):
    """Contacts and ranges in order of time, each for one direction.

    Attributes:
        contacts, ranges: of all pairs of nodes.
        zero: the date of the plan's second 0, in POSIX seconds (UTC, without leap seconds); None
            where the plan has no dates.
        problems: the lines that cannot be used, in the order of the file. They refuse their own
            pairs only.
        untimed: likewise the contacts without times, which open nothing.
    """

    contacts: tuple[Contact, ...]
    ranges: tuple[Range, ...]
    zero: float | None = None
    problems: tuple[PairProblem, ...] = ()
    untimed: tuple[PairProblem, ...] = ()


def plan_of(
    name: str,
    contacts: Iterable[Contact],
    ranges: Iterable[Range],
    *,
    zero: float | None = None,
    problems: Sequence[PairProblem] = (),
    untimed: Sequence[PairProblem] = (),
) -> Plan:
    """The plan of the file `name`.

    Raises:
        ContactPlanError: if it has no contacts.
    """
    plan = Plan(
        tuple(sorted(contacts)), tuple(sorted(ranges)), zero, tuple(problems), tuple(untimed)
    )
    if not plan.contacts:
        for one in (*problems, *untimed):
            raise ContactPlanError(f"{name}, {one.text}")
        raise ContactPlanError(f"{name}, line 1: expected a contact at least, found none")
    return plan


class WayTables(NamedTuple):
    """Delay and rate of one direction, as in `farside.link.profile.config.OneWay`."""

    delay_table: tuple[DelayPoint, ...]
    rate_table: tuple[RateStep, ...]


class LinkTables(NamedTuple):
    """The link between two nodes of a plan.

    Attributes:
        up, down: the two directions.
        blackouts: the times without contact, at the rover's end of the path.
    """

    up: WayTables
    down: WayTables
    blackouts: tuple[Blackout, ...]


class LightTimes(Protocol):
    """The light time over time of what one node sends to another."""

    def from_s(self, time_s: float) -> float:
        """The light time from `time_s` on."""
        ...

    def until_s(self, time_s: float) -> float:
        """The light time up to `time_s`."""
        ...

    def table(self, duration_s: float) -> tuple[DelayPoint, ...]:
        """The light times as a delay table for a run of `duration_s`."""
        ...


class KnownLightTimes:
    """Light times that a link has by itself, so that its plan need not tell them.

    Args:
        one_way: the direction, with its delay.
    """

    def __init__(self, one_way: OneWay) -> None:
        self._delay = Delay(one_way)

    @classmethod
    def of(cls, one_way: OneWay) -> "KnownLightTimes | None":
        """Those of a direction; `None` if it has no delay."""
        has_delay = one_way.delay_s is not None or one_way.delay_table
        return cls(one_way) if has_delay else None

    def from_s(self, time_s: float) -> float:
        """See `LightTimes.from_s`."""
        return to_s(self._delay.at(to_ns(time_s)))

    until_s = from_s

    def table(self, duration_s: float) -> tuple[DelayPoint, ...]:  # noqa: ARG002 - as in `LightTimes`
        """None: the direction keeps its own."""
        return ()


def link_tables(
    plan: Plan,
    ground: int,
    rover: int,
    duration_s: float,
    known: tuple[LightTimes | None, LightTimes | None] = (None, None),
) -> LinkTables:
    """The link between the nodes `ground` and `rover` from time 0 to `duration_s`.

    Where light times are `known`, up and down, those of the plan do not count.

    Between ranges the light time is that of the last range; before the first, that of the first;
    where the plan tells none for this direction it is 0, as ION and HDTN take it. Between contacts
    the rate is that of the last contact: what is sent then is lost anyway. Contacts have the times
    of sending, and outages are at the rover's end, so those of the uplink begin and end one light
    time after the contacts. A direction without contacts is out all the time.

    Raises:
        ContactPlanError: if the plan has no contacts between the two, or a line about them that
            cannot be used.
    """
    up, down = _contacts(plan, ground, rover)
    up_owlt = known[0] or PlannedLightTimes(plan, (up or down)[0])
    down_owlt = known[1] or PlannedLightTimes(plan, (down or up)[0])
    arrivals = sorted(
        (one.begin_s + up_owlt.from_s(one.begin_s), one.end_s + up_owlt.until_s(one.end_s))
        for one in up
    )
    departures = ((one.begin_s, one.end_s) for one in down)
    return LinkTables(
        WayTables(up_owlt.table(duration_s), _rate_table(up, duration_s)),
        WayTables(down_owlt.table(duration_s), _rate_table(down, duration_s)),
        tuple(
            Blackout(start_s=start_s, end_s=end_s, direction=way, reason=OutageReason.CONTACT)
            for way, spans in ((Affected.UP, arrivals), (Affected.DOWN, departures))
            for start_s, end_s in gaps(spans, duration_s)
        ),
    )


def gaps(spans: Iterable[tuple[float, float]], duration_s: float) -> Iterator[tuple[float, float]]:
    """The spans from 0 to `duration_s` that are in none of `spans`, which must be in order."""
    closed_s = 0.0
    for begin_s, end_s in spans:
        if begin_s >= duration_s:
            break
        if begin_s > closed_s:
            yield closed_s, begin_s
        closed_s = max(closed_s, end_s)
    if closed_s < duration_s:
        yield closed_s, duration_s


def _contacts(plan: Plan, ground: int, rover: int) -> tuple[list[Contact], list[Contact]]:
    """The contacts of either direction, of one at least."""
    for problem in plan.problems:
        if problem.is_about(ground, rover):
            raise ContactPlanError(problem.text)
    up = [one for one in plan.contacts if (one.source, one.dest) == (ground, rover)]
    down = [one for one in plan.contacts if (one.source, one.dest) == (rover, ground)]
    if not up and not down:
        for untimed in plan.untimed:
            if untimed.is_about(ground, rover):
                raise ContactPlanError(untimed.text)
        pairs = sorted({(one.source, one.dest) for one in plan.contacts})
        names = [f"{one} to {other}" for one, other in pairs[:_PAIRS_SHOWN]]
        if len(pairs) > _PAIRS_SHOWN:
            names.append(f"{len(pairs) - _PAIRS_SHOWN} more")
        raise ContactPlanError(
            f"expected contacts from {ground} to {rover}, without a relay between them, "
            f"found those from {', '.join(names)}"
        )
    return up, down


class PlannedLightTimes:
    """Light time over time of what one node sends to another, in steps, from ranges."""

    def __init__(self, plan: Plan, contact: Contact) -> None:
        pair = contact.source, contact.dest
        ranges: list[Range] = [one for one in plan.ranges if (one.source, one.dest) == pair]
        if not ranges:
            ranges = [Range(0.0, 0.0, *pair, owlt_s=0.0)]
        self._begins_s = [one.begin_s for one in ranges]
        self._owlts_s = [one.owlt_s for one in ranges]

    def from_s(self, time_s: float) -> float:
        """The light time from `time_s` on."""
        return self._owlts_s[max(0, bisect_right(self._begins_s, time_s) - 1)]

    def until_s(self, time_s: float) -> float:
        """The light time up to `time_s`."""
        return self._owlts_s[max(0, bisect_left(self._begins_s, time_s) - 1)]

    def changes_s(self, begin_s: float, end_s: float) -> list[float]:
        """When it changes between two moments."""
        inside = (one for one in self._begins_s if begin_s < one < end_s)
        return [one for one in inside if self.from_s(one) != self.until_s(one)]

    def table(self, duration_s: float) -> tuple[DelayPoint, ...]:
        """The light times as a delay table for a run of `duration_s`."""
        points = [DelayPoint(t_s=0.0, delay_s=self.from_s(0.0))]
        for begin_s, owlt_s in zip(self._begins_s, self._owlts_s, strict=True):
            last = points[-1]
            if last.t_s < begin_s < duration_s and owlt_s != last.delay_s:
                if last.t_s < begin_s - _STEP_S:
                    points.append(DelayPoint(t_s=begin_s - _STEP_S, delay_s=last.delay_s))
                points.append(DelayPoint(t_s=begin_s, delay_s=owlt_s))
        return tuple(points)


def _rate_table(contacts: Iterable[Contact], duration_s: float) -> tuple[RateStep, ...]:
    """The rates of contacts in order, each from its beginning on, the first from 0 on.

    No steps where there is no limit at any time.
    """
    steps: list[RateStep] = []
    for one in contacts:
        step = RateStep(t_s=max(0.0, one.begin_s) if steps else 0.0, rate_bit_s=one.rate_bit_s)
        if not steps or one.begin_s <= 0:
            steps = [step]
        elif one.begin_s < duration_s and step.rate_bit_s != steps[-1].rate_bit_s:
            steps.append(step)
    return tuple(steps) if any(one.rate_bit_s < UNLIMITED_BIT_S for one in steps) else ()
