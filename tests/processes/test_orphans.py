"""However the launcher ends, its processes end with it."""

import os
import signal

import pytest

from farside.node import Role
from tests.processes.conftest import Family, Launcher, until

pytestmark = pytest.mark.processes

# At the end of every test here, the fixtures wait for all processes to end.


def test_a_killed_launcher_leaves_no_orphan(launcher: Launcher, family: Family) -> None:
    assert launcher.says(b"under way")
    assert family.roles().keys() == set(Role)
    launcher.process.kill()
    launcher.last_words()
    assert family.all_end()


@pytest.mark.parametrize("started", [1, 2, 3])
def test_a_launcher_killed_during_its_start_leaves_no_orphan(
    started: int, launcher: Launcher, family: Family
) -> None:
    until(launcher.process, lambda: len(family.roles()) >= started)
    launcher.process.kill()
    launcher.last_words()
    assert family.all_end()


def test_ctrl_c_leaves_no_orphan(launcher: Launcher, family: Family) -> None:
    assert launcher.says(b"under way")
    launcher.interrupt()
    assert launcher.last_words().endswith(b"KeyboardInterrupt\n")
    assert family.pids() == []


@pytest.mark.parametrize("started", [1, 2, 3])
def test_ctrl_c_during_the_start_leaves_no_orphan(
    started: int, launcher: Launcher, family: Family
) -> None:
    until(launcher.process, lambda: len(family.roles()) >= started)
    launcher.interrupt()
    assert launcher.last_words().endswith(b"KeyboardInterrupt\n")
    assert family.all_end()


def test_ctrl_c_ends_a_run_in_which_a_process_hangs(launcher: Launcher, family: Family) -> None:
    assert launcher.says(b"under way")
    os.kill(family.roles()[Role.GROUND], signal.SIGSTOP)
    launcher.interrupt()
    assert launcher.last_words().endswith(b"KeyboardInterrupt\n")
    assert family.pids() == []
