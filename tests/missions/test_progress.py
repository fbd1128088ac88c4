"""What a command shows while it goes on, as a terminal gets it."""

import io
import re
import sys
import threading

import pytest
from rich.cells import cell_len
from rich.console import Console

from farside.missions import load_mission
from farside.missions.commands.display import patience as patience_module
from farside.missions.commands.display.patience import patience
from farside.missions.commands.display.progress import ProgressDisplay

ERASED = "\r\x1b[1A\x1b[2K"
CODES = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


class Terminal(io.StringIO):
    """A terminal that keeps what it is told."""

    def __init__(self) -> None:
        super().__init__()
        self.told = threading.Event()

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if "waiting" in text:
            self.told.set()
        return super().write(text)


@pytest.mark.parametrize("width", [40, 80, 120])
def test_the_bar_of_a_run_leaves_room_for_ctrl_c_and_then_nothing(width: int) -> None:
    """At the end of a full line, `^C` would go to the next one, and the bar be erased there."""
    screen = io.StringIO()
    console = Console(file=screen, width=width, force_terminal=True)
    with ProgressDisplay(load_mission("blackout").mission, console) as display:
        for now_s in (10.0, 600.0, 1200.0):
            display.watch(now_s, ())

    shown = screen.getvalue()
    lines = re.split(r"[\r\n]+", CODES.sub("", shown))
    assert any(line.startswith("blackout") for line in lines)
    assert max(map(cell_len, lines)) <= width - 6
    assert shown.endswith(ERASED)


def test_the_end_of_a_run_is_told_while_its_log_is_packed() -> None:
    screen = io.StringIO()
    console = Console(file=screen, width=100, force_terminal=True)
    with ProgressDisplay(load_mission("blackout").mission, console) as display:
        display.watch(1200.0, ())
    assert "finishing the log" in screen.getvalue()


def test_whoever_waits_is_told_what_for_and_the_line_goes_away(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(patience_module, "PATIENCE_S", 0.0)
    with patience("waiting for a planet"):
        assert terminal.told.wait(30)
    assert terminal.getvalue().endswith(ERASED)


def test_what_is_quick_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(patience_module, "PATIENCE_S", 3600.0)
    with patience("waiting for a planet"):
        pass
    assert terminal.getvalue() == ""
