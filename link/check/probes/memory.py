"""Correlation from frame to frame where values are few: losses, holding back, a jitter table."""

import math
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

import numpy as np

from farside.link.check.chains import LossLikelihood
from farside.link.check.intervals import (
    Interval,
    clustered_interval,
    share_interval,
    threshold_correlation,
    threshold_share,
)
from farside.link.check.lateness import Lateness
from farside.link.check.lines import (
    CheckLine,
    Estimate,
    Group,
    Observation,
    batched,
    believing,
    point,
    unmeasured,
)
from farside.link.check.traffic.reference import Bools, Ints
from farside.link.profile.impairments import CorrelatedLoss
from farside.link.profile.statistics import Floats
from farside.node import to_ns


def repeats_line(
    name: str, model: CorrelatedLoss, again: Floats, before: Floats, chance: LossLikelihood
) -> CheckLine:
    """The correlation of what happens to successive frames, from how often it happens again.

    Args:
        name: of the line.
        model: its probability and correlation.
        again: for each frame, whether it happened to it and to the one before.
        before: for each frame, whether it happened to the one before.
        chance: how likely that is.
    """
    p, asked = model.probability, model.correlation
    hits, trials = float(again.sum()), float(before.sum())
    if not trials or p >= 1:
        return unmeasured(name, "", asked, "there was nothing to happen again" if p < 1 else "all")
    share = p + asked * (1 - p)
    shares = partial(clustered_interval, batched(again), batched(before))
    believed = believing(share, shares, lambda: chance.repeat_chance(hits, trials, share))

    def correlations(miss: float) -> Interval:
        low, high = believed(miss)
        found = (low - p) / (1 - p), (high - p) / (1 - p)
        # That of the value asked for must not be lost to rounding.
        return (min(found[0], asked), max(found[1], asked)) if low <= share <= high else found

    measured = (hits / trials - p) / (1 - p)
    return CheckLine(name, "", int(trials), point(asked), measured, correlations)


def held_lines(
    seen: Observation, group: Group, numbers: Ints, late_ns: Ints, slack_ns: int
) -> Iterator[CheckLine]:
    """How many frames are held back, and how that is correlated.

    Args:
        seen: what was sent, and how it arrived.
        group: the frames of a kind.
        numbers: those that can be timed.
        late_ns: how late each of these is.
        slack_ns: by how much that may be off.
    """
    reorder = group.way.reorder
    if reorder is None:
        return
    hold_ns, name = to_ns(reorder.hold_s), "held back"
    if Lateness(group.way).greatest_ns + 2 * slack_ns >= hold_ns:
        why = f"{reorder.hold_s:g} s are no longer than jitter, waits for slots and rounding"
        yield unmeasured(name, "share", reorder.share, why)
        if reorder.correlation:
            yield unmeasured(f"{name}, correlation", "", reorder.correlation, why)
        return
    held, counted = _marked(numbers[late_ns + slack_ns >= hold_ns], seen), _marked(numbers, seen)
    hits, count = float(held.sum()), float(counted.sum())
    estimate: Estimate = partial(share_interval, hits, count)
    if not reorder.correlation:
        yield CheckLine(name, "share", int(count), point(reorder.share), hits / count, estimate)
        return
    model = CorrelatedLoss(probability=reorder.share, correlation=reorder.correlation)
    chance = LossLikelihood(model, 0.0, _starts(seen), counted)
    clustering = max(1.0, (1 + reorder.correlation) / (1 - reorder.correlation))
    own = held[counted].astype(np.float64)
    interval = partial(
        clustered_interval, batched(own), batched(np.ones(len(own))), clustering=clustering
    )
    asked = chance.expected_share()
    believed = believing(asked, interval, lambda: chance.chance(hits))
    yield CheckLine(name, "share", int(count), point(asked), hits / count, believed)
    pairs = counted[1:] & counted[:-1]
    before = (held[:-1] & pairs)[counted[1:]].astype(np.float64)
    again = (held[1:] & held[:-1] & pairs)[counted[1:]].astype(np.float64)
    yield repeats_line(f"{name}, correlation", model, again, before, chance)


def _marked(numbers: Ints, seen: Observation) -> Bools:
    marked = np.zeros(len(seen.traffic.time_ns), dtype=np.bool_)
    marked[numbers] = True
    return marked


def _starts(seen: Observation) -> Ints:
    """For each frame, a number that changes where holding back starts anew."""
    kinds = [
        (one.way.reorder.share, one.way.reorder.correlation) if one.way.reorder else None
        for one in seen.reference.phases
    ]
    changes = [first != second for first, second in pairwise(kinds)]
    numbers: Ints = np.concatenate([[0], np.cumsum(changes)]).astype(np.int64)
    return numbers[seen.traffic.phase]


def threshold_line(name: str, asked: float, below: Floats, before: Ints) -> CheckLine:
    """The correlation of the normal scores behind few values, from how often two are both great.

    Args:
        name: of the line.
        asked: the correlation.
        below: for each frame, the probability of less than its value.
        before: which frames are followed by the next.
    """
    # Great is what lies above a value, the one that splits all most evenly.
    edges = np.unique(below[below > 1e-9])
    if not len(edges):
        return unmeasured(name, "", asked, "all frames have the same jitter")
    edge = float(edges[np.argmin(np.abs(edges - 0.5))])
    great = below >= edge - 1e-9
    both = (great[before] & great[before + 1]).astype(np.float64)
    pairs = np.ones(len(both))
    rho = abs(asked)
    interval = partial(
        clustered_interval, batched(both), batched(pairs), clustering=(1 + rho) / (1 - rho)
    )

    def correlations(miss: float) -> Interval:
        low, high = interval(miss)
        share = threshold_share(edge, asked)
        found = threshold_correlation(edge, low), threshold_correlation(edge, high)
        return (min(found[0], asked), max(found[1], asked)) if low <= share <= high else found

    share = float(both.mean())
    measured = threshold_correlation(edge, share)
    if math.isnan(measured):
        return unmeasured(name, "", asked, "too few frames have another jitter than most")
    return CheckLine(name, "", len(both), point(asked), measured, correlations)
