"""What the tables of a link refuse, however they are made."""

from collections.abc import Mapping
from typing import Any

import pytest

from farside.link import OneWay
from farside.link.profile.config import DelayPoint, LinkChange, RateStep
from farside.link.profile.impairments import FourState, Reorder


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            {"delay_s": 0.0, "delay_table": (DelayPoint(t_s=0.0, delay_s=1.0),)},
            "expected one of delay_s, delay_table, delay_trace, found delay_s and delay_table",
        ),
        (
            {"rate_bit_s": 800, "rate_table": (RateStep(t_s=0.0, rate_bit_s=80),)},
            "expected one of rate_bit_s, rate_table, rate_trace, found rate_bit_s and rate_table",
        ),
    ],
)
def test_a_direction_has_one_delay_and_one_rate(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        OneWay(**settings)


@pytest.mark.parametrize(
    ("probabilities", "words"),
    [
        ({"p13": 0.6, "p14": 0.5}, r"expected p13 \+ p14 of 1 at most, found 1.1"),
        ({"p13": 0.2, "p31": 0.6, "p32": 0.5}, r"expected p31 \+ p32 of 1 at most, found 1.1"),
        (
            {"p13": 0.2, "p32": 0.3},
            r"expected p31 \(where absent, 1 - p13\) \+ p32 of 1 at most, found 1.1",
        ),
    ],
)
def test_the_probabilities_of_leaving_a_state_are_at_most_one_in_all(
    probabilities: Mapping[str, float], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        FourState(**probabilities)


def test_a_change_replaces_what_it_names_and_leaves_the_rest() -> None:
    before = OneWay(delay_s=1.0, rate_table=(RateStep(t_s=0.0, rate_bit_s=80),), loss=0.1)
    reorder = Reorder(share=0.1, hold_s=0.5)
    change = LinkChange(at_s=3.0, rate_bit_s=800, reorder=reorder)
    assert change.applied_to(before) == OneWay(
        delay_s=1.0, rate_bit_s=800, loss=0.1, reorder=reorder
    )
