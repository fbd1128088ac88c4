"""Distribution tables of tc-netem."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link.profile.impairments import JitterShape
from farside.link.profile.jitter import deviation
from farside.link.profile.plans.dist import DistributionError, parse_distribution

TC = Path("/usr/lib/x86_64-linux-gnu/tc")


@given(st.lists(st.integers(-32768, 32767), min_size=1, max_size=40), st.sampled_from([" ", "\n"]))
def test_a_table_is_its_numbers(entries: list[int], between: str) -> None:
    text = "# a table\n" + between.join(map(str, entries))
    assert parse_distribution(text, "a.dist") == tuple(entries)


def test_numbers_are_read_as_by_tc() -> None:
    text = "# from maketable\n\n -5461 +12\t0x10 010 # to the end\r\n0 -0x2\n"
    assert parse_distribution(text, "a.dist") == (-5461, 12, 16, 8, 0, -2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a.dist: expected whole numbers, found none"),
        ("# only\n\n", "a.dist: expected whole numbers, found none"),
        ("1 2\n3 x 4\n", "a.dist, line 2: expected whole numbers of -32768 to 32767, found x"),
        ("1.5\n", "a.dist, line 1: expected whole numbers of -32768 to 32767, found 1.5"),
        ("32768\n", "a.dist, line 1: expected whole numbers of -32768 to 32767, found 32768"),
        ("09\n", "a.dist, line 1: expected whole numbers of -32768 to 32767, found 09"),
        ("1\n" * 16_385, "a.dist, line 16385: expected 16384 entries at most, found more"),
    ],
)
def test_what_tc_would_pass_over_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(DistributionError) as refusal:
        parse_distribution(text, "a.dist")
    assert str(refusal.value) == words


def test_an_error_about_a_long_word_is_short() -> None:
    with pytest.raises(DistributionError) as refusal:
        parse_distribution("9" * 100_000, "a.dist")
    assert len(str(refusal.value)) < 200


@given(st.text(max_size=30))
def test_any_text_is_a_table_or_refused(text: str) -> None:
    try:
        entries = parse_distribution(text, "a.dist")
    except DistributionError:
        return
    assert all(-32768 <= entry <= 32767 for entry in entries)


@pytest.mark.skipif(not TC.is_dir(), reason="iproute2 is not installed here")
@pytest.mark.parametrize("shape", ["normal", "pareto", "paretonormal"])
def test_the_shapes_are_those_of_the_tables_that_come_with_tc(shape: str) -> None:
    table = parse_distribution((TC / f"{shape}.dist").read_text(), f"{shape}.dist")
    assert list(table) == sorted(table)
    from scipy import special  # type: ignore[import-untyped] # noqa: PLC0415 - takes long

    # Between the ends: there the tables are cut, at 4 deviations or where their maker stopped.
    entries = range(200, 3900, 50)
    own = [deviation(JitterShape(shape), float(special.ndtri(n / len(table)))) for n in entries]
    assert np.array(own) == pytest.approx(np.array([table[n] for n in entries]) / 8192, abs=2e-3)
