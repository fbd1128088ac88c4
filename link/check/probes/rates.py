"""Probes with many frames at once: the rate, or the opportunities of a trace."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval
from farside.link.check.lines import (
    CheckLine,
    Group,
    Lines,
    Observation,
    point,
    share_line,
    short_byte,
    sparing_byte,
    unmeasured,
)
from farside.link.check.traffic.planning import Burst, Traffic, plan_bursts
from farside.link.check.traffic.reference import MARGIN_NS, Ints, Phase, Reference
from farside.node import to_s

_TRAINS = 20
_LONGEST = 400
_LARGEST_BYTE = 10_000


def _kind(phase: Phase) -> int:
    return phase.rate_kind


def plan_trains(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Bursts of as many frames as surely fit into the queue."""
    return plan_bursts(reference, rng, _train, min(_TRAINS, frames), _kind)


def _train(phase: Phase, room_ns: int) -> Burst | str | None:
    if phase.trace is not None:
        return _one_each(phase, room_ns)
    # Where arrivals are spread, a single long frame tells more: see `plan_long_singles`.
    if phase.rate_bit_s is None or phase.spreads:
        return None
    largest = min(_LARGEST_BYTE, max(8, phase.way.queue_byte // 10), 8 * sparing_byte(phase.way))
    for size in (min(largest, phase.way.queue_byte), short_byte(phase), 1):
        # One more, which is being sent and does not wait.
        most = min(_capacity(phase, size) + 1, _LONGEST)
        fitting = min(most, (room_ns - 4 * MARGIN_NS) // (phase.busy_ns(size) + 1))
        if fitting >= 2:
            return Burst(size, fitting, phase.busy_ns(size, fitting))
    return (
        f"two frames take {to_s(phase.busy_ns(1, 2)):.3g} s to be sent, and no window is longer "
        f"than {to_s(room_ns):.3g} s"
    )


def _one_each(phase: Phase, room_ns: int) -> Burst | str:
    """A burst on a trace: frames that share no opportunity, or one alone."""
    if phase.way.slots is not None:
        return "slots hide which opportunity a frame uses"
    size = min(phase.way.queue_byte, phase.filling_byte)
    if 8 * sparing_byte(phase.way) < size:
        size = short_byte(phase)
    frames = min(_capacity(phase, size), _LONGEST) if size == phase.filling_byte else 1
    while frames > 1 and phase.busy_ns(size, frames) > room_ns - 4 * MARGIN_NS:
        frames //= 2
    return Burst(size, frames, phase.busy_ns(size, frames))


def _capacity(phase: Phase, size_byte: int) -> int:
    """How many frames may wait in the queue, by bytes and by number."""
    return min(phase.way.queue_byte // size_byte, phase.way.queue_frame or 1 << 30)


def judge_trains(seen: Observation) -> Lines:
    """At what rate the frames of a burst passed, or at which opportunities."""
    for group in seen.groups(_kind):
        line = _trace_line if group.phases[0].trace else _rate_line
        yield group.from_s, line(seen, group)
    for phases, why in seen.traffic.left_out:
        rate = phases[0].rate_bit_s if phases else math.nan
        from_s = to_s(phases[0].begin_ns) if phases else 0.0
        if rate is None:
            yield from_s, unmeasured("opportunities missed", "share", 0.0, why)
        else:
            yield from_s, unmeasured("rate", "bit/s", rate, why)


def _rate_line(seen: Observation, group: Group) -> CheckLine:
    """The rate between the first and the last frame of a burst that arrived."""
    rate, phase = group.phases[0].rate_bit_s or 0, group.phases[0]
    bits = took_ns = rounded_ns = 0
    for own, offsets in _bursts(seen, group):
        ends, places = own[[0, -1]], offsets[[0, -1]]
        # Where a window is short, its frames are.
        size = int(seen.traffic.size_byte[own[0]])
        left_ns = seen.traffic.time_ns[ends] - places + (places + 1) * phase.sending_ns(size)
        between = int(places[1] - places[0])
        bits += between * 8 * phase.frame_byte(size)
        arrived_ns = seen.arrivals.time_ns[ends] - seen.reference.delay_ns(left_ns)
        took_ns += int(arrived_ns[1] - arrived_ns[0])
        # The end of each frame and its propagation delay are rounded to nanoseconds.
        rounded_ns += between + 2
    if not bits:
        return unmeasured("rate", "bit/s", rate, "no two frames of a burst arrived")

    def rates(_miss: float) -> Interval:
        return _per_s(bits, took_ns + rounded_ns), _per_s(bits, took_ns - rounded_ns)

    frames = int(group.chosen.sum())
    return CheckLine("rate", "bit/s", frames, point(rate), _per_s(bits, took_ns), rates)


def _per_s(bits: int, took_ns: int) -> float:
    return bits * 1e9 / took_ns if took_ns > 0 else math.inf


def _trace_line(seen: Observation, group: Group) -> CheckLine:
    """Whether frames of the size of an opportunity each left at their own, one after the other."""
    phase = group.phases[0]
    missed = [np.empty(0, dtype=np.bool_)]
    trace = phase.trace
    for own, offsets in _bursts(seen, group, least=1):
        if trace is None:
            break
        needed = trace.needed(phase.frame_byte(group.size_byte))
        begun = trace.first_from(seen.traffic.time_ns[own[:1]] - offsets[:1])
        left_ns = trace.time_ns(begun + (offsets + 1) * needed - 1)
        rest_ns = seen.arrivals.time_ns[own] - left_ns - seen.reference.delay_ns(left_ns)
        missed.append((rest_ns < -2) | (rest_ns > phase.spread_ns + 2))
    return share_line("opportunities missed", 0.0, np.concatenate(missed), "no frame arrived")


def _bursts(seen: Observation, group: Group, least: int = 2) -> Iterator[tuple[Ints, Ints]]:
    """The frames of each burst that arrived, and their places in it."""
    numbers, bursts = np.flatnonzero(group.chosen), seen.traffic.burst
    firsts = np.searchsorted(bursts, bursts[numbers])
    arrived = seen.arrivals.copies[numbers] > 0
    numbers, firsts = numbers[arrived], firsts[arrived]
    edges = np.flatnonzero(np.diff(firsts, prepend=-1, append=-1))
    for begin, end in pairwise(edges.tolist()):
        if end - begin >= least:
            own = numbers[begin:end]
            yield own, own - firsts[begin:end]
