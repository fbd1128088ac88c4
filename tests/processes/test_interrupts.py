"""Whoever stops a run, at whatever moment and however often, is left with a log that is right."""

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from farside.logs import LogFile
from tests.processes.conftest import until

pytestmark = pytest.mark.processes


def start(out: Path, *options: str, ignoring: bool = False) -> subprocess.Popen[bytes]:
    """A run of a whole mission, as fast as it goes."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN if ignoring else signal.SIG_DFL)
    try:
        return subprocess.Popen(  # noqa: S603 - our own command
            [sys.executable, "-m", "farside", "run", "blackout", "--out", str(out), *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    finally:
        signal.signal(signal.SIGINT, before)


def is_of(log: Path, size_byte: int) -> Callable[[], bool]:
    return lambda: log.exists() and log.stat().st_size >= size_byte


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
@pytest.mark.parametrize(
    ("size_byte", "times", "number"),
    # Each with each of the others once.
    [
        (size_byte, times, (signal.SIGINT, signal.SIGTERM)[(row + times) % 2])
        for row, size_byte in enumerate((1, 100_000, 1_000_000))
        for times in (1, 2, 3)
    ],
)
def test_an_interrupted_run_leaves_a_log_that_is_right_and_says_where(
    tmp_path: Path, size_byte: int, times: int, number: signal.Signals, options: list[str]
) -> None:
    log = tmp_path / "blackout-seed1-1.mcap"
    # So long that no signal comes too late, however busy the machine is.
    run = start(tmp_path, *options, "--set", "duration_s=1e6")
    until(run, is_of(log, size_byte))
    for _ in range(times):
        run.send_signal(number)
    out, err = run.communicate()

    assert run.returncode == 130
    assert b"Traceback" not in out + err
    assert str(log).encode() in out + err
    assert list(tmp_path.iterdir()) == [log], "no scratch file is left"
    left = LogFile(log)
    result = json.loads(left.attachments["result.json"].data)
    assert result["outcome"] == "aborted"
    assert result["digest"] == left.digest()
    with log.open("rb") as file:
        assert sum(1 for _ in make_reader(file).iter_messages()) == sum(
            1 for _ in left.records(pictures=True)
        )


def test_a_run_in_the_background_of_a_script_can_be_stopped_too(tmp_path: Path) -> None:
    """A shell without job control has what it starts in the background ignore Ctrl-C."""
    log = tmp_path / "blackout-seed1-1.mcap"
    run = start(tmp_path, "--in-process", "--pace", "10", ignoring=True)
    until(run, log.exists)
    run.send_signal(signal.SIGINT)
    run.communicate()

    assert run.returncode == 130
    assert LogFile(log).complete


def test_a_run_that_is_stopped_before_its_first_window_leaves_no_log(tmp_path: Path) -> None:
    run = start(tmp_path)
    until(run, lambda: bool(children_of(run.pid)))
    run.send_signal(signal.SIGINT)
    _, err = run.communicate()

    assert run.returncode == 130
    assert b"Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def children_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/task/{pid}/children").read_text()
    except OSError:
        return ""
