"""The light strip: words as slanted lines between the ground's rail and the rover's."""

import io
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import LogFile, picture_at
from farside.logs.terminal.strip import STRIP_HEIGHT, LightStrip
from farside.node import Direction, to_ns


def drawn(log: LogFile, now_s: float, width: int = 60) -> list[str]:
    """The rows of the strip at a time, without its frame."""
    page = io.StringIO()
    picture = picture_at(log, to_ns(now_s))
    Console(file=page, width=width, color_system=None).print(
        LightStrip(log).draw(picture, to_ns(now_s), width)
    )
    lines = page.getvalue().splitlines()
    assert len(lines) == STRIP_HEIGHT
    assert {len(line) for line in lines} == {width}
    return [line[2:-2].rstrip() for line in lines[1:-1]]


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """Light takes 1.2 s; a word up at 4 s, a lost one down at 6 s, a blackout from 8 s to 9 s."""
    run.start().hear(1.2, "at:A", since_s=0)
    run.frame(4, Direction.UP).frame(6, Direction.DOWN, Fate.LOST)
    for t_s, down in ((8, True), (9, False)):
        for direction in Direction:
            run.note(t_s, LinkOutage(direction, down=down, reason=OutageReason.BLACKOUT))
    return LogFile(run.log(path))


def test_words_slant_towards_where_they_go_and_a_lost_one_ends_on_its_way(log: LogFile) -> None:
    assert drawn(log, 9) == [
        "ground ─────────────────────────────────────────┃",
        "                        ╲                       ┃",
        "                          ╲         ×           ┃",
        "                           ╲      ╱             ┃",
        "rover  ────────────────────────────────────     ┃",
    ]


def test_a_word_on_its_way_is_dotted_where_it_will_be(log: LogFile) -> None:
    assert drawn(log, 4.4)[1:4] == [
        "                                               ╲┃",
        "                                                ┃·",
        "                                                ┃ ·",
    ]


def test_as_ground_there_is_only_what_the_ground_sent_and_heard(log: LogFile) -> None:
    rows = drawn(log.as_ground(), 9)

    assert "×" not in "".join(rows)
    assert rows[-1].count("─") == 41


def test_the_numbers_of_commands_stand_where_they_were_sent(flown: LogFile) -> None:
    rows = drawn(flown, 619, width=100)

    assert "──92──" in rows[0]
    assert "──93──" in rows[0]
    assert rows[2].count("×") >= 1
