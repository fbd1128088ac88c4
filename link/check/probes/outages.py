"""Probes beside the edges of outages."""

import numpy as np
from numpy.random import Generator

from farside.link.check.lines import (
    CheckLine,
    Group,
    Lines,
    Observation,
    bit_error_loss,
    loss_line,
    share_line,
    short_byte,
    unmeasured,
)
from farside.link.check.traffic.planning import Burst, LeftOut, Traffic, frames_of
from farside.link.check.traffic.reference import FOREVER_NS, Bools, Ints, Phase, Reference
from farside.node import Direction

_EDGES = 200
_BESIDE = 10
_SLOT_NS = 4000


def _kind(phase: Phase) -> int:
    return phase.kind


def plan_edges(reference: Reference, frames: int, rng: Generator) -> Traffic:  # noqa: ARG001 - as others
    """Single frames just before and just after the beginning and the end of outages."""
    edges = np.unique(reference.outages_ns.ravel())
    edges = edges[edges < FOREVER_NS]
    if len(edges) > _EDGES:
        edges = edges[np.linspace(0, len(edges) - 1, _EDGES).astype(int)]
    begins = np.array([phase.begin_ns for phase in reference.phases], dtype=np.int64)
    found: list[tuple[int, Burst, Ints]] = []
    for edge in edges.tolist():
        found += _beside(reference, begins, edge)
    left_out: list[LeftOut] = []
    if len(edges) and not found:
        left_out.append(LeftOut([], "nothing can be sent beside any outage"))
    return frames_of(reference, _apart(found), left_out, _kind)


def _beside(reference: Reference, begins: Ints, edge_ns: int) -> list[tuple[int, Burst, Ints]]:
    """Single frames that would be at the rover's end just before and after a moment."""
    found: list[tuple[int, Burst, Ints]] = []
    near = np.array([edge_ns - _SLOT_NS, edge_ns + _SLOT_NS])
    for index in np.unique(np.searchsorted(begins, _sent_ns(reference, near), "right") - 1):
        if index < 0:
            continue
        phase = reference.phases[index]
        size = short_byte(phase)
        burst = Burst(size, 1, phase.busy_ns(size))
        slot_ns = _SLOT_NS + burst.busy_ns + phase.spread_ns
        if slot_ns > FOREVER_NS // (2 * _BESIDE + 4):
            continue
        slots = np.concatenate([np.arange(-_BESIDE - 1, -1), np.arange(2, _BESIDE + 2)])
        times = _sent_ns(reference, edge_ns + slots * slot_ns)
        within = (times > phase.begin_ns) & (times + slot_ns < phase.end_ns)
        found.append((int(index), burst, times[within]))
    return found


def _sent_ns(reference: Reference, at_rover_ns: Ints) -> Ints:
    """About when something is sent that is at the rover's end at these moments."""
    if reference.direction is Direction.DOWN:
        return at_rover_ns
    sent_ns = at_rover_ns - reference.delay_ns(at_rover_ns)
    # Where the delay changes, the one at the time of sending counts.
    return at_rover_ns - reference.delay_ns(np.maximum(0, sent_ns))


def _apart(found: list[tuple[int, Burst, Ints]]) -> list[tuple[int, Burst, Ints]]:
    """Without frames that would have to wait for others."""
    order = sorted(
        (time_ns, row) for row, (*_, times) in enumerate(found) for time_ns in times.tolist()
    )
    kept: list[list[int]] = [[] for _ in found]
    free_ns = 0
    for time_ns, row in order:
        if time_ns >= free_ns:
            kept[row].append(time_ns)
            free_ns = time_ns + found[row][1].busy_ns + 2
    return [
        (index, burst, np.array(times, dtype=np.int64))
        for (index, burst, _), times in zip(found, kept, strict=True)
        if times
    ]


def judge_edges(seen: Observation) -> Lines:
    """How many frames arrived in an outage, and how many right beside one."""
    if not len(seen.reference.outages_ns):
        return
    traffic, arrived = seen.traffic, seen.arrivals.arrived
    inside, clear = np.zeros_like(arrived), np.zeros_like(arrived)
    for index in np.unique(traffic.phase):
        own, phase = traffic.phase == index, seen.reference.phases[index]
        busy_ns = phase.busy_ns(short_byte(phase))
        stay = seen.reference.stay_ns(traffic.time_ns[own], busy_ns, phase.spread_ns)
        inside[own] = seen.reference.is_out(*stay)
        clear[own] = seen.reference.is_clear(*stay)
    none = next((why for _, why in traffic.left_out), "")
    yield (
        0.0,
        share_line(
            "delivered in an outage",
            0.0,
            arrived[inside],
            none or "outages are shorter than the time that a frame may be at the rover's end",
        ),
    )
    if not clear.any():
        why = none or "there is no time between outages for a frame"
        yield 0.0, unmeasured("loss beside outages", "share", 0.0, why)
    for group in seen.groups(_kind):
        beside = group.chosen & clear
        if beside.any():
            yield group.from_s, _loss_beside(seen, group, beside)


def _loss_beside(seen: Observation, group: Group, beside: Bools) -> CheckLine:
    other = bit_error_loss(group.way, group.size_byte)
    return loss_line("loss beside outages", group.way, other, seen, beside)
