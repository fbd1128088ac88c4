"""Delay and jitter, from frames that do not affect each other."""

import math
from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from farside.link.check.intervals import (
    Interval,
    correlation_interval,
    kolmogorov_distance,
    kolmogorov_limit,
    normal_scores,
)
from farside.link.check.lateness import Lateness
from farside.link.check.lines import CheckLine, Group, Observation, point, share_line, unmeasured
from farside.link.check.probes.memory import held_lines, threshold_line
from farside.link.check.traffic.reference import Bools, Ints
from farside.link.profile.config import OneWay
from farside.link.profile.impairments import Jitter, JitterShape
from farside.link.profile.jitter import table_ns
from farside.link.profile.statistics import jitter_cdf
from farside.node import to_ns, to_s

_TAIL = 0.005
"""The share of frames that come latest, and are counted."""

_HEAVY = 0.002
"""Up to this share of equal values, each stands for one normal score."""

_ROUNDING_NS = 2
"""Ends of frames, delays, jitter and holding back are each rounded to a nanosecond."""

_FINEST = 1000
"""A correlation shows only in jitter that is so many times as long as what is not known of it."""


class Late(NamedTuple):
    """Frames that arrived, and how late after the time that rate and propagation give.

    Attributes:
        numbers: which frames.
        asked_s: the mean propagation delay asked for.
        rest_ns: the delay on top of it.
        slack_ns: by how much that may be off.
    """

    numbers: Ints
    asked_s: float
    rest_ns: Ints
    slack_ns: Ints


def delay_lines(seen: Observation, group: Group) -> Iterator[CheckLine]:
    """Delay, and jitter if there is any."""
    way, arrived = group.way, _to_be_timed(seen, group)
    if way.slots is not None and way.rate_trace is not None:
        yield unmeasured("delay", "s", math.nan, "slots hide which opportunity a frame uses")
        return
    if not arrived.any():
        yield unmeasured("delay", "s", math.nan, "no frame arrived")
        return
    late = _late(seen, arrived)
    lateness = Lateness(way)
    yield _exact_line(late) if lateness.is_none else _least_line(lateness, late)
    if way.jitter is not None or way.slots is not None:
        yield from _distribution_lines(way, lateness, late)
    if way.jitter is not None:
        yield _correlation_line(way, way.jitter, lateness, late)
    if way.reorder is not None:
        yield from held_lines(seen, group, late.numbers, late.rest_ns, int(late.slack_ns.max()))


def delay_line(seen: Observation, group: Group) -> CheckLine:
    """The delay alone."""
    return next(delay_lines(seen, group))


def _to_be_timed(seen: Observation, group: Group) -> Bools:
    """Frames whose first arrival is their own, not their duplicate's."""
    once = group.chosen & (seen.arrivals.copies == 1)
    # A duplicate is never earlier, so where nearly all are duplicated their first arrivals serve.
    return once if once.any() else group.chosen & seen.arrivals.arrived


def _late(seen: Observation, arrived: Bools) -> Late:
    asked, rest, slack = [], [], []
    phase_of = seen.traffic.phase[arrived]
    for index in np.unique(phase_of):
        phase, own = seen.reference.phases[index], np.flatnonzero(arrived)[phase_of == index]
        size = int(seen.traffic.size_byte[own][0])
        sent_ns = seen.traffic.time_ns[own]
        left_ns = phase.departure_ns(sent_ns, size)
        asked.append(seen.reference.delay_ns(left_ns))
        rest.append(seen.arrivals.time_ns[own] - left_ns - asked[-1])
        # The delay may be that of the first bit or of the last.
        latest_ns = left_ns + phase.waits_ns(size)
        least, greatest = seen.reference.delay_range_ns(sent_ns, latest_ns)
        slack.append(_ROUNDING_NS + greatest - least)
    return Late(
        np.flatnonzero(arrived),
        float(np.concatenate(asked).mean()) / 1e9,
        np.concatenate(rest),
        np.concatenate(slack),
    )


def _exact_line(late: Late) -> CheckLine:
    """The delay without anything on top: that of the frame that is furthest off counts."""
    asked_s = late.asked_s
    low_s, high_s = (
        asked_s + float(late.rest_ns.min()) / 1e9,
        asked_s + float(late.rest_ns.max()) / 1e9,
    )
    worst = int(np.argmax(np.abs(late.rest_ns) - late.slack_ns))
    off_ns, slack_ns = int(late.rest_ns[worst]), int(late.slack_ns[worst])
    if abs(off_ns) > slack_ns:
        low_s, high_s = (asked_s + (off_ns + reach) / 1e9 for reach in (-slack_ns, slack_ns))
    else:
        low_s, high_s = min(low_s, asked_s), max(high_s, asked_s)
    measured = asked_s + float(late.rest_ns.mean()) / 1e9
    return CheckLine(
        "delay", "s", len(late.rest_ns), point(asked_s), measured, lambda _miss: (low_s, high_s)
    )


def _least_line(lateness: Lateness, late: Late) -> CheckLine:
    """The delay below all that is random: from the frame that was the least late."""
    least = int(np.argmin(late.rest_ns))
    least_ns, slack_ns = int(late.rest_ns[least]), int(late.slack_ns.max())
    effective = max(1, len(late.rest_ns) // lateness.spacing)

    def located(miss: float) -> Interval:
        # The least of the delays on top exceeds this quantile with probability `miss`.
        reach_ns = lateness.quantile_ns(-math.expm1(math.log(miss) / effective))
        low_s = to_s(least_ns - reach_ns - slack_ns)
        return late.asked_s + low_s, late.asked_s + to_s(least_ns + slack_ns)

    return CheckLine(
        "delay",
        "s",
        len(late.rest_ns),
        point(late.asked_s),
        late.asked_s + to_s(least_ns),
        located,
    )


def _distribution_lines(way: OneWay, lateness: Lateness, late: Late) -> Iterator[CheckLine]:
    """Whether the delay on top has its distribution: by Kolmogorov and Smirnov, and in its tail."""
    below = lateness.below(late.rest_ns - late.slack_ns)
    above = lateness.cdf(late.rest_ns + late.slack_ns)
    apart = late.numbers % lateness.spacing == late.numbers[0] % lateness.spacing
    count = int(apart.sum())
    distance = kolmogorov_distance(below[apart], above[apart])

    def distances(miss: float) -> Interval:
        limit = kolmogorov_limit(count, miss)
        return max(0.0, distance - limit), distance + limit

    parts = [("jitter", way.jitter), ("waits for slots", way.slots)]
    name = " and ".join(part for part, there in parts if there is not None)
    yield CheckLine(f"{name}, distance", "", count, point(0), distance, distances)
    # The distance hardly tells of what is rare, however long.
    edge_ns, slack_ns = lateness.quantile_ns(1 - _TAIL), int(late.slack_ns.max())
    tail = share_line(f"{name}, tail", 0.0, late.rest_ns[apart] > edge_ns)
    reach = 1 - lateness.cdf(np.array([edge_ns + slack_ns, edge_ns - slack_ns]))
    yield tail._replace(asked=(float(reach[0]), float(reach[1])))


def _correlation_line(way: OneWay, jitter: Jitter, lateness: Lateness, late: Late) -> CheckLine:
    name, asked = "jitter, correlation", jitter.correlation
    if way.reorder is not None:
        return unmeasured(name, "", asked, "frames that are held back hide it")
    if way.slots is not None:
        return unmeasured(name, "", asked, "waits for slots hide it")
    if to_ns(jitter.spread_s) < _FINEST * int(late.slack_ns.max()):
        why = f"jitter of {jitter.spread_s:g} s is hardly longer than what it is rounded to"
        return unmeasured(name, "", asked, why)
    before = np.flatnonzero(np.diff(late.numbers) == 1)
    if len(before) <= 10:
        return unmeasured(name, "", asked, "too few frames arrived one after the other")
    below, above = lateness.below(late.rest_ns - 1), lateness.cdf(late.rest_ns + 1)
    if _heaviest(jitter) > _HEAVY:
        return threshold_line(name, asked, below, before)
    scores = normal_scores((below + above) / 2)
    first, second = scores[before], scores[before + 1]
    estimate = partial(correlation_interval, first, second, asked)
    measured = float(first @ second) / float(first @ first)
    return CheckLine(name, "", len(before), point(asked), measured, estimate)


def _heaviest(jitter: Jitter) -> float:
    """The share of the frames that have the most frequent jitter."""
    if jitter.shape is JitterShape.TABLE:
        return max(Counter(table_ns(jitter)).values()) / len(jitter.table)
    return float(jitter_cdf(jitter, np.zeros(1))[0])
