"""`farside console` as it is started in a shell: with all processes, and a person at it."""

import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from browsing import CHROMIUM, chromium
from console_page import visiting

from farside.logs import LogFile
from farside.missions.reliving.verifying import verify
from farside.topics import GROUND_COMMAND

pytestmark = pytest.mark.processes

# The terminal does without what only the page and the stick need.
BARE = (
    "import sys; sys.modules['nicegui'] = sys.modules['sdl2'] = None;"
    "from farside.__main__ import main; main()"
)


def verified(out: Path) -> bool:
    """Whether the one log there has a person's order in it, and comes out the same again."""
    (log,) = out.glob("*.mcap")
    return any(LogFile(log).records([GROUND_COMMAND])) and verify(log).equal


@contextmanager
def started(*command: str, terminal: int | None = None) -> Iterator[subprocess.Popen[str]]:
    """A command that is interrupted, where it has not ended."""
    process = subprocess.Popen(  # noqa: S603 - our own command
        [sys.executable, *command],
        stdin=terminal,
        stdout=subprocess.DEVNULL if terminal is None else terminal,
        stderr=subprocess.PIPE if terminal is None else terminal,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.communicate()


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
def test_a_person_opens_the_page_at_the_address_that_is_printed_and_drives(tmp_path: Path) -> None:
    with (
        started("-m", "farside", "console", "blackout", "--out", str(tmp_path)) as process,
        chromium() as browser,
    ):
        address = next(
            found[0] for line in process.stderr if (found := re.search(r"http://\S+", line))
        )
        with visiting(browser, address) as visitor:
            visitor.page.locator("[data-option=N]").wait_for()
            visitor.settle()
            visitor.press("ArrowUp")
            visitor.hears("drives N")
            visitor.press("n")
            visitor.page.locator(".command.over").filter(has_text="done").wait_for()
            process.send_signal(signal.SIGINT)
            process.communicate()
        assert process.returncode == 130

    assert verified(tmp_path)


def test_a_person_drives_from_a_terminal_and_ends_the_run(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("4H", 40, 120, 0, 0))
    shown = ""

    def sees(text: str) -> None:
        nonlocal shown
        while text not in shown:
            shown += os.read(ours, 65536).decode(errors="replace")

    command = ("console", "blackout", "--text", "--out", str(tmp_path))
    with started("-c", BARE, *command, terminal=theirs) as process:
        os.close(theirs)
        sees("drives N")
        os.write(ours, b"w")
        sees("drive N")
        os.write(ours, b"n")
        sees("told ")  # such as `done 3.8 s ago, told 2.4 s ago`: word of it is here
        os.write(ours, b"\x03")
        try:
            while True:
                shown += os.read(ours, 65536).decode(errors="replace")
        except OSError:  # the terminal's other end is closed
            os.close(ours)
        assert process.wait() == 130, shown[-2000:]

    assert verified(tmp_path)
