"""Probes with many frames at once, and beside outages: rate, trace, queue, outages."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval, clustered_interval, share_interval
from farside.link.check.lines import (
    SHORT_BYTE,
    CheckLine,
    Observation,
    bit_error_loss,
    fitting,
    groups,
    impairment_key,
    loss_line,
    plan_bursts,
    point,
    rate_key,
    share_line,
)
from farside.link.check.probe import (
    Bools,
    Phase,
    Reference,
    Traffic,
    opportunities_ns,
)
from farside.link.profile.impairments import LossModel
from farside.link.profile.rate import OPPORTUNITY_BYTE
from farside.link.profile.statistics import Floats, loss_statistics
from farside.node import Direction, to_ns, to_s

_TRAINS = 20
_OVERLOADS = 20
_EDGES = 200
_BESIDE = 10


def plan_trains(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Bursts of as many frames as surely fit into the queue."""
    return plan_bursts(reference, rng, _train, min(_TRAINS, frames), key=rate_key)


def _train(phase: Phase) -> tuple[int, int]:
    way, size = phase.way, fitting(phase, max(8, phase.way.queue_byte // 10))
    if way.rate_trace is not None:
        size = max(1, min(way.queue_byte, OPPORTUNITY_BYTE - way.overhead_byte))
    if phase.rate_bit_s is None and way.rate_trace is None:
        return size, 0
    return size, min(_capacity(phase, size), 400)


def _capacity(phase: Phase, size_byte: int) -> int:
    """How many frames may wait in the queue: by bytes, by number and by lifetime."""
    limits = [phase.way.queue_byte // size_byte, phase.way.queue_frame or 1 << 30]
    if phase.way.lifetime_s is not None and phase.rate_bit_s:
        limits.append(to_ns(phase.way.lifetime_s) // phase.sending_ns(size_byte))
    return min(limits)


def judge_trains(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """At what rate the frames of a burst passed, or at which opportunities."""
    for chosen, phases in groups(seen, rate_key):
        judge = _rate_line if phases[0].rate_bit_s else _trace_line
        line = judge(phases[0], seen, chosen)
        if line is not None:
            yield to_s(phases[0].begin_ns), line


def _rate_line(phase: Phase, seen: Observation, chosen: Bools) -> CheckLine | None:
    """The rate between the first and the last frame of a burst that arrived.

    `None` where arrivals are spread: there a single long frame tells more (`judge_long_singles`).
    """
    if phase.spread_ns:
        return None
    bits, took_ns, rate = 0, 0, phase.rate_bit_s or 0
    size = int(seen.traffic.size_byte[chosen][0])
    first = int(np.flatnonzero(chosen)[0])
    numbers = np.flatnonzero(chosen & (seen.arrivals.copies > 0))
    for burst in np.unique(seen.traffic.burst[chosen]):
        own = numbers[seen.traffic.burst[numbers] == burst][[0, -1]]
        offsets = own - first - np.searchsorted(seen.traffic.burst[chosen], burst)
        left_ns = seen.traffic.time_ns[own] + (offsets + 1) * phase.sending_ns(size)
        bits += int(own[1] - own[0]) * 8 * (size + phase.way.overhead_byte)
        took_ns += int(np.diff(seen.arrivals.time_ns[own] - seen.reference.delay_ns(left_ns))[0])
    if took_ns <= 0:
        return None
    frames = int(chosen.sum())

    def rates(_miss: float) -> Interval:
        # The end of each frame and its propagation delay are rounded to nanoseconds.
        return bits * 1e9 / (took_ns + 2 * frames), bits * 1e9 / (took_ns - 2 * frames)

    return CheckLine("rate", "bit/s", frames, point(rate), bits * 1e9 / took_ns, rates)


def _trace_line(phase: Phase, seen: Observation, chosen: Bools) -> CheckLine | None:
    """Whether frames of the size of an opportunity each left at their own, one after the other."""
    lone = chosen & (seen.arrivals.copies == 1)
    numbers, bursts = np.flatnonzero(lone), seen.traffic.burst
    if not len(numbers):
        return None
    first = np.searchsorted(bursts[chosen], bursts[numbers]) + np.flatnonzero(chosen)[0]
    count = int((numbers - first).max()) + 1
    opportunities = opportunities_ns(phase.way, seen.traffic.time_ns[first], count)
    left_ns = opportunities[np.arange(len(numbers)), numbers - first]
    rest_ns = seen.arrivals.time_ns[numbers] - left_ns - seen.reference.delay_ns(left_ns)
    missed = (rest_ns < -2) | (rest_ns > phase.spread_ns + 2)
    return share_line("opportunities missed", 0.0, missed)


def plan_overloads(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Bursts of more frames than the queue takes."""

    def overload(phase: Phase) -> tuple[int, int]:
        size, train = _train(phase)
        if not train:
            return size, 0
        if phase.rate_bit_s:
            size = max(8, phase.way.queue_byte // 20)
        return size, 2 * _capacity(phase, size) + 4

    return plan_bursts(reference, rng, overload, min(_OVERLOADS, frames), key=rate_key)


def judge_overloads(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """How many frames of each burst passed: those that may wait, and perhaps the one being sent."""
    for chosen, phases in groups(seen, rate_key):
        size = int(seen.traffic.size_byte[chosen][0])
        bursts, way = seen.traffic.burst[chosen], phases[0].way
        passed: Floats = np.bincount(
            bursts - bursts[0], weights=seen.arrivals.arrived[chosen].astype(np.float64)
        ).astype(np.float64)
        spared = 1 - loss_statistics(way.loss, bit_error_loss(way, size)).rate
        capacity = _capacity(phases[0], size)
        line = CheckLine(
            impairment="queue",
            unit="frames",
            frames=len(passed),
            asked=(capacity * spared, (capacity + 1) * spared),
            measured=float(passed.mean()),
            estimate=partial(_mean_passed, way.loss, passed),
        )
        yield to_s(phases[0].begin_ns), line


def _mean_passed(loss: LossModel, passed: Floats, miss: float) -> Interval:
    """As a share of the most that ever passed, since random losses come on top."""
    most = np.full(len(passed), max(1.0, passed.max()))
    if isinstance(loss, float):
        low, high = share_interval(float(passed.sum()), float(most.sum()), miss)
    else:
        low, high = clustered_interval(passed, most, miss)
    return low * most[0], high * most[0]


# --- outages -----------------------------------------------------------------------------------


def plan_edges(reference: Reference, frames: int, rng: Generator) -> Traffic:  # noqa: ARG001 - as others
    """Single frames just before and just after the beginning and the end of outages."""
    edges = sorted({edge for outage in reference.outages for edge in outage})[:_EDGES]
    found: list[tuple[int, int]] = []
    for index, phase in enumerate(reference.phases):
        size = fitting(phase, SHORT_BYTE)
        slot_ns = 4000 + int((phase.sending_ns(size) + phase.spread_ns) * (1 + 2 * reference.slope))
        slots = np.concatenate([np.arange(-_BESIDE - 1, -1), np.arange(2, _BESIDE + 2)])
        for edge in edges:
            targets = edge + slots * slot_ns
            lead = reference.delay_ns(targets) if reference.direction is Direction.UP else 0
            times = targets - lead
            ends = times + slot_ns
            own = times[(times > phase.begin_ns) & (ends < phase.end_ns)]
            found += [(int(time_ns), index) for time_ns in own]
    kept: list[tuple[int, int, int]] = []
    for time_ns, index in sorted(found):
        phase = reference.phases[index]
        size = fitting(phase, SHORT_BYTE)
        busy_ns = phase.sending_ns(size) + phase.spread_ns
        if not kept or time_ns > kept[-1][0] + busy_ns:
            kept.append((time_ns, index, size))
    columns = np.array(kept, dtype=np.int64).reshape(-1, 3).T
    return Traffic(columns[0], columns[2], columns[1], np.arange(len(kept)))


def judge_edges(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """How many frames arrived in an outage, and how many right beside one."""
    traffic, arrived = seen.traffic, seen.arrivals.arrived
    inside, clear = np.zeros_like(arrived), np.zeros_like(arrived)
    for index, phase in enumerate(seen.reference.phases):
        own = traffic.phase == index
        size = fitting(phase, SHORT_BYTE)
        stay = seen.reference.stay_ns(phase, traffic.time_ns[own], size)
        if seen.reference.outages and own.any():
            inside[own] = seen.reference.is_out(*stay)
            clear[own] = seen.reference.is_clear(*stay)
    if inside.any():
        yield 0.0, share_line("delivered in an outage", 0.0, arrived[inside])
    if clear.any():
        way = seen.reference.phases[int(traffic.phase[clear][0])].way
        one_way = all(
            impairment_key(p) == impairment_key(seen.reference.phases[0])
            for p in seen.reference.phases
        )
        if one_way:
            rate = loss_statistics(way.loss, bit_error_loss(way, SHORT_BYTE)).rate
            yield 0.0, loss_line("loss beside outages", rate, arrived[clear], way)
