"""Proof that an emulator does to frames what a profile asks for.

Traffic is sent through the emulator in simulated time, and what arrives is measured: the emulator's
own records count only for saying the same. For each direction and impairment there is the value
measured, the interval that holds the true one with 99 % confidence, and a verdict.

Every hundredth of these intervals misses the true value by chance, so the verdict takes wider ones:
so wide that an emulator which is right is refused, by any measurement of a report, once in
10,000 seeds (`FALSE_ALARM`, shared among the measurements as Bonferroni has it). A wrong emulator
is caught all the same, for the frames are many: 40,000 tell a loss of 5 % from 6 %.
"""

import math
from collections.abc import Callable, Iterator
from enum import StrEnum

import msgspec
from numpy.random import Generator

from farside.link.channel.node import Channel
from farside.link.check import bursts as check_bursts
from farside.link.check import frames as check_frames
from farside.link.check.lines import Line, Seen, exact_line
from farside.link.check.probe import ChannelFactory, Route, Traffic, run_probe, seeds
from farside.link.profile.config import LinkConfig
from farside.node import Direction

FRAMES = 40_000
"""Frames sent for the measurements of chance, in each direction (project default)."""

FALSE_ALARM = 1e-4
"""The chance that an emulator which is right is refused (project default)."""

_MISS = 0.01


class Verdict(StrEnum):
    """Whether the value asked for lies within what was measured, if that could be measured."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    UNKNOWN = "not measured"


class Measurement(msgspec.Struct, frozen=True):
    """One impairment of one direction, asked for and measured.

    Attributes:
        direction: which way.
        from_s: since when the link is so.
        impairment: what was measured.
        unit: of the values: `share` of the frames, `s`, `bit/s`; empty for what has none.
        frames: how many frames, pairs or bursts it rests on.
        asked, asked_to: the value that the profile gives; a range where there are two.
        measured: the value seen.
        low, high: the interval about it of 99 % confidence.
        verdict: see `Verdict`.
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
    verdict: Verdict


class Report(msgspec.Struct, frozen=True):
    """What a check found.

    Attributes:
        frames: how many were sent in all.
        seed: the one that it ran with.
        measurements: for each direction and impairment.
    """

    frames: int
    seed: int
    measurements: tuple[Measurement, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing falls outside."""
        return all(one.verdict is not Verdict.OUTSIDE for one in self.measurements)


def check_link(
    config: LinkConfig,
    channel_factory: ChannelFactory = Channel,
    frames: int = FRAMES,
    seed: int = 0,
    tell: Callable[[float], None] = lambda _share: None,
) -> Report:
    """Measure what an emulator does to frames against the profile that it was given.

    Args:
        config: the profile, resolved.
        channel_factory: makes the emulator, as `Channel` does; anew for every probe.
        frames: how many frames to send in each direction where chance is measured.
        seed: of the emulator's chance and the traffic's.
        tell: told the share that is done.
    """
    routes = {direction: Route(config, direction) for direction in Direction}
    found: dict[Direction, list[tuple[float, Line]]] = {direction: [] for direction in Direction}
    sent, disagreeing = dict.fromkeys(Direction, 0), dict.fromkeys(Direction, 0)
    for number, (plan, judge) in enumerate(_PROBES):
        rng, streams = seeds(seed, number)
        traffic = {way: plan(route, frames, rng) for way, route in routes.items()}
        total, done = sum(len(one.time_ns) for one in traffic.values()), 0
        if not total:
            continue

        def told(count: int, number: int = number, total: int = total) -> None:
            nonlocal done
            done += count
            tell((number + done / total) / len(_PROBES))

        seen = run_probe(channel_factory(config, streams), traffic, told)
        for way, arrivals in seen.items():
            sent[way] += len(traffic[way].time_ns)
            disagreeing[way] += arrivals.disagreeing
            found[way] += judge(Seen(routes[way], traffic[way], arrivals))
    for way, lines in found.items():
        lines.append((0.0, exact_line("records that disagree", sent[way], 0, disagreeing[way])))
    tell(1.0)
    miss = FALSE_ALARM / sum(map(len, found.values()))
    return Report(
        sum(sent.values()),
        seed,
        tuple(
            _judged(direction, from_s, line, miss)
            for direction, lines in found.items()
            for from_s, line in lines
        ),
    )


def _judged(direction: Direction, from_s: float, line: Line, miss: float) -> Measurement:
    low, high = line.estimate(_MISS)
    widest = line.estimate(miss)
    verdict = Verdict.INSIDE
    if math.isnan(line.measured):
        verdict = Verdict.UNKNOWN
    elif not (widest[0] <= line.asked[1] and line.asked[0] <= widest[1]):
        verdict = Verdict.OUTSIDE
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
    )


_Probe = tuple[
    Callable[[Route, int, Generator], Traffic], Callable[[Seen], Iterator[tuple[float, Line]]]
]
_PROBES: tuple[_Probe, ...] = (
    (check_frames.plan_singles, check_frames.judge_singles),
    (check_frames.plan_long_singles, check_frames.judge_long_singles),
    (check_frames.plan_pairs, check_frames.judge_pairs),
    (check_bursts.plan_trains, check_bursts.judge_trains),
    (check_bursts.plan_overloads, check_bursts.judge_overloads),
    (check_bursts.plan_edges, check_bursts.judge_edges),
)
