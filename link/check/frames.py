"""Probes with single frames and pairs: loss, delay, jitter, duplicates, bit errors, order."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.random import Generator

from farside.link.check.intervals import (
    Interval,
    clustered_interval,
    correlation_interval,
    kolmogorov_distance,
    kolmogorov_limit,
    normal_scores,
    overtaking_probability,
)
from farside.link.check.lines import (
    SHORT_BYTE,
    CheckLine,
    Observation,
    batched,
    bit_error_loss,
    fitting,
    groups,
    impairment_key,
    loss_line,
    plan_bursts,
    point,
    quantile,
    share_line,
)
from farside.link.check.probe import Bools, Ints, Phase, Reference, Traffic
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import Jitter
from farside.link.profile.statistics import Floats, jitter_cdf, loss_statistics
from farside.node import to_s

_LONG_BYTE = 10_000
_NEGLIGIBLE = 0.01
"""Correlation below which samples count as independent."""


def plan_singles(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Short frames, each over before the next is sent."""
    return _singles(SHORT_BYTE, reference, frames, rng)


def _singles(size_byte: int, reference: Reference, frames: int, rng: Generator) -> Traffic:
    return plan_bursts(
        reference, rng, lambda phase: (fitting(phase, size_byte), 1), frames, key=impairment_key
    )


def plan_long_singles(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Long frames, for what depends on size."""
    errors = max((phase.way.bit_error_rate for phase in reference.phases), default=0.0)
    if not errors and not any(phase.rate_bit_s for phase in reference.phases):
        frames = 0
    # At most about one wrong bit per frame, or hardly any would arrive.
    size = _LONG_BYTE if not errors else min(_LONG_BYTE, math.ceil(1 / (8 * errors)))
    return _singles(size, reference, frames // 5, rng)


def judge_singles(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """Loss, delay, jitter, duplication and corruption."""
    for chosen, phases in groups(seen, impairment_key):
        way, from_s = phases[0].way, to_s(phases[0].begin_ns)
        lines = [
            *_loss_lines(way, fitting(phases[0], SHORT_BYTE), seen.arrivals.arrived[chosen]),
            *_delay_lines(seen, chosen),
            _copies_line(way, seen.arrivals.copies[chosen]),
            *_corruption_lines(way, seen, chosen),
        ]
        yield from ((from_s, line) for line in lines)


def judge_long_singles(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """Rate, or delay with the time that sending takes; and bit errors."""
    for chosen, phases in groups(seen, impairment_key):
        way, from_s = phases[0].way, to_s(phases[0].begin_ns)
        size = int(seen.traffic.size_byte[chosen][0])
        delay = next(_delay_lines(seen, chosen), None)
        rates = {phase.rate_bit_s for phase in phases}
        if delay is not None and rates != {None}:
            spread = phases[0].spread_ns and len(rates) == 1
            yield (
                from_s,
                _rate_line(phases[0], size, delay)
                if spread
                else delay._replace(impairment=f"delay of {size} bytes"),
            )
        if way.bit_error_rate:
            yield from_s, _bit_error_line(way, seen, chosen)


def _rate_line(phase: Phase, size_byte: int, delay: CheckLine) -> CheckLine:
    """The rate, from the part of the delay that sending a long frame takes."""
    rate, bits = phase.rate_bit_s or 0, 8 * (size_byte + phase.way.overhead_byte)

    def rate_at(delay_s: float) -> float:
        sending_s = bits / rate + delay_s - delay.asked[0]
        return bits / sending_s if sending_s > 0 else math.inf

    def rates(miss: float) -> Interval:
        low_s, high_s = delay.estimate(miss)
        return rate_at(high_s), rate_at(low_s)

    return CheckLine("rate", "bit/s", delay.frames, point(rate), rate_at(delay.measured), rates)


def _loss_lines(way: OneWay, size_byte: int, arrived: Bools) -> Iterator[CheckLine]:
    other = bit_error_loss(way, size_byte)
    asked = loss_statistics(way.loss, other)
    yield loss_line("loss", asked.rate, arrived, way)
    if not asked.rate or asked.rate == 1:
        return
    lost = ~arrived
    again = (lost[1:] & lost[:-1]).astype(float)
    hits, trials = batched(again), batched(lost[:-1].astype(float))
    share = hits.sum() / trials.sum() if trials.sum() else math.nan

    def lengths(miss: float) -> Interval:
        low, high = clustered_interval(hits, trials, miss)
        return 1 / (1 - low), 1 / (1 - high) if high < 1 else math.inf

    measured = 1 / (1 - share) if share < 1 else math.nan
    bursts = int(trials.sum() - hits.sum())
    yield CheckLine(
        "mean loss burst", "frames", bursts, point(asked.burst_length), measured, lengths
    )


def _delay_lines(seen: Observation, chosen: Bools) -> Iterator[CheckLine]:
    """Delay, and jitter if there is any, from frames that arrived once."""
    lone = chosen & (seen.arrivals.copies == 1)
    if not lone.any():
        return
    asked_ns, rest_ns, slack_ns = _rest(seen, lone)
    way = seen.reference.phases[int(seen.traffic.phase[lone][0])].way
    jitter, asked_s = way.jitter, float(asked_ns.mean()) / 1e9
    rest_s = rest_ns / 1e9
    if jitter is None and way.reorder is None:
        lowest, highest = (rest_ns.min() - slack_ns) / 1e9, (rest_ns.max() + slack_ns) / 1e9
        yield CheckLine(
            "delay",
            "s",
            len(rest_ns),
            point(asked_s),
            asked_s + float(rest_s.mean()),
            lambda _miss: (asked_s + lowest, asked_s + highest),
        )
        return
    least_s, spacing = float(rest_s.min()), 1 if jitter is None else _spacing(jitter)
    effective, share = max(1, len(rest_s) // spacing), way.reorder.share if way.reorder else 0.0

    def located(miss: float) -> Interval:
        # The least of the delays on top exceeds this quantile with probability `miss`.
        probability = min(1.0, -math.expm1(math.log(miss) / effective) / max(1 - share, 1e-9))
        reach = 0.0 if jitter is None else quantile(jitter, probability)
        return asked_s + least_s - reach - slack_ns / 1e9, asked_s + least_s + slack_ns / 1e9

    yield CheckLine("delay", "s", len(rest_s), point(asked_s), asked_s + least_s, located)
    if jitter is not None:
        yield from _jitter_lines(way, jitter, rest_s, np.flatnonzero(lone))


def _rest(seen: Observation, lone: Bools) -> tuple[Ints, Ints, float]:
    """Propagation delay asked for, the delay on top of it, and its uncertainty, in nanoseconds."""
    asked, rest, slack = [], [], 0.0
    for index in np.unique(seen.traffic.phase[lone]):
        phase, own = seen.reference.phases[index], lone & (seen.traffic.phase == index)
        size = int(seen.traffic.size_byte[own][0])
        left_ns = seen.reference.departure_ns(phase, seen.traffic.time_ns[own], size)
        asked.append(seen.reference.delay_ns(left_ns))
        rest.append(seen.arrivals.time_ns[own] - left_ns - asked[-1])
        # The delay may be that of the first bit or of the last.
        slack = max(slack, 2 + seen.reference.slope * phase.sending_ns(size))
    return np.concatenate(asked), np.concatenate(rest), slack


def _jitter_lines(
    way: OneWay, jitter: Jitter, rest_s: Floats, numbers: Ints
) -> Iterator[CheckLine]:
    probabilities = jitter_cdf(jitter, rest_s)
    if way.reorder is not None:
        held = jitter_cdf(jitter, rest_s - way.reorder.hold_s)
        probabilities = (1 - way.reorder.share) * probabilities + way.reorder.share * held
    apart = probabilities[numbers % _spacing(jitter) == 0]
    if len(apart):
        distance = kolmogorov_distance(apart)

        def distances(miss: float) -> Interval:
            limit = kolmogorov_limit(len(apart), miss)
            return max(0.0, distance - limit), distance + limit

        yield CheckLine("jitter, distance", "", len(apart), point(0), distance, distances)
    before, after = np.flatnonzero(np.diff(numbers) == 1), np.flatnonzero(np.diff(numbers) == 1) + 1
    if way.reorder is None and len(before) > 10 and np.ptp(probabilities) > 0:
        scores = normal_scores(probabilities)
        estimate = partial(correlation_interval, scores[before], scores[after])
        measured = float(np.corrcoef(scores[before], scores[after])[0, 1])
        yield CheckLine(
            "jitter, correlation", "", len(before), point(jitter.correlation), measured, estimate
        )


def _spacing(jitter: Jitter) -> int:
    """How many frames apart jitter is practically independent."""
    rho = abs(jitter.correlation)
    return max(1, math.ceil(math.log(_NEGLIGIBLE) / math.log(rho))) if rho > _NEGLIGIBLE else 1


def _copies_line(way: OneWay, copies: Ints) -> CheckLine:
    return share_line("duplication", way.duplicate, copies[copies > 0] > 1)


def _corruption_lines(way: OneWay, seen: Observation, chosen: Bools) -> Iterator[CheckLine]:
    arrived = chosen & seen.arrivals.arrived
    if not arrived.any():
        return
    wrong, size = seen.arrivals.wrong_bits[arrived], int(seen.traffic.size_byte[chosen][0])
    flips = way.bit_error_rate if way.bit_errors is BitErrorEffect.FLIP else 0.0
    spared = (1 - flips) ** (8 * size)
    # Corruption may flip back the only wrong bit.
    restored = flips * (1 - flips) ** (8 * size - 1) * way.corrupt
    yield share_line("corruption", 1 - spared * (1 - way.corrupt) - restored, wrong > 0)
    if way.corrupt and not flips and (wrong > 0).any():
        bits = wrong[wrong > 0]
        yield CheckLine(
            "bits wrong if corrupt",
            "bits",
            len(bits),
            point(1),
            float(bits.mean()),
            lambda _miss: (float(bits.min()), float(bits.max())),
        )


def _bit_error_line(way: OneWay, seen: Observation, chosen: Bools) -> CheckLine:
    size = int(seen.traffic.size_byte[chosen][0])
    arrived = seen.arrivals.arrived[chosen]
    asked = point(way.bit_error_rate)
    if way.bit_errors is BitErrorEffect.FLIP:
        wrong = seen.arrivals.wrong_bits[chosen][arrived].astype(float)
        bits = np.full(len(wrong), 8.0 * size)
        hits = batched(wrong)
        # Bits that `corrupt` flips come on top.
        asked = point(way.bit_error_rate + (1 - 2 * way.bit_error_rate) * way.corrupt / bits[0])
        share = float(wrong.sum() / bits.sum())
        estimate = partial(clustered_interval, hits, batched(bits))
        return CheckLine("bit errors", "per bit", len(wrong), asked, share, estimate)
    line = loss_line("bit errors", 0.0, arrived, way)
    spared = 1 - loss_statistics(way.loss).rate
    bits_exposed = 8 * (size + way.overhead_byte)

    def rate(loss: float) -> float:
        return max(0.0, 1 - math.exp(math.log((1 - loss) / spared) / bits_exposed))

    def rates(miss: float) -> Interval:
        low, high = line.estimate(miss)
        return rate(low), rate(high)

    return line._replace(unit="per bit", asked=asked, measured=rate(line.measured), estimate=rates)


# --- pairs: reordering -------------------------------------------------------------------------


def plan_pairs(reference: Reference, frames: int, rng: Generator) -> Traffic:
    """Two frames at once, both over before the next two are sent."""
    return plan_bursts(
        reference,
        rng,
        lambda phase: (fitting(phase, SHORT_BYTE), 2),
        frames // 4,
        key=impairment_key,
    )


def judge_pairs(seen: Observation) -> Iterator[tuple[float, CheckLine]]:
    """How often the second of a pair arrived first."""
    for chosen, phases in groups(seen, impairment_key):
        way, numbers = phases[0].way, np.flatnonzero(chosen)
        leaders, followers = numbers[::2], numbers[1::2]
        copies = seen.arrivals.copies
        whole = (copies[leaders] == 1) & (copies[followers] >= 1)
        asked = 0.0
        if way.reorder is not None and not way.rate_trace:
            size = int(seen.traffic.size_byte[numbers[0]])
            lead_s = way.reorder.hold_s - to_s(phases[0].sending_ns(size))
            asked = overtaking_probability(way.jitter, lead_s)
            asked *= way.reorder.share * (1 - way.reorder.share)
        line = share_line("pairs overtaken", asked, seen.arrivals.overtaken[leaders[whole]])
        yield to_s(phases[0].begin_ns), line
