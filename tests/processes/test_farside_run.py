"""`farside run` from a terminal, when one of its processes dies or the user stops it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from signal import Signals
from typing import Any

import pytest

from farside.control import Mode
from farside.logs import LogError, LogFile
from farside.logs import open as open_log
from farside.node import Role, to_ns
from farside.topics import TRUTH_POSE
from tests.processes.conftest import Family, until

pytestmark = pytest.mark.processes

DURATION_S = 120.0
PATIENCE_S = 3.0


class Terminal:
    """A `farside run` in progress, and its log."""

    def __init__(self, out: Path, family: Family) -> None:
        command = [
            sys.executable,
            "-m",
            "farside",
            "run",
            "blackout",
            "--json",
        ]
        changes = ["--set", f"duration_s={DURATION_S}", "--set", "expect=[]"]
        self.family = family
        self.log = out / "blackout-seed1-1.mcap"
        self.process = subprocess.Popen(  # noqa: S603 - our own command
            [
                *command,
                *changes,
                "--pace",
                "40",
                "--out",
                str(out),
                "--give-up-after",
                str(PATIENCE_S),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )

    def until(self, t_s: float) -> None:
        """Wait until the log has reached `t_s`."""
        until(self.process, lambda: self._has_reached(t_s))
        assert self.process.poll() is None, self.process.communicate()

    def _has_reached(self, t_s: float) -> bool:
        try:
            return LogFile(self.log).end_ns >= to_ns(t_s)
        except LogError:  # not there yet
            return False

    def kill(self, role: Role) -> None:
        os.kill(self.family.roles()[role], signal.SIGKILL)

    def suspend(self, role: Role) -> None:
        """Stop a process without ending it."""
        os.kill(self.family.roles()[role], signal.SIGSTOP)

    def end(self) -> tuple[int, Any, str]:
        """Wait for the end: exit status, result if it printed one, and standard error."""
        out, err = self.process.communicate(timeout=60)
        return self.process.returncode, json.loads(out) if out else None, err.decode()


@pytest.fixture
def terminal(tmp_path: Path, family: Family) -> Iterator[Terminal]:
    """A `farside run` that has reached 5 s of simulated time."""
    terminal = Terminal(tmp_path, family)
    try:
        terminal.until(5.0)
        yield terminal
    finally:
        terminal.process.kill()
        terminal.process.communicate()


@pytest.mark.parametrize("lost", [Role.GROUND, Role.LINK])
def test_without_ground_or_link_the_rover_goes_on_alone(terminal: Terminal, lost: Role) -> None:
    terminal.kill(lost)
    status, result, err = terminal.end()
    assert status == 3
    assert result["outcome"] == "aborted"
    assert [lost_process["role"] for lost_process in result["lost_processes"]] == [lost]
    assert f"the {lost} process was ended by SIGKILL" in err
    assert str(terminal.log) in err
    run = open_log(terminal.log)
    assert LogFile(terminal.log).complete
    assert run.entries(TRUTH_POSE)[-1][0] > DURATION_S - 2, "the rover went on to the end"
    autonomous = [mode for mode in run.modes if mode.mode is Mode.AUTONOMOUS]
    assert [mode.why for mode in autonomous] == ["link lost"]
    assert autonomous[0].t_s < 60


def test_without_the_rover_the_run_ends_with_a_complete_log(terminal: Terminal) -> None:
    terminal.kill(Role.ROVER)
    status, result, err = terminal.end()
    assert status == 3
    assert result["outcome"] == "aborted"
    assert "the rover process was ended by SIGKILL" in err
    assert str(terminal.log) in err
    log = LogFile(terminal.log)
    assert log.complete
    assert to_ns(5.0) <= log.end_ns < to_ns(DURATION_S)
    assert log.digest() == result["digest"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_its_result_and_a_complete_log(
    terminal: Terminal, number: Signals
) -> None:
    os.killpg(terminal.process.pid, number)
    status, result, err = terminal.end()
    assert status == 130
    assert result["outcome"] == "aborted"
    assert "Traceback" not in err
    log = LogFile(terminal.log)
    assert log.complete
    assert log.digest() == result["digest"]


def test_a_run_ends_when_a_process_is_stopped_for_longer_than_it_may(terminal: Terminal) -> None:
    terminal.suspend(Role.LINK)
    status, result, err = terminal.end()
    assert status == 3
    assert result["outcome"] == "aborted"
    assert "process was not ready after" in err
    assert str(terminal.log) in err
    log = LogFile(terminal.log)
    assert log.complete
    assert log.digest() == result["digest"]


def test_a_second_signal_ends_a_run_that_waits_for_a_stopped_process(terminal: Terminal) -> None:
    terminal.suspend(Role.LINK)
    for number in (signal.SIGINT, signal.SIGTERM):
        terminal.process.send_signal(number)
    status, result, err = terminal.end()
    assert status == 130
    assert "Traceback" not in err
    log = LogFile(terminal.log)
    assert log.complete
    assert log.digest() == result["digest"]


def test_a_killed_launcher_leaves_an_unfinished_log_up_to_its_last_window(
    terminal: Terminal,
) -> None:
    terminal.process.kill()
    terminal.process.communicate()
    assert terminal.family.all_end()
    log = LogFile(terminal.log)
    assert not log.complete
    assert log.end_ns >= to_ns(5.0)
    assert list(log.records())
