"""Replays on a fake clock, which moves only when the replay sleeps."""

import io
import math
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from farside.control import Mode, ModeCause
from farside.frames import LinkOutage, OutageReason
from farside.logs import LogFile, Recorder, replay
from farside.node import Direction
from farside.topics import ModeEntry, Silence


class FakeClock:
    """Wall time in seconds, from an arbitrary origin."""

    def __init__(self) -> None:
        self.time_s = 1000.0
        self.sleeps = 0

    def now(self) -> float:
        """Wall time."""
        return self.time_s

    def sleep(self, seconds: float) -> None:
        """Let wall time pass."""
        self.time_s += seconds
        self.sleeps += 1


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A run of 8 s with events at 0, 2, 5 and 8 s."""
    run.start().note(2, LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT))
    run.note(5, ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)).note(8, Silence(silent=True))
    return LogFile(run.log(path))


def terminal(*, width: int = 80) -> Console:
    return Console(
        file=io.StringIO(), width=width, height=24, force_terminal=True, force_interactive=True,
        color_system=None,
    )  # fmt: skip


def pipe() -> Console:
    return Console(file=io.StringIO(), force_terminal=False, width=40)


def output(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def times_shown(console: Console) -> list[float]:
    clocks = re.findall(r"  (\d\.\d) s / 8\.0 s", output(console))
    return [float(seconds) for seconds in clocks]


def test_simulated_time_keeps_pace_with_the_wall_clock(log: LogFile, clock: FakeClock) -> None:
    console = terminal()

    replay(log, console, speed=20, sleep=clock.sleep, now=clock.now)

    assert times_shown(console) == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert clock.time_s == pytest.approx(1000.4)


def test_a_slow_terminal_skips_updates_and_not_time(log: LogFile, clock: FakeClock) -> None:
    console = terminal()

    def oversleep(seconds: float) -> None:
        clock.sleep(seconds + 0.05)

    replay(log, console, speed=20, sleep=oversleep, now=clock.now)

    assert times_shown(console) == [0.0, 3.0, 6.0, 8.0]


def test_each_update_shows_what_was_logged_up_to_its_time(log: LogFile, clock: FakeClock) -> None:
    console = terminal()

    replay(log, console, speed=20, sleep=clock.sleep, now=clock.now)

    pictures = output(console).split("╭─ yard")[1:]
    assert ["blackout begins" in picture for picture in pictures] == [False, True, True, True, True]
    assert ["link lost" in picture for picture in pictures] == [False, False, False, True, True]


def test_a_replay_starts_at_the_given_time_with_the_state_at_that_time(
    log: LogFile, clock: FakeClock
) -> None:
    console = terminal()

    replay(log, console, speed=10, start_s=6, sleep=clock.sleep, now=clock.now)

    assert times_shown(console) == [6.0, 7.0, 8.0]
    assert "AUTONOMOUS" in output(console).split("╭─ yard")[0]


def test_at_maximum_speed_the_end_comes_after_one_update(log: LogFile, clock: FakeClock) -> None:
    console = terminal()

    replay(log, console, speed=math.inf, sleep=clock.sleep, now=clock.now)

    assert times_shown(console) == [0.0, 8.0]


def test_the_last_screen_stays_in_the_terminal(log: LogFile, clock: FakeClock) -> None:
    console = terminal()

    replay(log, console, speed=20, sleep=clock.sleep, now=clock.now)

    _, after = output(console).split("\x1b[?1049l")
    assert "8.0 s / 8.0 s" in after
    assert "hears nothing from the rover" in after
    assert after.count("\n") == 23


def test_an_interrupt_ends_the_replay_quietly_and_restores_the_terminal(
    log: LogFile, clock: FakeClock
) -> None:
    console = terminal()

    def interrupted(_seconds: float) -> None:
        raise KeyboardInterrupt

    replay(log, console, sleep=interrupted, now=clock.now)

    assert output(console).endswith("\x1b[?25h\x1b[?1049l")


def test_without_a_terminal_every_event_is_a_line_and_nothing_is_paced(
    log: LogFile, clock: FakeClock
) -> None:
    console = pipe()

    replay(log, console, sleep=clock.sleep, now=clock.now)

    assert output(console) == (
        "      0.0 s  rover   mode guided: start\n"
        "      0.0 s  rover   failsafe nominal: the link is up\n"
        "      2.0 s  link    uplink: blackout begins\n"
        "      5.0 s  rover   mode autonomous: link lost\n"
        "      8.0 s  ground  hears nothing from the rover\n"
    )
    assert clock.sleeps == 0


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


@pytest.mark.parametrize("speed", [0, -1, math.nan])
def test_a_speed_that_is_not_positive_is_refused(log: LogFile, speed: float) -> None:
    with pytest.raises(ValueError, match="expected a speed above 0"):
        replay(log, pipe(), speed=speed)


@pytest.mark.parametrize("start_s", [-1, 8.1, math.nan])
def test_a_start_outside_the_run_is_refused(log: LogFile, start_s: float) -> None:
    with pytest.raises(ValueError, match=r"expected a start within the run, 0 to 8\.0 s"):
        replay(log, pipe(), start_s=start_s)
