"""Traces of delivery opportunities."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link.profile.plans.traces import TraceError, parse_trace


@given(st.lists(st.integers(0, 10**9), min_size=1).map(sorted).filter(lambda times: times[-1] > 0))
def test_a_trace_is_its_lines(times_ms: Sequence[int]) -> None:
    text = "".join(f"{time_ms}\n" for time_ms in times_ms)
    assert list(parse_trace(text, "trace")) == times_ms


def test_the_last_line_need_not_end_and_lines_may_end_as_on_windows() -> None:
    assert parse_trace("0\r\n5\r\n5", "trace") == (0, 5, 5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "up.trace, line 1: expected a whole number of milliseconds, found an empty line"),
        ("1\n\n2\n", "up.trace, line 2: expected a whole number of milliseconds, found an empty"),
        ("1\n2.5\n", "up.trace, line 2: expected a whole number of milliseconds, found 2.5"),
        ("1\n-2\n", "up.trace, line 2: expected a whole number of milliseconds, found -2"),
        ("1\n٣\n", "up.trace, line 2: expected a whole number of milliseconds, found ٣"),
        ("3\n2\n", "up.trace, line 2: expected 3 ms or later, as times do not fall, found 2"),
        ("0\n0\n", "up.trace: expected a last time above 0 ms, found 0"),
    ],
)
def test_an_invalid_trace_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(TraceError) as refusal:
        parse_trace(text, "up.trace")
    assert str(refusal.value).startswith(words)


@given(st.text(max_size=20))
def test_any_text_is_a_trace_or_refused(text: str) -> None:
    try:
        times_ms = parse_trace(text, "trace")
    except TraceError:
        return
    assert list(times_ms) == sorted(times_ms)
    assert times_ms[-1] > 0
