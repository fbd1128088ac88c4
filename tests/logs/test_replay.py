"""A replay where there is no terminal: the events, a line each."""

import io
import math
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from farside.control import Mode, ModeCause
from farside.frames import LinkOutage, OutageReason
from farside.logs import LogFile, Recorder, replay
from farside.node import Direction
from farside.topics import ModeEntry, Silence


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A run of 8 s with events at 0, 2, 5 and 8 s."""
    run.start().note(2, LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT))
    run.note(5, ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)).note(8, Silence(silent=True))
    return LogFile(run.log(path))


def pipe() -> Console:
    return Console(file=io.StringIO(), force_terminal=False, width=40)


def output(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_without_a_terminal_every_event_is_a_line_and_nothing_is_paced(log: LogFile) -> None:
    console = pipe()

    replay(log, console)

    assert output(console) == (
        "      0.0 s  rover   mode guided: start\n"
        "      0.0 s  rover   failsafe nominal: the link is up\n"
        "      2.0 s  link    uplink: blackout begins\n"
        "      5.0 s  rover   mode autonomous: link lost\n"
        "      8.0 s  ground  hears nothing from the rover\n"
    )


def test_lines_begin_at_the_given_start(log: LogFile) -> None:
    console = pipe()

    replay(log, console, start_s=5)

    assert output(console) == (
        "      5.0 s  rover   mode autonomous: link lost\n"
        "      8.0 s  ground  hears nothing from the rover\n"
    )


def test_the_end_of_an_unfinished_log_is_named(run: Any, path: Path) -> None:
    console = pipe()
    with Recorder(path) as recorder:
        recorder.write(run.start().records)
        recorder.flush()
        replay(LogFile(path), console)

    assert "The log ends here, unfinished" in output(console)


def test_a_log_that_is_still_written_is_printed_on_until_it_is_whole(run: Any, path: Path) -> None:
    console, printed = pipe(), []
    recorder = Recorder(path)
    recorder.write(run.start().records)
    recorder.flush()
    silence = run.note(8, Silence(silent=True)).records[-1:]

    def sleep(_seconds: float) -> None:
        printed.append(output(console).count("\n"))
        if len(printed) == 2:
            recorder.write(silence)
            recorder.flush()
        elif len(printed) == 3:
            recorder.close()

    replay(LogFile(path), console, follow=True, sleep=sleep)

    assert printed == [2, 2, 3]
    assert output(console).endswith("8.0 s  ground  hears nothing from the rover\n")


def test_what_the_ground_could_not_know_is_not_printed(log: LogFile) -> None:
    console = pipe()

    replay(log.as_ground(), console)

    assert output(console) == "      8.0 s  ground  hears nothing from the rover\n"


@pytest.mark.parametrize("speed", [0, -1, math.nan])
def test_a_speed_that_is_not_positive_is_refused(log: LogFile, speed: float) -> None:
    with pytest.raises(ValueError, match="expected a speed above 0"):
        replay(log, pipe(), speed=speed)


@pytest.mark.parametrize("start_s", [-1, 8.1, math.nan])
def test_a_start_outside_the_run_is_refused(log: LogFile, start_s: float) -> None:
    with pytest.raises(ValueError, match=r"expected a start within the run, 0 to 8\.0 s"):
        replay(log, pipe(), start_s=start_s)
