"""Whoever reads the output of `farside` may stop: the exit status then tells no wrong verdict."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO

import pytest

pytestmark = pytest.mark.processes

SIGPIPE_STATUS = 141
RUN = ("run", "blackout", "--in-process", "--set", "duration_s=2", "--set", "expect=[]")


@pytest.fixture
def farside(tmp_path: Path) -> Callable[..., tuple[int, bytes | None]]:
    """Runs `python -m farside ...`: exit status and what it said to standard error, if that is."""

    def run(
        *arguments: str | Path,
        stdout: int | IO[bytes],
        stderr: int | IO[bytes] = subprocess.PIPE,
        before: Callable[[], None] | None = None,
    ) -> tuple[int, bytes | None]:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-m", "farside", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            cwd=tmp_path,
            check=False,
            timeout=60,
            preexec_fn=before,
        )
        return done.returncode, done.stderr

    return run


@pytest.fixture
def closed_pipe() -> Iterator[int]:
    """The end to write to of a pipe that nobody reads from."""
    reader, writer = os.pipe()
    os.close(reader)
    yield writer
    os.close(writer)


@pytest.fixture
def log(farside: Callable[..., tuple[int, bytes | None]], tmp_path: Path) -> Path:
    """A short log."""
    assert farside(*RUN, "--out", ".", stdout=subprocess.DEVNULL)[0] == 0
    return next(tmp_path.glob("*.mcap"))


@pytest.mark.parametrize(
    "arguments",
    [
        RUN,
        (*RUN, "--json"),
        ("check", "blackout"),
        ("--help",),
        ("link", "check", "moon", "--frames", "100"),
        ("--version",),
    ],
)
def test_a_reader_who_has_seen_enough_ends_it_like_sigpipe(
    farside: Callable[..., tuple[int, bytes | None]], closed_pipe: int, arguments: Sequence[str]
) -> None:
    assert farside(*arguments, stdout=closed_pipe) == (SIGPIPE_STATUS, b"")


def test_so_it_does_a_replay(
    farside: Callable[..., tuple[int, bytes | None]], closed_pipe: int, log: Path
) -> None:
    assert farside("replay", log, stdout=closed_pipe) == (SIGPIPE_STATUS, b"")


def test_nobody_has_to_read_standard_error(
    farside: Callable[..., tuple[int, bytes | None]], closed_pipe: int
) -> None:
    assert farside(*RUN, stdout=subprocess.DEVNULL, stderr=closed_pipe)[0] == 0
    assert farside("run", "no.toml", stdout=subprocess.DEVNULL, stderr=closed_pipe)[0] == 2
    assert farside(*RUN, stdout=closed_pipe, stderr=closed_pipe)[0] == SIGPIPE_STATUS


def test_an_unmet_expectation_stays_status_1_with_standard_error_gone(
    farside: Callable[..., tuple[int, bytes | None]], closed_pipe: int
) -> None:
    unmet = (*RUN[:-2], "--set", 'expect=[{what="reached", place="A"}]')
    assert farside(*unmet, stdout=subprocess.DEVNULL, stderr=closed_pipe)[0] == 1


def test_streams_may_be_closed_altogether(
    farside: Callable[..., tuple[int, bytes | None]], tmp_path: Path
) -> None:
    def close_both() -> None:
        os.close(1)
        os.close(2)

    status, _ = farside(*RUN, "--out", ".", stdout=None, stderr=None, before=close_both)
    assert status == 0
    assert len(list(tmp_path.glob("*.mcap"))) == 1


@pytest.mark.parametrize("arguments", [RUN, (*RUN, "--json"), ("check", "blackout"), ("--help",)])
def test_a_full_disk_under_standard_output_is_status_3_and_words(
    farside: Callable[..., tuple[int, bytes | None]], arguments: Sequence[str]
) -> None:
    with open("/dev/full", "w") as full:  # noqa: PTH123
        status, said = farside(*arguments, stdout=full)
    assert status == 3
    assert said == b"farside: standard output cannot be written: No space left on device\n"
