"""Delays as measured: files of a time and a one-way delay, and what follows the last point."""

import math
from pathlib import Path
from typing import Any

import pytest
from channels import DOWN, UP, fate_of, frame, link
from hypothesis import given
from hypothesis import strategies as st

from farside.link import LinkConfig, OneWay
from farside.link.profile.config import AfterLast, DelayPoint, DelayTrace
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.delays import DelayFileError, parse_delays
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import resolve_link
from farside.link.profile.schedule import Delay
from farside.node import to_ns, to_s


def points(*pairs: tuple[float, float]) -> tuple[DelayPoint, ...]:
    return tuple(DelayPoint(t_s=t_s, delay_s=delay_s) for t_s, delay_s in pairs)


@pytest.mark.parametrize(
    "text",
    [
        "0 0.25\n10 0.5\n",
        "0,0.25\r\n10,0.5",
        "# of Tuesday\n\n0\t0.25  # first\n  10 , .5e0\n",
        "time,delay\n0,0.25\n10,0.5\n",
        "t_s, owd_ms\n0, 250\n10, 500\n",
        "time (ms), delay [us]\n0, 250000\n10000, 500000\n",
        "t_us delay_ns\n0 250000000\n10000000 500000000\n",
        "time (s)  delay (ms)\n0 250\n10 500\n",
    ],
)
def test_a_measurement_is_read_however_it_is_set(text: str) -> None:
    found = parse_delays(text, "owd.csv")
    assert [one.t_s for one in found] == pytest.approx([0, 10])
    assert [one.delay_s for one in found] == pytest.approx([0.25, 0.5])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a.csv: expected a time and a delay per line, found none"),
        ("t_s,delay_s\n", "a.csv: expected a time and a delay per line, found none"),
        ("0,1\n1\n", "a.csv, line 2: expected a time and a delay, found 1"),
        ("0,1,2\n", "a.csv, line 1: expected a time and a delay, found 0,1,2"),
        ("0 1\nx y\n", "a.csv, line 2: expected a time and a delay, found x y"),
        ("0 1\n#\n0 2\n", "a.csv, line 3: expected a time after 0 s, as times grow, found 0 s"),
        ("0 -1\n", "a.csv, line 1: expected a delay of 0 to 1e+09 s, found -1 s"),
        ("0 1e999\n", "a.csv, line 1: expected a delay of 0 to 1e+09 s, found inf s"),
        ("0 \u0663\n", "a.csv, line 1: expected a time and a delay, found 0 \u0663"),
        ("t" + " " * 10**5 + "%", "a.csv, line 1: expected a time and a delay, or the names of"),
        ("0 nan\n", "a.csv, line 1: expected a time and a delay, found 0 nan"),
        ("t_s,rtt_ms\n0,9\n", "a.csv, line 1: expected delays of one way, found the column rtt_ms"),
        ("t_min,delay_s\n", "a.csv, line 1: expected a unit among s, sec, seconds, ms, us,"),
        ("t_s,delay_s,loss\n", "a.csv, line 1: expected a time and a delay, or the names of two"),
    ],
)
def test_what_is_no_measurement_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(DelayFileError) as refusal:
        parse_delays(text, "a.csv")
    assert str(refusal.value).startswith(words)
    assert len(str(refusal.value)) < 200


@given(st.text(max_size=30))
def test_any_text_is_a_measurement_or_refused(text: str) -> None:
    try:
        found = parse_delays(text, "a.csv")
    except DelayFileError:
        return
    assert all(math.isfinite(one.t_s) and one.delay_s >= 0 for one in found)


def resolved(folder: Path, **trace: Any) -> LinkConfig:
    up = OneWay(delay_trace=DelayTrace(**trace))
    return resolve_link(
        LinkConfig(up=up, down=OneWay(delay_s=1.0)), folder=folder, window=Window.of(9.0)
    )


def test_a_file_that_holds_is_a_table(tmp_path: Path) -> None:
    (tmp_path / "owd.csv").write_text("0 1\n10 2\n")
    link = resolved(tmp_path, file="owd.csv")
    assert link.up == OneWay(delay_table=points((0, 1), (10, 2)))
    assert resolve_link(link, folder=tmp_path, window=Window.of(9.0)) == link


def test_a_file_of_many_points_is_taken_whole(tmp_path: Path) -> None:
    lines = (f"{n} {0.1 + n % 7 / 100}\n" for n in range(30_000))
    (tmp_path / "owd.csv").write_text("".join(lines))
    assert len(resolved(tmp_path, file="owd.csv", at_end="wrap").up.delay_points) == 30_000


@pytest.mark.parametrize(
    ("trace", "words"),
    [
        ({}, "up.delay_trace: expected either file or points, found neither"),
        ({"file": "a.csv", "points": points((0, 1))}, "either file or points, found both"),
        ({"file": "no.csv"}, "up.delay_trace.file: expected a file, found: "),
        ({"file": "bad.csv"}, "bad.csv, line 2: expected a time after 5 s"),
        ({"file": "at0.csv", "at_end": AfterLast.WRAP}, "expected a last t_s above 0"),
    ],
)
def test_a_trace_that_cannot_be_used_is_refused(
    tmp_path: Path, trace: dict[str, Any], words: str
) -> None:
    (tmp_path / "bad.csv").write_text("5 1\n5 1\n")
    (tmp_path / "at0.csv").write_text("0 1\n")
    with pytest.raises(LinkConfigError, match=words):
        resolved(tmp_path, **trace)


def test_points_out_of_order_are_told_by_their_index() -> None:
    many = [(float(n), 1.0) for n in range(30_000)]
    many[20_000] = (7.0, 1.0)
    with pytest.raises(ValueError, match="found 7 at index 20000, after 19999") as refusal:
        OneWay(delay_table=points(*many))
    assert len(str(refusal.value)) < 200


WRAPPING = DelayTrace(points=points((2, 4), (10, 8)), at_end=AfterLast.WRAP)


@pytest.mark.parametrize(
    ("sent_s", "delay_s"), [(0, 4), (2, 4), (6, 6), (9, 7.5), (10, 4), (16, 6), (1e6 + 4, 5)]
)
def test_a_measurement_that_wraps_begins_again_after_its_last_point(
    sent_s: float, delay_s: float
) -> None:
    assert Delay(OneWay(delay_trace=WRAPPING)).at(to_ns(sent_s)) == to_ns(delay_s)


def test_the_channel_delays_by_the_trace() -> None:
    config = link(up=OneWay(delay_trace=WRAPPING), down=OneWay(delay_s=2.0))
    found = fate_of(config, [frame(UP, 0, 6.0), frame(UP, 1, 16.0)])
    assert [to_s(found[n].arrival_ns or 0) for n in (0, 1)] == [12.0, 22.0]
    assert config.lookahead_ns == to_ns(2.0)
    assert config.way(DOWN).greatest_delay_ns == to_ns(2.0)


def test_a_report_is_told_where_a_trace_turns() -> None:
    turns = Delay(OneWay(delay_trace=WRAPPING)).turns_ns(to_ns(9.0), to_ns(31.0))
    assert [to_s(ns) for ns in turns] == [10, 12, 20, 22, 30]
