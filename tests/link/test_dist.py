"""Distribution tables of tc-netem."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link import LinkConfig
from farside.link.profile.impairments import Jitter, JitterShape, Slots
from farside.link.profile.jitter import deviation
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.dist import DistributionError, parse_distribution
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import resolve_link

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


def test_files_are_read_wherever_a_distribution_can_be_given(tmp_path: Path) -> None:
    (tmp_path / "a.dist").write_text("-8192 8192\n")
    table = {"shape": "table", "spread_s": 0.1, "mean_s": 0.2, "file": "a.dist"}
    tables = {
        "up": {"delay_s": 1.0, "jitter": table, "slots": {"wait": table}},
        "down": {"delay_s": 1.0},
        "changes": [{"at_s": 9.0, "jitter": table, "slots": {"wait": table, "frames": 2}}],
    }
    link = resolve_link(msgspec.convert(tables, LinkConfig), folder=tmp_path, window=Window.of(9.0))
    read = Jitter(spread_s=0.1, shape=JitterShape.TABLE, mean_s=0.2, table=(-8192, 8192))
    assert (link.up.jitter, link.up.slots) == (read, Slots(wait=read))
    assert (link.changes[0].jitter, link.changes[0].slots) == (read, Slots(wait=read, frames=2))
    assert resolve_link(link, folder=tmp_path, window=Window.of(9.0)) == link


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"jitter": {"spread_s": 1, "shape": "table", "file": "no"}}, "changes.0.jitter.file: exp"),
        (
            {"slots": {"wait": {"spread_s": 1, "shape": "table", "file": "b.dist"}}},
            "changes.0.slots.wait.file: .*b.dist, line 1: expected whole numbers",
        ),
    ],
)
def test_a_file_that_is_no_table_is_refused_by_its_key(
    tmp_path: Path, change: dict[str, Any], words: str
) -> None:
    (tmp_path / "b.dist").write_text("0.5\n")
    way = {"delay_s": 1.0}
    tables = {"up": way, "down": way, "changes": [{"at_s": 9.0} | change]}
    with pytest.raises(LinkConfigError, match=words):
        resolve_link(msgspec.convert(tables, LinkConfig), folder=tmp_path, window=Window.of(9.0))
