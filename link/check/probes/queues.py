"""Probes with more frames at once than may wait: queue, drop policy, priorities, lifetime."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval, clustered_interval, share_interval
from farside.link.check.lateness import hurry
from farside.link.check.lines import (
    CheckLine,
    Estimate,
    Group,
    Lines,
    Observation,
    believing,
    bit_error_loss,
    point,
    share_line,
    unmeasured,
)
from farside.link.check.probes.queue_model import sent_of, starts_of
from farside.link.check.traffic.planning import Burst, Traffic, plan_bursts
from farside.link.check.traffic.reference import MARGIN_NS, Bools, Phase, Reference
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.statistics import Floats, loss_statistics
from farside.node import to_ns, to_s

_OVERLOADS = 20
_WAITING = 20
"""So many frames fill the queue, or a few more."""

_FINE = 200
"""So many frames of a burst, where their lifetime is measured."""

_CROWD = 4000
_LARGEST_BYTE = 256 << 20
_MOST_FLIPS = 100_000
_FEWEST = 5.0

_TOGETHER_NS, _RARE = 2, 1e-6
_HURRIED = "slots may open before a burst of frames has been handed over"


def _kind(phase: Phase) -> int:
    return phase.rate_kind


def is_limited(phase: Phase) -> bool:
    """Whether frames have to wait in it: without a rate or slots none does."""
    limits = phase.rate_bit_s, phase.trace, phase.way.slots
    return any(limit is not None for limit in limits)


# --- planning ----------------------------------------------------------------------------------


def plan_overloads(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """More frames at once than the queue takes, by bytes."""

    def overload(phase: Phase, room_ns: int) -> Burst | str | None:
        if not is_limited(phase):
            return None
        way = phase.way
        if hurry(way.slots, _TOGETHER_NS) > _RARE:
            return _HURRIED
        waiting = min(_WAITING, max(1, (way.queue_frame or 2 * _WAITING) // 2), way.queue_byte)
        size = way.queue_byte // waiting
        if phase.trace is not None:
            size = phase.filling_byte
        return _crowd(phase, room_ns, size, min(way.queue_byte // size, way.queue_frame or 1 << 30))

    return plan_bursts(reference, rng, overload, min(_OVERLOADS, frames), _kind)


def plan_crowds(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """More frames at once than the queue takes, by number."""

    def crowd(phase: Phase, room_ns: int) -> Burst | str | None:
        way = phase.way
        if not is_limited(phase) or way.queue_frame is None or way.queue_frame > way.queue_byte:
            return None
        if hurry(way.slots, _TOGETHER_NS) > _RARE:
            return _HURRIED
        size = min(64, way.queue_byte // way.queue_frame)
        if phase.trace is not None:
            size = phase.filling_byte
        if size * way.queue_frame > way.queue_byte:
            return "so many frames of an opportunity each do not fit into the queue"
        return _crowd(phase, room_ns, size, way.queue_frame)

    return plan_bursts(reference, rng, crowd, min(_OVERLOADS, frames), _kind)


def _crowd(phase: Phase, room_ns: int, size_byte: int, waiting: int) -> Burst | str:
    """One frame, and just after it twice as many as may wait; a quarter of them are urgent."""
    if not waiting:
        return "not even one frame of an opportunity fits into the queue"
    if size_byte * waiting > _LARGEST_BYTE:
        return f"the check fills no queue with more than {_LARGEST_BYTE:,} bytes"
    frames = 1 + waiting + min(waiting, _WAITING) + 4
    if frames > _CROWD:
        return f"the check sends no more than {_CROWD:,} frames at once"
    priorities = tuple(int(place % 4 == 3) for place in range(frames))
    burst = Burst(
        size_byte,
        frames,
        phase.busy_ns(size_byte, waiting + 1),
        crowded=True,
        priorities=priorities,
    )
    return worthwhile(phase, room_ns, burst)


def plan_lifetimes(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """As many frames at once as may wait, of which some wait longer than their lifetime."""

    def waiting(phase: Phase, room_ns: int) -> Burst | str | None:
        way = phase.way
        if not is_limited(phase) or way.lifetime_s is None:
            return None
        if way.slots is not None:
            return "slots hide how long a frame waited"
        most = min(_FINE, way.queue_frame or _FINE, way.queue_byte)
        size = way.queue_byte // most
        if phase.trace is not None:
            size = phase.filling_byte
            most = min(most, way.queue_byte // size)
        if not most:
            return "not even one frame of an opportunity fits into the queue"
        if phase.rate_bit_s is not None:
            half = int(2 * way.lifetime_s * phase.rate_bit_s / (8 * most)) - way.overhead_byte
            size = max(1, min(size, half))
        burst = Burst(size, most + 1, phase.busy_ns(size, most + 1), crowded=True)
        if burst.busy_ns <= to_ns(way.lifetime_s):
            return "a full queue is sent before anything has waited so long"
        return worthwhile(phase, room_ns, burst)

    return plan_bursts(reference, rng, waiting, min(_OVERLOADS, frames), _kind)


def worthwhile(phase: Phase, room_ns: int, burst: Burst) -> Burst | str:
    """The burst, or why it would take or show too little.

    Args:
        phase: where it is to be sent.
        room_ns: the longest window there.
        burst: frames that leave one after the other.
    """
    if burst.busy_ns > room_ns - 4 * MARGIN_NS:
        return (
            f"a full queue takes {to_s(burst.busy_ns):.3g} s to be sent, and no window is longer "
            f"than {to_s(room_ns):.3g} s"
        )
    way, bits = phase.way, 8 * burst.size_byte * burst.frames
    if way.bit_errors is BitErrorEffect.FLIP and bits * way.bit_error_rate > _MOST_FLIPS:
        return "a full queue has more wrong bits than are simulated"
    spared = _spared(way, burst.size_byte)
    if burst.frames * spared < _FEWEST / _OVERLOADS:
        return "nearly all frames of such a size are lost"
    return burst


def _spared(way: OneWay, size_byte: int) -> float:
    return 1 - loss_statistics(way.loss, bit_error_loss(way, size_byte)).rate


# --- judging -----------------------------------------------------------------------------------


class _Expected(NamedTuple):
    """What the profile asks of the bursts of one kind.

    Attributes:
        sent: for each frame of the traffic, whether it is sent.
        orders: the numbers of the frames of each burst that are sent, in order.
        dropped: for each frame of the traffic, whether it is one of the kind and not sent.
    """

    sent: Bools
    orders: list[list[int]]
    dropped: Bools


def judge_overloads(seen: Observation) -> Lines:
    """How many frames of each burst passed, which, and in what order."""
    yield from _judged(seen, "queue")


def judge_crowds(seen: Observation) -> Lines:
    """The same for a queue filled by number."""
    yield from _judged(seen, "queue, by number")


def _judged(seen: Observation, name: str) -> Lines:
    for group in seen.groups(_kind):
        expected = _expected(seen, group, lifetime_ns=None)
        yield group.from_s, _passed_line(name, seen, group, expected)
        yield (
            group.from_s,
            share_line(
                f"{name}, delivered though dropped ({group.way.drop})",
                0.0,
                seen.arrivals.arrived[expected.dropped],
            ),
        )
        yield group.from_s, _turns_line(f"{name}, sent out of turn", seen, group, expected)
    yield from seen.left_out(name, "frames", lambda _way: np.nan)


def judge_lifetimes(seen: Observation) -> Lines:
    """How many frames of each burst passed within their lifetime."""
    name = "lifetime"
    for group in seen.groups(_kind):
        expected = _expected(seen, group, lifetime_ns=to_ns(group.way.lifetime_s or 0.0))
        if not expected.dropped.any():
            why = "a full queue is sent before anything has waited so long"
            yield group.from_s, unmeasured(name, "frames", np.nan, why)
            continue
        yield group.from_s, _passed_line(name, seen, group, expected)
        yield (
            group.from_s,
            share_line(
                f"{name}, delivered though expired",
                0.0,
                seen.arrivals.arrived[expected.dropped],
            ),
        )
    yield from seen.left_out(name, "frames", lambda _way: np.nan)


def _expected(seen: Observation, group: Group, lifetime_ns: int | None) -> _Expected:
    numbers, bursts = np.flatnonzero(group.chosen), seen.traffic.burst
    sent = np.zeros(len(bursts), dtype=np.bool_)
    orders: list[list[int]] = []
    firsts = np.unique(np.searchsorted(bursts, bursts[numbers]))
    known: dict[tuple[int, ...], list[int]] = {}
    for first in firsts.tolist():
        after = int(np.searchsorted(bursts, bursts[first], side="right"))
        phase = seen.reference.phases[seen.traffic.phase[first]]
        priorities = tuple(seen.traffic.priority[first:after].tolist())
        burst = Burst(group.size_byte, after - first, 0, crowded=True, priorities=priorities)
        begin_ns = int(seen.traffic.time_ns[first])
        starts_ns = starts_of(phase, burst, begin_ns)
        waiting_first = starts_ns[0] > 0
        key = (burst.frames, waiting_first, *(starts_ns if lifetime_ns is not None else ()))
        if key not in known:
            known[key] = sent_of(
                phase.way, burst, starts_ns, waiting_first=waiting_first, lifetime_ns=lifetime_ns
            )
        orders.append([first + place for place in known[key]])
        sent[orders[-1]] = True
    return _Expected(sent, orders, group.chosen & ~sent)


def _passed_line(name: str, seen: Observation, group: Group, expected: _Expected) -> CheckLine:
    """The mean number of frames that passed in a burst."""
    bursts, way = len(expected.orders), group.way
    trials = int(expected.sent.sum())
    if not trials:
        return unmeasured(name, "frames", 0.0, "every frame expires before anything is sent")
    numbers = np.flatnonzero(group.chosen)
    _, place = np.unique(seen.traffic.burst[numbers], return_inverse=True)
    arrived = seen.arrivals.arrived
    weights = arrived[numbers].astype(np.float64)
    passed = np.bincount(place, weights=weights, minlength=bursts).astype(np.float64)
    total = int(passed.sum())
    other = bit_error_loss(way, group.size_byte)
    asked = trials / bursts * (1 - loss_statistics(way.loss, other).rate)
    estimate = _passed_estimate(group, expected, passed)
    if not isinstance(way.loss, float | int):
        likelihood = seen.losses(way, other, expected.sent)
        asked = trials / bursts * (1 - likelihood.expected_share())
        believed = believing(asked, estimate, lambda: likelihood.chance(float(trials - total)))
        return CheckLine(name, "frames", bursts, point(asked), float(passed.mean()), believed)
    return CheckLine(name, "frames", bursts, point(asked), float(passed.mean()), estimate)


def _passed_estimate(group: Group, expected: _Expected, passed: Floats) -> Estimate:
    """The mean number that passes, from the share that random losses spare."""
    each = np.array([len(order) for order in expected.orders], dtype=np.float64)
    bursts, trials, total = len(each), float(each.sum()), float(passed.sum())

    def interval(miss: float) -> Interval:
        if total > trials:
            # More than can be, whatever is lost.
            return point(total / bursts)
        if isinstance(group.way.loss, float | int):
            low, high = share_interval(total, trials, miss)
        else:
            low, high = clustered_interval(np.minimum(passed, each), each, miss)
        return low * trials / bursts, high * trials / bursts

    return interval


def _turns_line(name: str, seen: Observation, group: Group, expected: _Expected) -> CheckLine:
    """How many frames arrived before one whose turn was earlier: higher in priority, or older."""
    if group.way.reorder is not None:
        return unmeasured(name, "share", 0.0, "frames that are held back hide it")
    hits = [np.empty(0, dtype=np.bool_), *_out_of_turn(seen, expected)]
    return share_line(name, 0.0, np.concatenate(hits))


def _out_of_turn(seen: Observation, expected: _Expected) -> Iterator[Bools]:
    for order in expected.orders:
        times = seen.arrivals.time_ns[order]
        times = times[times >= 0]
        yield times < np.maximum.accumulate(times)
