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


@pytest.mark.parametrize("rate", [10, 100, 1000])
def test_jitter_delays_the_more_on_average_the_closer_frames_follow(rate: int) -> None:
    down = OneWay(delay_s=1.0, jitter=Jitter(spread_s=0.05))
    link: Emulator[int] = Emulator(LinkConfig(down=down), seed=1)
    step_ns = NS_PER_S // rate
    for number in range(FRAMES):
        link.send(Direction.DOWN, number * step_ns, b"x", number)
    arrived = link.advance(FRAMES * step_ns + to_ns(9))
    mean_ms = mean(at_ns - number * step_ns for at_ns, *_, number in arrived) / 1e6 - 1000
    told = f"{rate:,} frames/s by {mean_ms:.1f} ms"
    assert told in " ".join((DOCS / "link.md").read_text().split())
