"""The console in a terminal: what it draws of a screen, at any size and without colours."""

import io
import re

import msgspec
import pytest
from fake_station import FakeStation
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.console import Console

from farside.console.screen.screen import (
    CommandRow,
    Ghost,
    MapView,
    Said,
    Screen,
    Spot,
    Strip,
    StripWord,
    Tone,
)
from farside.console.text.blocks import way_rows
from farside.console.text.board import board
from farside.console.text.chart import draw_map
from farside.console.text.strip import strip_rows
from farside.console.text.words import said
from farside.node import Direction, to_ns
from farside.places import Chart


def shown(screen: Screen, width: int, height: int) -> list[str]:
    """The rows of a screen, without colours."""
    page = io.StringIO()
    chart = Chart(FakeStation.chart.rows, FakeStation.chart.cell_m)
    console = Console(file=page, width=width, height=height, color_system=None)
    console.print(board(screen, chart, width, height))
    return page.getvalue().splitlines()


@pytest.mark.parametrize(("width", "height"), [(120, 36), (80, 22), (60, 36), (40, 10)])
def test_what_matters_most_is_on_the_screen_at_usual_sizes(width: int, height: int) -> None:
    text = "\n".join(shown(FakeStation().screen(), width, height))

    assert "here 0:10:10.5" in text
    assert re.search(r"rover(, as far as light goes)? 0:10:09.2", text)
    for words in (
        " SHARED ", " 4 ON THE WAY ", " 2 ALARMS ", "If you do nothing: the rover",
        "▸ Proposal 14: E, towards B", "[Esc]", "◇→", "② ",
    ):  # fmt: skip
        assert words in text
    assert re.search(r"» ?E", text)
    assert re.search(r"║ ?S", text)
    assert re.search(r"▒ ?W", text)


@settings(max_examples=20, deadline=None)
@given(width=st.integers(40, 160), height=st.integers(10, 60))
@example(width=40, height=10)
@example(width=76, height=18)
def test_the_board_fills_any_terminal_and_nothing_goes_beyond(width: int, height: int) -> None:
    lines = shown(FakeStation().screen(), width, height)

    assert len(lines) == height
    assert all(cell_len(line) <= width for line in lines)
    text = "\n".join(lines)
    assert "4 ON THE WAY" in lines[1]
    assert "Proposal 14" in text
    assert "◇" in text


def test_text_from_a_hostile_mission_steers_no_terminal_and_is_no_markup() -> None:
    evil = "\x1b]0;owned\x07[red]x[/red]\n"
    screen = FakeStation().screen()
    hostile = msgspec.structs.replace(
        screen,
        mission=evil,
        if_nothing=evil,
        mode=Said(evil, evil),
        status=(Said(evil, evil),),
        rover=(Said(evil, evil),),
        events=tuple(msgspec.structs.replace(row, text=evil) for row in screen.events),
        alarms=tuple(msgspec.structs.replace(row, text=evil) for row in screen.alarms),
        commands=tuple(msgspec.structs.replace(row, text=evil) for row in screen.commands),
        goals=tuple(msgspec.structs.replace(row, text=evil) for row in screen.goals),
        options=tuple(msgspec.structs.replace(row, why=evil) for row in screen.options),
        map=msgspec.structs.replace(screen.map, policy_label=evil, heard_label=evil),
    )

    text = "\n".join(shown(hostile, 160, 50))

    assert "\x1b" not in text
    assert "\x07" not in text
    for start in ("ALARMS", "NEXT", "ROVER", "ON THE WAY", "EVENTS"):
        assert r"\x1b]0;owned\x07[red]x[/red]\n" in text.partition(start)[2]


def test_every_command_on_its_way_has_a_row_before_one_has_two() -> None:
    many = tuple(CommandRow(n, "drive E", ("begins in 2.9 s · " * 9,)) for n in (9, 8, 7))
    screen = msgspec.structs.replace(FakeStation().screen(), commands=many)

    assert [row.plain[:3] for row in way_rows(screen, 60, 3)] == ["9 d", "8 d", "7 d"]
    assert [row.plain[:3] for row in way_rows(screen, 60, 4)] == ["9 d", "   ", "8 d", "7 d"]


def test_a_tone_and_a_stale_value_are_seen_without_colours() -> None:
    assert said(Said("battery", "92 %", stale=True)).plain == "battery [92 %]"
    assert said(Said("silence", "unexpected", Tone.WRONG)).plain == "!! silence unexpected"


def test_a_prediction_below_one_half_is_a_region_and_no_ghost() -> None:
    chart = Chart(("####", "#..#", "#..#", "####"), 1.0)
    sure = Ghost((Spot(1, 1, 0.5), Spot(2, 1, 0.4)), None, "")
    vague = Ghost((Spot(1, 1, 0.49), Spot(2, 1, 0.4)), None, "")

    def rows(ghost: Ghost) -> list[str]:
        return [row.plain for row in draw_map(MapView(now=ghost), chart, 8, 4).rows[1:3]]

    assert rows(sure) == ["██    ██", "██◌   ██"]
    assert rows(vague) == ["██    ██", "██░░░░██"]


def test_the_strip_tells_known_from_not_known_and_until_when_one_can_take_back() -> None:
    strip = Strip(
        from_ns=to_ns(-60),
        until_ns=to_ns(60),
        known_ns=to_ns(8.8),
        words=(StripWord(Direction.UP, "command 7: drive E", to_ns(9), to_ns(10.2), "7"),),
        begins=((7, to_ns(12)),),
        take_backs=((7, to_ns(10.8)),),
        gaps=((to_ns(6), to_ns(7)),),
    )

    rows = [row.plain.rstrip() for row in strip_rows(strip, to_ns(10), 52)]

    assert rows == [
        "ground ──────────     ──────────7────┃───✕──────────",
        "                                 ╲   ┃",
        "                                   ╲ ┃",
        "                                    ╲┃",
        "rover  ────────────────────────┄┄┄┄┄┄┃┄┄┄┄┄┄┄┄┄7┄┄┄┄",
    ]
