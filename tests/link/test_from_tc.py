"""What docs/link.md says of tc-netem and mahimahi is so."""

import re
import tomllib
from pathlib import Path

import msgspec
import numpy as np
import pytest

from farside.link import OneWay
from farside.link.profile.impairments import JitterShape
from farside.link.profile.statistics import jitter_quantile

PAGE = Path(__file__).parents[2] / "docs" / "link.md"


def rows() -> dict[str, str]:
    """The rows of the translation table: options there, and keys here."""
    _, _, section = PAGE.read_text("utf-8").partition("## From tc and mahimahi\n")
    table, _, _ = section.partition("\n## ")
    found = re.findall(r"^\| `(.+?)` \| `(.+?)` \|", table, re.MULTILINE)
    return dict(found)


@pytest.mark.parametrize("there", rows())
def test_the_keys_given_for_an_option_are_those_of_a_direction(there: str) -> None:
    msgspec.convert(tomllib.loads(f"way = {{{rows()[there]}}}")["way"], OneWay)


@pytest.mark.parametrize("there", [there for there in rows() if "100ms" in there or "..." in there])
def test_a_delay_of_100_ms_is_one_on_average(there: str) -> None:
    way = msgspec.convert(tomllib.loads(f"way = {{{rows()[there]}}}")["way"], OneWay)
    mean_s = way.delay_s or 0.0
    if way.jitter is not None and way.jitter.shape is not JitterShape.TABLE:
        quantiles = jitter_quantile(way.jitter, (np.arange(100_000) + 0.5) / 100_000)
        assert quantiles.min() < 0.003
        mean_s += float(quantiles.mean())
    elif way.jitter is not None:
        mean_s += way.jitter.mean_s
    assert mean_s == pytest.approx(0.1, abs=3e-4)


def test_losses_that_tc_correlates_by_mixing_numbers_are_fewer() -> None:
    """What `get_crandom` of the kernel's sch_netem.c makes of a uniform number and the last one."""
    last, lost = 0.5, 0
    for fresh in np.random.default_rng(1).random(100_000).tolist():
        last = fresh * (1 - 0.4) + last * 0.4
        lost += last < 0.1
    assert lost / 100_000 == pytest.approx(0.004, abs=0.0008)


def test_without_overtaking_jitter_makes_frames_that_follow_closely_later() -> None:
    jitter_ms = np.random.default_rng(1).uniform(0, 50, 100_000)
    for gap_ms, mean_ms in ((100, 25), (10, 30), (1, 42)):
        sent_ms = np.arange(len(jitter_ms)) * gap_ms
        arrived_ms = np.maximum.accumulate(sent_ms + jitter_ms)
        assert (arrived_ms - sent_ms).mean() == pytest.approx(mean_ms, abs=0.5)
