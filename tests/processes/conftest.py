"""A short real mission, and the processes that belong to a test."""

import os
import select
import signal
import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest

from farside.missions import MissionFile, load_mission
from farside.missions.crew.crew import Crew
from farside.node import Record, Role, to_ns

PATIENCE_S = 30.0
LONGEST_S = 120
_LOOK_S = 0.005
PROC = Path("/proc")

LAUNCHER = """
import signal

signal.signal(signal.SIGINT, signal.default_int_handler)

from farside.missions import load_mission
from farside.missions.crew.processes import ProcessCrew

mission = load_mission("blackout").mission
now_ns = 0
print("starting", flush=True)
with ProcessCrew(mission) as crew:
    print("under way", flush=True)
    while True:
        now_ns += mission.window_ns
        crew.advance(now_ns)
"""


@pytest.fixture(autouse=True)
def patience() -> Iterator[None]:
    """Fail a test that waits for another process for too long, instead of blocking the others."""

    def give_up(_signal: int, _frame: object) -> None:
        raise TimeoutError(f"expected the test to end within {LONGEST_S} s, found it waiting")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(LONGEST_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def mission() -> MissionFile:
    """The blackout mission, shortened to a minute."""
    return msgspec.structs.replace(load_mission("blackout").mission, duration_s=60.0)


def until(process: subprocess.Popen[bytes], happened: Callable[[], bool]) -> None:
    """Wait until something has happened, or the process has ended.

    Nothing tells of a file that grows or of another's children, so this looks again and again. In
    between it waits for the end of the process, and leaves the processor to what it waits for.
    """
    while not happened():
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=_LOOK_S)
            return


class Voyage:
    """Advances a crew through the windows of a mission."""

    def __init__(self, crew: Crew, mission: MissionFile) -> None:
        self.crew, self.mission, self.now_ns = crew, mission, 0

    def window(self) -> list[Record]:
        """Advance one window and return its records."""
        self.now_ns += self.mission.window_ns
        return self.crew.advance(self.now_ns)

    def to_the_end(self) -> list[list[Record]]:
        """Advance to the end of the mission and return the records of each window."""
        windows = []
        while self.now_ns < to_ns(self.mission.duration_s):
            windows.append(self.window())
        return windows


@pytest.fixture
def voyage() -> type[Voyage]:
    """Advances a crew through the windows of a mission."""
    return Voyage


class Family:
    """The processes that a test started, recognised by a mark in their environment."""

    def __init__(self, mark: str) -> None:
        self.mark = mark.encode()

    def pids(self) -> list[int]:
        """The processes that are alive."""
        return [int(path.name) for path in PROC.glob("[0-9]*") if self._belongs(path)]

    def _belongs(self, path: Path) -> bool:
        # The environment of a process that has ended cannot be read.
        try:
            return self.mark in (path / "environ").read_bytes()
        except OSError:
            return False

    def roles(self) -> dict[Role, int]:
        """The processes that have a role as an argument of its own."""
        return {Role(word): pid for pid in self.pids() for word in arguments(pid) if word in ROLES}

    def all_end(self) -> bool:
        """Wait until no process is left; `False` if one does not end."""
        return all(ends(pid) for pid in self.pids()) and not self.pids()


ROLES = [role.value for role in Role]


def arguments(pid: int) -> list[str]:
    """The command line of a process; none if it has ended."""
    try:
        return (PROC / str(pid) / "cmdline").read_text().split("\0")
    except OSError:
        return []


def ends(pid: int) -> bool:
    """Wait for the end of a process, child or not; `False` if it does not end."""
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([handle], [], [], PATIENCE_S)[0])
    finally:
        os.close(handle)


@pytest.fixture
def family(monkeypatch: pytest.MonkeyPatch) -> Iterator[Family]:
    """The processes that this test starts. None may be left at its end."""
    name, value = "FARSIDE_TEST_FAMILY", str(uuid.uuid4())
    monkeypatch.setenv(name, value)
    family = Family(f"{name}={value}")
    yield family
    assert family.all_end()


class Launcher:
    """A launcher in a process of its own, as a terminal would start it."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(  # noqa: S603 - the program above
            [sys.executable, "-c", LAUNCHER],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        self._output = self.process.stdout

    def says(self, line: bytes) -> bool:
        """Whether the next line that it prints is this one."""
        return self._output.readline() == line + b"\n"

    def interrupt(self) -> None:
        """Press Ctrl-C, which signals the whole foreground process group."""
        os.killpg(self.process.pid, signal.SIGINT)

    def last_words(self) -> bytes:
        """Wait for its end and return its standard error."""
        return self.process.communicate(timeout=PATIENCE_S)[1]


@pytest.fixture
def launcher(family: Family) -> Iterator[Launcher]:
    """A launcher in a process of its own, about to start its crew."""
    launcher = Launcher()
    try:
        assert launcher.says(b"starting")
        yield launcher
    finally:
        launcher.process.kill()
        launcher.process.communicate()
    assert family.all_end()
