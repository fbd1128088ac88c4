"""The numbers of docs/link.md about jitter without overtaking."""

from pathlib import Path
from statistics import mean

import pytest

from farside.link.emulator import Emulator
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.impairments import Jitter
from farside.node import NS_PER_S, Direction, to_ns

DOCS = Path(__file__).parents[2] / "docs"
FRAMES = 20_000


@pytest.mark.parametrize(
    ("rate", "correlation", "told"),
    [
        (10, 0.0, "by {} ms on average while a frame comes every 100 ms"),
        (100, 0.0, "with one every 10 ms by {} ms"),
        (1000, 0.0, "with one every millisecond by {} ms"),
        (1000, 0.9, "or {} ms if successive jitters are correlated with 0.9"),
    ],
)
def test_jitter_delays_the_more_on_average_the_closer_frames_follow(
    rate: int, correlation: float, told: str
) -> None:
    jitter = Jitter(spread_s=0.05, correlation=correlation)
    link: Emulator[int] = Emulator(LinkConfig(down=OneWay(delay_s=1.0, jitter=jitter)), seed=1)
    step_ns = NS_PER_S // rate
    for number in range(FRAMES):
        link.send(Direction.DOWN, number * step_ns, b"x", number)
    arrived = link.advance(FRAMES * step_ns + to_ns(9))
    mean_ms = mean(at_ns - number * step_ns for at_ns, *_, number in arrived) / 1e6 - 1000
    assert told.format(round(mean_ms)) in " ".join((DOCS / "link.md").read_text().split())
