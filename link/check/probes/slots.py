"""Probes with frames at once, of which each slot lets some through."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval, kolmogorov_distance, kolmogorov_limit
from farside.link.check.lateness import Lateness, hurry
from farside.link.check.lines import (
    CheckLine,
    Group,
    Lines,
    Observation,
    point,
    share_line,
    short_byte,
    unmeasured,
)
from farside.link.check.traffic.planning import Burst, Traffic, plan_bursts
from farside.link.check.traffic.reference import MARGIN_NS, Ints, Phase, Reference
from farside.link.profile.config import OneWay

_BURSTS = 1000
_MOST = 200
_TOGETHER = 3
_ROUNDING_NS = 4
_RARE = 1e-3

_WAITS, _OTHERS = "waits for slots, within bursts", "frames outside their slot"


def _kind(phase: Phase) -> int:
    return phase.rate_kind


def plan_slots(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Frames at once for two slots and a part of the third, or as many as the queue holds."""
    return plan_bursts(reference, rng, _burst, max(1, min(_BURSTS, frames // 10)), _kind)


def _burst(phase: Phase, room_ns: int) -> Burst | str | None:
    way = phase.way
    if way.slots is None:
        return None
    if phase.trace is not None:
        return "opportunities hide when slots open"
    if phase.spread_ns:
        return "jitter and frames that are held back hide when slots open"
    size = short_byte(phase)
    per_slot = phase.per_slot(size)
    frames = 2 * per_slot + 1 if 2 * per_slot < _MOST else _TOGETHER
    frames = min(frames, way.queue_byte // size, way.queue_frame or frames)
    while frames > 1 and phase.busy_ns(size, frames) > room_ns - 4 * MARGIN_NS:
        frames = (frames + 1) // 2
    if hurry(way.slots, frames + 2 * _ROUNDING_NS) > _RARE:
        return "slots may open before a burst of frames has been handed over"
    return Burst(size, frames, phase.busy_ns(size, frames))


class _Seen(NamedTuple):
    """Slots as they were seen in a burst.

    Attributes:
        waits_ns: how long after it was asked for each slot opened, at the least.
        slack_ns: by how much it may have been more.
        strays: for each frame, whether it did not leave with the first of its slot.
    """

    waits_ns: list[int]
    slack_ns: int
    strays: list[bool]


def judge_slots(seen: Observation) -> Lines:
    """How long transmitters waited for slots, and whether each let its frames through."""
    for group in seen.groups(_kind):
        bursts = list(_bursts(seen, group))
        strays = [stray for one in bursts for stray in one.strays]
        yield group.from_s, _waits_line(group.way, bursts)
        hits = np.array(strays, dtype=np.bool_)
        yield group.from_s, share_line(_OTHERS, 0.0, hits, "no two frames of a slot arrived")
    yield from seen.left_out(_WAITS, "", lambda _way: 0.0)


def _waits_line(way: OneWay, bursts: list[_Seen]) -> CheckLine:
    waits = np.array([ns for one in bursts for ns in one.waits_ns], dtype=np.int64)
    slack = np.array([one.slack_ns for one in bursts for _ in one.waits_ns], dtype=np.int64)
    count = len(waits)
    if not count:
        return unmeasured(_WAITS, "", 0.0, "no frame arrived that waited for longer than a moment")
    lateness = Lateness(way)
    distance = kolmogorov_distance(lateness.below(waits), lateness.cdf(waits + slack))

    def distances(miss: float) -> Interval:
        limit = kolmogorov_limit(count, miss)
        return max(0.0, distance - limit), distance + limit

    return CheckLine(f"{_WAITS}, distance", "", count, point(0), distance, distances)


def _bursts(seen: Observation, group: Group) -> Iterator[_Seen]:
    numbers, bursts = np.flatnonzero(group.chosen), seen.traffic.burst
    firsts = np.unique(np.searchsorted(bursts, bursts[numbers]))
    for first in firsts.tolist():
        after = int(np.searchsorted(bursts, bursts[first], side="right"))
        phase = seen.reference.phases[seen.traffic.phase[first]]
        found = _slots_of(seen, phase, np.arange(first, after), group.size_byte)
        if found is not None:
            yield found


def _slots_of(seen: Observation, phase: Phase, own: Ints, size_byte: int) -> _Seen | None:
    """The slots of a burst; `None` if its first one opened before all had been handed over."""
    reference, per_slot = seen.reference, phase.per_slot(size_byte)
    sending_ns, sent_ns = phase.sending_ns(size_byte), int(seen.traffic.time_ns[own[0]])
    places = np.flatnonzero(seen.arrivals.arrived[own])
    if not len(places):
        return None
    busy_ns = phase.busy_ns(size_byte, len(own))
    least, greatest = reference.delay_range_ns(np.array([sent_ns]), np.array([sent_ns + busy_ns]))
    slack_ns = _ROUNDING_NS + 2 * int(greatest[0] - least[0])
    # When the slot of each frame opened: at the least, if the delay was the longest.
    ends_ns = seen.arrivals.time_ns[own[places]] - int(greatest[0])
    opens_ns = ends_ns - (places % per_slot + 1) * sending_ns
    if int(opens_ns.min()) < sent_ns + len(own) + slack_ns:
        return None
    waits: list[int] = []
    strays: list[bool] = []
    before, asked_ns = -1, sent_ns
    for slot in np.unique(places // per_slot).tolist():
        opened = opens_ns[places // per_slot == slot].tolist()
        strays += [abs(ns - opened[0]) > slack_ns for ns in opened[1:]]
        if slot == before + 1:
            waits.append(opened[0] - asked_ns - slack_ns)
        before, asked_ns = slot, opened[0] + per_slot * sending_ns
    return _Seen(waits, 2 * slack_ns, strays)
