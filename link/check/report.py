"""Proof that an emulator does to frames what a profile asks for.

Traffic is sent through the emulator in simulated time, and what arrives is measured; the emulator's
own records are only checked for agreement. For each direction and impairment the report gives the
value measured, its 99 % confidence interval, and a verdict.

One in a hundred of these intervals misses the true value by chance, so the verdict uses wider ones:
some measurement of a right emulator falls outside once in 10,000 seeds (`FALSE_ALARM`, divided
among the measurements by Bonferroni's correction). A wrong emulator is caught all the same, since
the frames are many: 40,000 tell a loss of 5 % from one of 6 %.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from farside.link.channel.node import Channel
from farside.link.check.lines import CheckLine, Lines, Observation, exact_line
from farside.link.check.probes import large, outages, pairs, queues, rates, singles, slots
from farside.link.check.relayed import check_relayed
from farside.link.check.traffic.planning import Traffic
from farside.link.check.traffic.reference import FOREVER_NS, Reference
from farside.link.check.traffic.run import ChannelFactory, Idle, run_probe, seeds
from farside.link.profile.config import LinkConfig
from farside.node import Direction

FRAMES = 40_000
"""Frames sent per direction where something random is measured (project default)."""

FALSE_ALARM = 1e-4
"""Probability that a right emulator is refused (project default)."""

_MISS = 0.01


class CheckVerdict(StrEnum):
    """Whether the value asked for lies inside the interval measured, if it could be measured."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    UNKNOWN = "not measured"


class Measurement(msgspec.Struct, frozen=True):
    """One impairment of one direction, asked for and measured.

    Attributes:
        direction: the direction.
        from_s: since when the direction has been so, in simulated time.
        impairment: what was measured.
        unit: of the values: `share` of the frames, `s`, `bit/s`; empty for a pure number.
        frames: how many frames, pairs or bursts it is based on.
        asked, asked_to: the range that the profile asks for; both equal for a single value.
        measured: the value measured; NaN if it could not be.
        low, high: its 99 % confidence interval.
        verdict: see `CheckVerdict`.
        why: why it could not be measured; empty if it was.
    """

    direction: Direction
    from_s: float
    impairment: str
    unit: str
    frames: int
    asked: float
    asked_to: float
    measured: float
    low: float
    high: float
    verdict: CheckVerdict
    why: str = ""


class CheckReport(msgspec.Struct, frozen=True):
    """What a check found.

    Attributes:
        frames: how many were sent in all.
        seed: the seed of the check.
        measurements: for each direction and impairment.
    """

    frames: int
    seed: int
    measurements: tuple[Measurement, ...]

    @property
    def passed(self) -> bool:
        """Whether no value asked for falls outside."""
        return all(one.verdict is not CheckVerdict.OUTSIDE for one in self.measurements)


def check_link(
    config: LinkConfig,
    channel_factory: ChannelFactory = Channel,
    frames: int = FRAMES,
    seed: int = 0,
    on_progress: Callable[[float], None] = lambda _share: None,
) -> CheckReport:
    """Compare what an emulator does to frames with the profile that it was given.

    Args:
        config: the profile, resolved.
        channel_factory: makes the emulator, as `Channel` does; called for every probe.
        frames: how many frames to send where something random is measured, in each setting of each
            direction; more than 8 settings of a direction share 8 times as many.
        seed: of the emulator and of the traffic.
        on_progress: called with the share of the work done, 0 to 1.
    """
    if config.routing is not None:
        relayed = check_relayed(config, channel_factory, frames, seed, on_progress)
        whole = {way: [(0.0, line) for line in one.lines] for way, one in relayed.items()}
        return _report(sum(one.frames for one in relayed.values()), seed, whole)
    references = {direction: Reference(config, direction) for direction in Direction}
    found: dict[Direction, list[tuple[float, CheckLine]]] = {
        direction: [] for direction in Direction
    }
    sent, disagreeing = dict.fromkeys(Direction, 0), dict.fromkeys(Direction, 0)
    for number, probe in enumerate(_PROBES):
        rng, streams = seeds(seed, number)
        traffic = {way: probe.plan(reference, frames, rng) for way, reference in references.items()}
        total, done = sum(len(one.time_ns) for one in traffic.values()), 0

        def advance(count: int, number: int = number, total: int = total) -> None:
            nonlocal done
            done += count
            on_progress((number + done / total) / len(_PROBES))

        channel = channel_factory(config, streams) if total else Idle()
        seen = run_probe(channel, traffic, advance, lifetime_ns=probe.lifetime_ns)
        for way, arrivals in seen.items():
            sent[way] += len(traffic[way].time_ns)
            disagreeing[way] += arrivals.disagreeing
            found[way] += probe.judge(Observation(references[way], traffic[way], arrivals))
    for way, lines in found.items():
        lines.append((0.0, exact_line("records that disagree", sent[way], 0, disagreeing[way])))
    on_progress(1.0)
    return _report(sum(sent.values()), seed, found)


def _report(
    sent: int, seed: int, found: Mapping[Direction, Sequence[tuple[float, CheckLine]]]
) -> CheckReport:
    miss = FALSE_ALARM / sum(map(len, found.values()))
    return CheckReport(
        sent,
        seed,
        tuple(
            _judged(direction, from_s, line, miss)
            for direction, lines in found.items()
            for from_s, line in _sorted(lines)
        ),
    )


def _sorted(lines: Sequence[tuple[float, CheckLine]]) -> list[tuple[float, CheckLine]]:
    """The lines with those of one name together, in order of time."""
    names = list(dict.fromkeys(line.impairment for _, line in lines))
    return sorted(lines, key=lambda one: (names.index(one[1].impairment), one[0]))


def _judged(direction: Direction, from_s: float, line: CheckLine, miss: float) -> Measurement:
    low, high = line.estimate(_MISS)
    widest = line.estimate(miss)
    verdict = CheckVerdict.INSIDE
    if math.isnan(line.measured):
        verdict = CheckVerdict.UNKNOWN
    elif not (widest[0] <= line.asked[1] and line.asked[0] <= widest[1]):
        verdict = CheckVerdict.OUTSIDE
    return Measurement(
        direction=direction,
        from_s=from_s,
        impairment=line.impairment,
        unit=line.unit,
        frames=line.frames,
        asked=float(line.asked[0]),
        asked_to=float(line.asked[1]),
        measured=float(line.measured),
        low=float(low),
        high=float(high),
        verdict=verdict,
        why=line.why if verdict is CheckVerdict.UNKNOWN else "",
    )


class _Probe(NamedTuple):
    """One kind of traffic, and what is concluded from how it arrives.

    Attributes:
        plan: the traffic in a direction: how many frames where something random is measured, and
            what chooses their times.
        judge: the lines that it fills.
        lifetime_ns: how long each frame may wait; the link's own limit if `None`.
    """

    plan: Callable[[Reference, int, Generator], Traffic]
    judge: Callable[[Observation], Lines]
    lifetime_ns: int | None = FOREVER_NS


_PROBES = (
    _Probe(singles.plan_singles, singles.judge_singles),
    _Probe(singles.plan_long_singles, singles.judge_long_singles),
    _Probe(pairs.plan_pairs, pairs.judge_pairs),
    _Probe(rates.plan_trains, rates.judge_trains),
    _Probe(queues.plan_overloads, queues.judge_overloads),
    _Probe(queues.plan_crowds, queues.judge_crowds),
    _Probe(slots.plan_slots, slots.judge_slots),
    _Probe(queues.plan_lifetimes, queues.judge_lifetimes, lifetime_ns=None),
    _Probe(large.plan_large, large.judge_large),
    _Probe(outages.plan_edges, outages.judge_edges),
)
