"""Probes with single frames: loss, delay, jitter, duplicates, bit errors; rate beside jitter."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import Interval, clustered_interval, share_interval
from farside.link.check.lines import (
    CheckLine,
    Group,
    Lines,
    Observation,
    any_wrong,
    batched,
    believing,
    bit_error_loss,
    loss_line,
    point,
    share_line,
    short_byte,
    sparing_byte,
    unmeasured,
)
from farside.link.check.probes.delays import delay_line, delay_lines
from farside.link.check.probes.memory import repeats_line
from farside.link.check.traffic.planning import Burst, LeftOut, Traffic, plan_bursts
from farside.link.check.traffic.reference import MARGIN_NS, Phase, Reference
from farside.link.profile.config import BitErrorEffect
from farside.link.profile.impairments import CorrelatedLoss
from farside.link.profile.statistics import loss_statistics
from farside.node import NS_PER_S

_LONG_BYTE = 10_000


def _kind(phase: Phase) -> int:
    return phase.kind


def plan_singles(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Short frames, each over before the next is sent."""

    def single(phase: Phase, _room_ns: int) -> Burst:
        size = short_byte(phase)
        return Burst(size, 1, phase.busy_ns(size))

    traffic = plan_bursts(reference, rng, single, frames, _kind)
    if not reference.phases:
        return traffic._replace(left_out=(LeftOut([], "nothing can be sent at any time"),))
    return traffic


def judge_singles(seen: Observation) -> Lines:
    """Loss, delay, jitter, duplication and corruption."""
    for group in seen.groups(_kind):
        lines = [
            *_loss_lines(seen, group),
            *delay_lines(seen, group),
            _copies_line(seen, group),
            *_corruption_lines(seen, group),
        ]
        yield from ((group.from_s, line) for line in lines)
    yield from seen.left_out(
        "loss", "share", lambda way: loss_statistics(way.loss, bit_error_loss(way, 1)).rate
    )
    yield from seen.left_out("delay", "s", lambda _way: math.nan)


def _loss_lines(seen: Observation, group: Group) -> Iterator[CheckLine]:
    way, name = group.way, "mean loss burst"
    other = bit_error_loss(way, group.size_byte)
    asked = loss_statistics(way.loss, other)
    yield loss_line("loss", way, other, seen, group.chosen)
    if not asked.rate or asked.rate == 1:
        return
    counted = group.chosen
    starts = np.array([phase.loss_start for phase in seen.reference.phases])[seen.traffic.phase]
    pairs = counted[1:] & counted[:-1] & (starts[1:] == starts[:-1])
    lost = ~seen.arrivals.arrived
    before = (lost[:-1] & pairs)[counted[1:]].astype(float)
    again = (lost[1:] & lost[:-1] & pairs)[counted[1:]].astype(float)
    trials, hits = float(before.sum()), float(again.sum())
    if not trials or trials == hits:
        why = "no burst of losses ended" if trials else "no frame was lost"
        yield unmeasured(name, "frames", asked.burst_length, why)
        return
    shares = partial(clustered_interval, batched(again), batched(before))
    share = 1 - 1 / asked.burst_length
    likelihood = seen.losses(way, other, counted)
    believed = believing(share, shares, lambda: likelihood.repeat_chance(hits, trials, share))

    def lengths(miss: float) -> Interval:
        low, high = believed(miss)
        found = [1 / (1 - one) if one < 1 else math.inf for one in (low, high)]
        if low <= share <= high:
            # The length asked for must not be lost to rounding.
            found += [asked.burst_length]
        return min(found), max(found)

    yield CheckLine(
        name,
        "frames",
        int(trials - hits),
        point(asked.burst_length),
        1 / (1 - hits / trials),
        lengths,
    )
    if isinstance(way.loss, CorrelatedLoss) and not other:
        yield repeats_line("loss, correlation", way.loss, again, before, likelihood)


def _copies_line(seen: Observation, group: Group) -> CheckLine:
    copies = seen.arrivals.copies[group.chosen]
    return share_line("duplication", group.way.duplicate, copies[copies > 0] > 1)


def _corruption_lines(seen: Observation, group: Group) -> Iterator[CheckLine]:
    way, arrived = group.way, group.chosen & seen.arrivals.arrived
    wrong, bits = seen.arrivals.wrong_bits[arrived], 8 * group.size_byte
    flips = way.bit_error_rate if way.bit_errors is BitErrorEffect.FLIP else 0.0
    # Corruption may flip back the only wrong bit.
    restored = flips * (1 - any_wrong(flips, bits - 1)) * way.corrupt
    flipped = any_wrong(flips, bits)
    yield share_line("corruption", flipped + (1 - flipped) * way.corrupt - restored, wrong > 0)
    if way.corrupt and not flips and (wrong > 0).any():
        counts = wrong[wrong > 0]
        yield CheckLine(
            "bits wrong if corrupt",
            "bits",
            len(counts),
            point(1),
            float(counts.mean()),
            lambda _miss: (float(counts.min()), float(counts.max())),
        )


# --- long frames -------------------------------------------------------------------------------


def plan_long_singles(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Long frames, for what depends on size: as long as the windows have room for."""
    sizes: dict[int, int] = {}
    for index, phase in enumerate(reference.phases):
        size = _long_byte(phase, reference.windows.longest_ns(index))
        sizes[phase.kind] = max(size, sizes.get(phase.kind, 0))

    def single(phase: Phase, _room_ns: int) -> Burst | None:
        if phase.rate_bit_s is None and not phase.way.bit_error_rate:
            return None
        size = sizes[phase.kind]
        return Burst(size, 1, phase.busy_ns(size))

    return plan_bursts(reference, rng, single, max(1, frames // 5), _kind)


def _long_byte(phase: Phase, room_ns: int) -> int:
    longest = max(1, min(_LONG_BYTE, phase.way.queue_byte, sparing_byte(phase.way)))
    if phase.rate_bit_s is None:
        return longest
    # Half of the room, so that several fit into it.
    room = (room_ns - 2 * MARGIN_NS) // 2 * phase.rate_bit_s // (8 * NS_PER_S)
    return max(short_byte(phase), min(longest, room - phase.way.overhead_byte))


def judge_long_singles(seen: Observation) -> Lines:
    """Rate, or delay with the time that sending takes; and bit errors."""
    for group in seen.groups(_kind):
        rates = {phase.rate_bit_s for phase in group.phases}
        if rates != {None}:
            delay = delay_line(seen, group)
            alone = group.phases[0].spreads and len(rates) == 1
            line = (
                _rate_line(group, delay)
                if alone
                else delay._replace(impairment=f"delay of {group.size_byte} bytes")
            )
            yield group.from_s, line
        if group.way.bit_error_rate:
            yield group.from_s, _bit_error_line(seen, group)
    for phases, why in seen.traffic.left_out:
        if phases and phases[0].rate_bit_s is not None and phases[0].spreads:
            yield phases[0].begin_ns / 1e9, unmeasured("rate", "bit/s", phases[0].rate_bit_s, why)


def _rate_line(group: Group, delay: CheckLine) -> CheckLine:
    """The rate, from the part of the delay that sending a long frame takes."""
    rate = group.phases[0].rate_bit_s or 0
    if math.isnan(delay.measured):
        return unmeasured("rate", "bit/s", rate, delay.why)
    bits = 8 * group.phases[0].frame_byte(group.size_byte)

    def rate_at(delay_s: float) -> float:
        sending_s = bits / rate + delay_s - delay.asked[0]
        return bits / sending_s if sending_s > 0 else math.inf

    def rates(miss: float) -> Interval:
        low_s, high_s = delay.estimate(miss)
        # That of an exact delay must not be lost to rounding.
        low, high = rate_at(high_s), rate_at(low_s)
        return (
            (low, high)
            if not low_s <= delay.asked[0] <= high_s
            else (min(low, rate), max(high, rate))
        )

    return CheckLine("rate", "bit/s", delay.frames, point(rate), rate_at(delay.measured), rates)


def _bit_error_line(seen: Observation, group: Group) -> CheckLine:
    way, size, rate = group.way, group.size_byte, group.way.bit_error_rate
    if way.bit_errors is BitErrorEffect.FLIP:
        return _flips_line(seen, group)
    spared = 1 - loss_statistics(way.loss).rate
    line = loss_line("bit errors", way, bit_error_loss(way, size), seen, group.chosen)
    bits = 8 * (size + way.overhead_byte)

    def rate_at(loss: float) -> float:
        if loss >= 1:
            return 1.0
        return max(0.0, -math.expm1(min(0.0, math.log((1 - loss) / spared)) / bits))

    if spared <= 0 or line.measured >= 1 > line.asked[0]:
        return unmeasured("bit errors", "per bit", rate, "no frame arrived")

    def rates(miss: float) -> Interval:
        low, high = line.estimate(miss)
        found = rate_at(low), rate_at(high)
        if low <= line.asked[0] <= high:
            return min(found[0], rate), max(found[1], rate)
        return found

    return CheckLine(
        "bit errors", "per bit", line.frames, point(rate), rate_at(line.measured), rates
    )


def _flips_line(seen: Observation, group: Group) -> CheckLine:
    way, arrived = group.way, group.chosen & seen.arrivals.arrived
    bits, wrong = 8 * group.size_byte, seen.arrivals.wrong_bits[arrived]
    # Bits that `corrupt` flips come on top.
    rate = way.bit_error_rate + (1 - 2 * way.bit_error_rate) * way.corrupt / bits
    if not len(wrong):
        return unmeasured("bit errors", "per bit", rate, "no frame arrived")
    hits, total = float(wrong.sum()), float(len(wrong) * bits)
    estimate = partial(share_interval, hits, total)
    return CheckLine("bit errors", "per bit", len(wrong), point(rate), hits / total, estimate)
