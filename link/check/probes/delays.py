"""Delay and jitter, from frames that do not affect each other."""

import math
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
from farside.link.check.lines import CheckLine, Group, Observation, point, quantile, unmeasured
from farside.link.check.traffic.reference import Bools, Ints
from farside.link.profile.config import OneWay
from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_cdf
from farside.node import to_ns, to_s

_NEGLIGIBLE = 0.01
"""Correlation below which samples count as independent."""

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
    if not arrived.any():
        yield unmeasured("delay", "s", math.nan, "no frame arrived")
        return
    late = _late(seen, arrived)
    yield (
        _exact_line(late) if way.jitter is None and way.reorder is None else _least_line(way, late)
    )
    if way.jitter is not None:
        yield from _jitter_lines(way, way.jitter, late)


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
        least, greatest = seen.reference.delay_range_ns(sent_ns, left_ns)
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


def _least_line(way: OneWay, late: Late) -> CheckLine:
    """The delay below all jitter: from the frame with the least on top of it."""
    least = int(np.argmin(late.rest_ns))
    least_s, slack_s = to_s(int(late.rest_ns[least])), to_s(int(late.slack_ns.max()))
    spacing = 1 if way.jitter is None else _spacing(way.jitter)
    effective = max(1, len(late.rest_ns) // spacing)

    def located(miss: float) -> Interval:
        # The least of the delays on top exceeds this quantile with probability `miss`.
        reach_s = _quantile_on_top(way, -math.expm1(math.log(miss) / effective))
        asked_s = late.asked_s + least_s
        return asked_s - reach_s - slack_s, asked_s + slack_s

    return CheckLine(
        "delay",
        "s",
        len(late.rest_ns),
        point(late.asked_s),
        late.asked_s + least_s,
        located,
    )


def _quantile_on_top(way: OneWay, probability: float) -> float:
    """What jitter and holding back add in seconds, at most, with this probability."""
    share, hold_s = (way.reorder.share, way.reorder.hold_s) if way.reorder else (0.0, 0.0)

    def of_jitter(part: float) -> float:
        return 0.0 if way.jitter is None else quantile(way.jitter, part)

    if probability <= 1 - share:
        return of_jitter(probability / (1 - share)) if share < 1 else of_jitter(probability)
    return hold_s + of_jitter((probability - (1 - share)) / share)


def _jitter_lines(way: OneWay, jitter: Jitter, late: Late) -> Iterator[CheckLine]:
    below = _on_top_cdf(way, jitter, late.rest_ns - late.slack_ns)
    above = _on_top_cdf(way, jitter, late.rest_ns + late.slack_ns)
    apart = late.numbers % _spacing(jitter) == late.numbers[0] % _spacing(jitter)
    count = int(apart.sum())
    distance = kolmogorov_distance(below[apart], above[apart])

    def distances(miss: float) -> Interval:
        limit = kolmogorov_limit(count, miss)
        return max(0.0, distance - limit), distance + limit

    yield CheckLine("jitter, distance", "", count, point(0), distance, distances)
    yield _correlation_line(way, jitter, late, (below + above) / 2)


def _correlation_line(way: OneWay, jitter: Jitter, late: Late, probabilities: Floats) -> CheckLine:
    name, asked = "jitter, correlation", jitter.correlation
    if way.reorder is not None:
        return unmeasured(name, "", asked, "frames that are held back hide it")
    if to_ns(jitter.spread_s) < _FINEST * int(late.slack_ns.max()):
        why = f"jitter of {jitter.spread_s:g} s is hardly longer than what it is rounded to"
        return unmeasured(name, "", asked, why)
    before = np.flatnonzero(np.diff(late.numbers) == 1)
    if len(before) <= 10:
        return unmeasured(name, "", asked, "too few frames arrived one after the other")
    scores = normal_scores(probabilities)
    first, second = scores[before], scores[before + 1]
    estimate = partial(correlation_interval, first, second, asked)
    measured = float(first @ second) / float(first @ first)
    return CheckLine(name, "", len(before), point(asked), measured, estimate)


def _on_top_cdf(way: OneWay, jitter: Jitter, rest_ns: Ints) -> Floats:
    """Probability that jitter and holding back add no more than this."""
    free = jitter_cdf(jitter, rest_ns / 1e9)
    if way.reorder is None:
        return free
    held = jitter_cdf(jitter, (rest_ns - to_ns(way.reorder.hold_s)) / 1e9)
    return (1 - way.reorder.share) * free + way.reorder.share * held


def _spacing(jitter: Jitter) -> int:
    """How many frames apart jitter is practically independent."""
    rho = abs(jitter.correlation)
    return max(1, math.ceil(math.log(_NEGLIGIBLE) / math.log(rho))) if rho > _NEGLIGIBLE else 1
