"""The check of jitter, correlation, slots and measured delays: right ones pass, wrong ones not."""

import random
from typing import Any

import msgspec
import pytest

from farside.link import Channel, LinkConfig, OneWay
from farside.link.check import CheckReport, CheckVerdict, check_link
from farside.link.check.traffic.run import ChannelFactory
from farside.link.profile.config import (
    AfterLast,
    Blackout,
    DelayPoint,
    DelayTrace,
    LinkChange,
    RateStep,
    Trace,
)
from farside.link.profile.impairments import (
    CorrelatedLoss,
    Jitter,
    JitterShape,
    Reorder,
    Slots,
)

SPREAD_S = 0.01
MANY = tuple(round(random.Random(n).gauss(0, 8192)) for n in range(1000))  # noqa: S311 - a table
FEW = (-8192, 0, 8192, 8192)
CUT = tuple(
    min(32767, round(8192 * 4 / 3 * ((1 - (n + 0.5) / 4096) ** (-1 / 3) - 1.5)))
    for n in range(4096)
)
"""The table that tc-netem has for its Pareto distribution."""

WRAPPING = DelayTrace(
    points=tuple(DelayPoint(t_s=t, delay_s=d) for t, d in ((2, 0.4), (10, 0.8), (11, 0.2))),
    at_end=AfterLast.WRAP,
)


def one_way(**keys: Any) -> LinkConfig:
    return LinkConfig(up=OneWay(**({"delay_s": 0.1} | keys)), down=OneWay(delay_s=0.1))


def jitter(shape: JitterShape, **keys: Any) -> Jitter:
    return Jitter(shape=shape, **({"spread_s": SPREAD_S, "mean_s": 0.03} | keys))


def table(entries: tuple[int, ...], correlation: float = 0.0) -> Jitter:
    return jitter(JitterShape.TABLE, table=entries, correlation=correlation)


def outside(report: CheckReport) -> set[str]:
    return {one.impairment for one in report.measurements if one.verdict is CheckVerdict.OUTSIDE}


def wrongly(**keys: Any) -> ChannelFactory:
    """An emulator that uses other settings for the uplink than the profile."""
    return lambda config, rngs: Channel(
        msgspec.structs.replace(config, up=msgspec.structs.replace(config.up, **keys)), rngs
    )


NORMAL = one_way(jitter=jitter(JitterShape.NORMAL))
HALF = one_way(jitter=jitter(JitterShape.NORMAL, mean_s=0.0, correlation=0.4))
PARETO = one_way(jitter=jitter(JitterShape.PARETO))
MIXED = one_way(jitter=jitter(JitterShape.PARETONORMAL))
LOSING = one_way(loss=CorrelatedLoss(probability=0.1, correlation=0.4))
HELD = one_way(reorder=Reorder(share=0.2, hold_s=0.05, correlation=0.4))
SLOTTED = one_way(slots=Slots(min_s=0.01, max_s=0.02, frames=5), rate_bit_s=400_000)
WRAPPED = LinkConfig(
    up=OneWay(delay_trace=WRAPPING, rate_bit_s=8000, jitter=Jitter(spread_s=0.02)),
    down=OneWay(delay_s=0.1),
)

RIGHT = {
    "normal": NORMAL,
    "half of a normal": HALF,
    "Pareto": PARETO,
    "Pareto, anticorrelated": one_way(jitter=jitter(JitterShape.PARETO, correlation=-0.4)),
    "a mixture": MIXED,
    "a table": one_way(jitter=table(MANY, 0.5)),
    "a table of few values": one_way(jitter=table(FEW, 0.5)),
    "a table of one value": one_way(jitter=table((-8192,), 0.5)),
    "correlated losses": LOSING,
    "anticorrelated losses": one_way(loss=CorrelatedLoss(probability=0.3, correlation=-0.3)),
    "losses with a long memory": one_way(loss=CorrelatedLoss(probability=0.1, correlation=0.999)),
    "all lost": one_way(loss=CorrelatedLoss(probability=1.0, correlation=0.4)),
    "correlated holding back": HELD,
    "all held back": one_way(reorder=Reorder(share=1.0, hold_s=0.05, correlation=0.4)),
    "holding back within jitter": one_way(
        reorder=Reorder(share=0.2, hold_s=0.05, correlation=0.4), jitter=Jitter(spread_s=0.3)
    ),
    "slots": SLOTTED,
    "slots by bytes": one_way(slots=Slots(max_s=0.03, bytes=400), queue_byte=65_536),
    "slots with losses": one_way(
        slots=Slots(max_s=0.03, frames=3), rate_bit_s=100_000, loss=0.3, duplicate=0.2
    ),
    "slots with jitter": one_way(
        slots=Slots(max_s=0.03, frames=3), jitter=jitter(JitterShape.PARETO), rate_bit_s=10_000
    ),
    "waits for slots by a table": one_way(slots=Slots(wait=table(FEW), frames=1)),
    "slots and a lifetime": one_way(
        slots=Slots(min_s=0.01, max_s=0.02, frames=3), lifetime_s=0.03, queue_frame=10
    ),
    "slots and a trace": one_way(
        slots=Slots(min_s=0.01), rate_trace=Trace(times_ms=(1, 3, 3, 10, 25))
    ),
    "slots and rates": one_way(
        slots=Slots(min_s=0.1, max_s=0.2, frames=3),
        rate_table=(
            RateStep(t_s=0, rate_bit_s=8000),
            RateStep(t_s=3600, rate_bit_s=0),
            RateStep(t_s=7200, rate_bit_s=64_000),
        ),
    ),
    "a measured delay": WRAPPED,
    "slots and a measured delay": LinkConfig(
        up=OneWay(delay_trace=WRAPPING, slots=Slots(min_s=1.0, max_s=2.0, frames=4)),
        down=OneWay(delay_s=0.1),
    ),
    "slots beside outages": LinkConfig(
        up=OneWay(delay_s=2.0, slots=Slots(min_s=0.1, max_s=0.2)),
        down=OneWay(delay_s=2.0, slots=Slots(min_s=0.1, max_s=0.2, frames=2), rate_bit_s=8000),
        blackouts=tuple(Blackout(start_s=100.0 * n, end_s=100.0 * n + 30) for n in range(1, 5)),
    ),
    "changes": LinkConfig(
        up=OneWay(delay_s=1.0, slots=Slots(min_s=0.1)),
        down=OneWay(delay_s=1.0),
        changes=(
            LinkChange(at_s=60, slots=Slots(min_s=0.2, max_s=0.3), reorder=HELD.up.reorder),
            LinkChange(at_s=120, loss=LOSING.up.loss, jitter=NORMAL.up.jitter),
        ),
    ),
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_emulator_passes(name: str) -> None:
    assert outside(check_link(RIGHT[name], frames=500)) == set()


WRONG: dict[str, tuple[LinkConfig, dict[str, Any], str]] = {
    "a spread 10 % too wide": (
        NORMAL,
        {"jitter": jitter(JitterShape.NORMAL, spread_s=0.011)},
        "jitter, tail",
    ),
    "uniform, not normal": (
        NORMAL,
        {"delay_s": 0.1127, "jitter": Jitter(spread_s=0.0346)},
        "jitter, distance",
    ),
    "not cut off at 0": (
        HALF,
        {"jitter": jitter(JitterShape.NORMAL, mean_s=0.002, correlation=0.4)},
        "jitter, distance",
    ),
    "without correlation, half cut off": (
        HALF,
        {"jitter": jitter(JitterShape.NORMAL, mean_s=0.0)},
        "jitter, correlation",
    ),
    "Pareto cut at 4": (PARETO, {"jitter": table(CUT)}, "jitter, tail"),
    "Pareto, not the mixture": (
        MIXED,
        {"jitter": jitter(JitterShape.PARETO)},
        "jitter, distance",
    ),
    "an entry of a table twice": (
        one_way(jitter=table(FEW)),
        {"jitter": table((*FEW, 0))},
        "jitter, distance",
    ),
    "a table without correlation": (
        one_way(jitter=table(FEW, 0.5)),
        {"jitter": table(FEW, 0.2)},
        "jitter, correlation",
    ),
    "losses as tc correlates them": (LOSING, {"loss": 0.004}, "loss"),
    "losses without correlation": (LOSING, {"loss": 0.1}, "loss, correlation"),
    "losses too correlated": (
        LOSING,
        {"loss": CorrelatedLoss(probability=0.1, correlation=0.6)},
        "loss, correlation",
    ),
    "holding back without correlation": (
        HELD,
        {"reorder": Reorder(share=0.2, hold_s=0.05)},
        "held back, correlation",
    ),
    "too many held back": (
        HELD,
        {"reorder": Reorder(share=0.28, hold_s=0.05, correlation=0.4)},
        "held back",
    ),
    "no slots": (SLOTTED, {"slots": None}, "waits for slots, distance"),
    "waits 10 % too long": (
        SLOTTED,
        {"slots": Slots(min_s=0.01, max_s=0.022, frames=5)},
        "waits for slots, distance",
    ),
    "a frame too many in a slot": (
        SLOTTED,
        {"slots": Slots(min_s=0.01, max_s=0.02, frames=6)},
        "frames outside their slot",
    ),
    "slots that never end": (
        SLOTTED,
        {"slots": Slots(min_s=0.01, max_s=0.02)},
        "waits for slots, within bursts, distance",
    ),
    "slots that end too early": (
        one_way(slots=Slots(min_s=0.01, max_s=0.02, bytes=640)),
        {"slots": Slots(min_s=0.01, max_s=0.02, bytes=500)},
        "frames outside their slot",
    ),
    "a rate 3 % too slow within slots": (SLOTTED, {"rate_bit_s": 388_000}, "rate"),
    "a measured delay that holds": (
        WRAPPED,
        {"delay_trace": msgspec.structs.replace(WRAPPING, at_end=AfterLast.HOLD)},
        "delay",
    ),
}


SUBTLE = {
    "a spread 10 % too wide",
    "uniform, not normal",
    "not cut off at 0",
    "without correlation, half cut off",
    "Pareto cut at 4",
    "a table without correlation",
    "losses too correlated",
    "too many held back",
}
"""Wrong by so little that more frames are needed."""


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_emulator_is_caught(name: str) -> None:
    asked, keys, impairment = WRONG[name]
    frames = 6000 if name in SUBTLE else 1500
    assert impairment in outside(check_link(asked, wrongly(**keys), frames=frames))
