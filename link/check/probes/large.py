"""Probes with frames larger than the transmit queue, which pass while the line is free."""

import numpy as np
from numpy.random import Generator

from farside.link.check.lines import (
    Group,
    Lines,
    Observation,
    bit_error_loss,
    loss_line,
    share_line,
)
from farside.link.check.probes.queues import is_limited, worthwhile
from farside.link.check.traffic.planning import Burst, Traffic, plan_bursts
from farside.link.check.traffic.reference import Bools, Phase, Reference
from farside.link.profile.statistics import loss_statistics

_PAIRS = 20
_LARGEST_BYTE = 4 << 20
_FREE, _BUSY = "loss of what is larger than the queue", "larger than the queue, on a busy line"


def _kind(phase: Phase) -> int:
    return phase.rate_kind


def plan_large(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Two frames, each larger than the queue: only the first of them finds the line free."""

    def pair(phase: Phase, room_ns: int) -> Burst | str | None:
        if not is_limited(phase):
            return None
        size = phase.way.queue_byte + 1
        if size > _LARGEST_BYTE:
            return f"the check sends no frame of more than {_LARGEST_BYTE:,} bytes"
        return worthwhile(phase, room_ns, Burst(size, 2, phase.busy_ns(size, 2)))

    return plan_bursts(reference, rng, pair, min(_PAIRS, frames), _kind)


def judge_large(seen: Observation) -> Lines:
    """How many of the first ones were lost, and how many of the second ones were not."""
    for group in seen.groups(_kind):
        free, busy = _halves(seen, group)
        other = bit_error_loss(group.way, group.size_byte)
        yield group.from_s, loss_line(_FREE, group.way, other, seen, free)
        why = "such a frame leaves before the next one can come"
        yield group.from_s, share_line(_BUSY, 0.0, seen.arrivals.arrived[busy], why)
    yield from seen.left_out(
        _FREE, "share", lambda way: loss_statistics(way.loss, bit_error_loss(way, 1)).rate
    )


def _halves(seen: Observation, group: Group) -> tuple[Bools, Bools]:
    """The frames that found the line free, and those that surely did not."""
    free, busy = np.zeros_like(group.chosen), np.zeros_like(group.chosen)
    numbers = np.flatnonzero(group.chosen)
    firsts, seconds = numbers[::2], numbers[1::2]
    free[firsts] = True
    # Phases of a kind differ in time alone.
    sent_ns = seen.traffic.time_ns[firsts]
    left_ns = group.phases[0].departure_ns(sent_ns, group.size_byte)
    busy[seconds] = left_ns > sent_ns + 1
    return free, busy
