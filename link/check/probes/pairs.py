"""Probes with two frames at once: reordering."""

import math
from functools import partial

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import clustered_interval, overtaking_probabilities
from farside.link.check.lateness import hurry
from farside.link.check.lines import (
    Estimate,
    Group,
    Lines,
    Observation,
    batched,
    share_line,
    short_byte,
    unmeasured,
)
from farside.link.check.traffic.planning import Burst, Traffic, plan_bursts
from farside.link.check.traffic.reference import Bools, Ints, Phase, Reference
from farside.link.profile.rate import OPPORTUNITY_BYTE
from farside.node import to_ns

_FINEST_NS = 10_000
_TOGETHER_NS, _RARE = 2, 1e-3


def _kind(phase: Phase) -> int:
    return phase.kind


def plan_pairs(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Two frames at once, both over before the next two are sent."""

    def pair(phase: Phase, _room_ns: int) -> Burst | str:
        size = short_byte(phase)
        if phase.trace is not None and (
            phase.way.queue_frame == 1 or 2 * size > phase.way.queue_byte
        ):
            return "the queue holds one frame"
        if phase.way.slots is not None and phase.per_slot(size) < 2:
            return "a slot carries one frame"
        if hurry(phase.way.slots, _TOGETHER_NS) > _RARE:
            return "slots may open before both frames have been handed over"
        if phase.way.slots is not None and phase.trace is not None:
            return "slots hide which opportunity a frame uses"
        return Burst(size, 2, phase.busy_ns(size, 2))

    return plan_bursts(reference, rng, pair, max(1, frames // 4), _kind)


def judge_pairs(seen: Observation) -> Lines:
    """How often the second of a pair arrived first."""
    name = "pairs overtaken"
    for group in seen.groups(_kind):
        reorder = group.way.reorder
        numbers = np.flatnonzero(group.chosen)
        leaders, copies = numbers[::2], seen.arrivals.copies
        whole = leaders[(copies[leaders] == 1) & (copies[leaders + 1] >= 1)]
        if group.way.duplicate == 1:
            # The first copy of each is its own; see `farside.link.check.probes.delays`.
            whole = leaders[(copies[leaders] >= 1) & (copies[leaders + 1] >= 1)]
        jitter = group.way.jitter
        if (
            group.way.reorder is not None
            and jitter is not None
            and to_ns(jitter.spread_s) < _FINEST_NS
        ):
            why = f"jitter of {jitter.spread_s:g} s is hardly longer than what it is rounded to"
            yield group.from_s, unmeasured(name, "share", math.nan, why)
            continue
        asked = _asked(seen, group, whole)
        overtaken = seen.arrivals.overtaken[whole]
        line = share_line(name, asked, overtaken, "no pair arrived whole")
        if reorder is not None and reorder.correlation and len(overtaken):
            line = line._replace(estimate=_correlated(overtaken, reorder.correlation))
        yield group.from_s, line
    yield from seen.left_out(name, "share", lambda _way: 0.0)


def _asked(seen: Observation, group: Group, leaders: Ints) -> float:
    """The mean probability that the second of these pairs overtakes the first."""
    reorder = group.way.reorder
    if reorder is None or not len(leaders):
        return 0.0
    ahead = np.empty(len(leaders), dtype=np.int64)
    phase_of = seen.traffic.phase[leaders]
    for index in np.unique(phase_of):
        own = phase_of == index
        phase, first = seen.reference.phases[index], seen.traffic.time_ns[leaders[own]]
        left = phase.departure_ns(first, group.size_byte)
        followed = _followed_ns(phase, first, left, group.size_byte)
        delays = seen.reference.delay_ns(left), seen.reference.delay_ns(followed)
        ahead[own] = followed + delays[1] - left - delays[0]
    leads_s = (to_ns(reorder.hold_s) - ahead) / 1e9
    overtaking = float(overtaking_probabilities(group.way.jitter, leads_s).mean())
    return overtaking * reorder.share * (1 - reorder.share) * (1 - reorder.correlation)


def _correlated(overtaken: Bools, correlation: float) -> Estimate:
    """The share of pairs, which are not independent of each other."""
    rho = abs(correlation)
    pairs = np.ones(len(overtaken))
    return partial(
        clustered_interval,
        batched(overtaken.astype(np.float64)),
        batched(pairs),
        clustering=(1 + rho) / (1 - rho),
    )


def _followed_ns(phase: Phase, first_ns: Ints, left_ns: Ints, size_byte: int) -> Ints:
    """When the second of two frames leaves, handed over 1 ns after the first."""
    if phase.way.slots is not None:
        # Both wait for the same slot.
        return left_ns + phase.sending_ns(size_byte)
    second_ns = first_ns + 1
    if phase.trace is None:
        return np.maximum(left_ns, second_ns) + phase.sending_ns(size_byte)
    # It may share the last opportunity of the first one, if it waits for it.
    both = -(-2 * phase.frame_byte(size_byte) // OPPORTUNITY_BYTE)
    shared = phase.trace.time_ns(phase.trace.first_from(first_ns) + both - 1)
    waits: Bools = left_ns >= second_ns
    return np.where(waits, shared, phase.departure_ns(second_ns, size_byte))
