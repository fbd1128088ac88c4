"""The replay's screen under a person's fingers, on a fake clock."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from seats import Seat, seated

from farside.control import Mode, ModeCause
from farside.frames import LinkOutage, OutageReason
from farside.logs import LogFile, Recorder
from farside.logs.terminal.app import SPEEDS, ReplayApp
from farside.node import Direction, to_ns
from farside.topics import ModeEntry, Silence


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A run of 80 s with events at 0, 20, 50 and 80 s, seen from 10 s on at ×1."""
    run.start().note(20, LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT))
    run.stand(30, "at:4,1").stand(40, "at:C")
    run.note(50, ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)).note(80, Silence(silent=True))
    return LogFile(run.log(path))


def replaying(log: LogFile, **options: Any) -> Callable[[Callable[[], float]], ReplayApp]:
    return lambda now: ReplayApp(log, now=now, **{"start_ns": to_ns(10), **options})


def test_simulated_time_keeps_pace_with_the_wall_clock_until_it_is_paused(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        assert (seat.now_s, "▶ playing ×20" in seat.text) == (10, True)
        await seat.wait(1)
        assert (seat.now_s, "  30.0 s" in seat.lines[0]) == (30, True)
        await seat.press("space")
        await seat.wait(1)
        assert (seat.now_s, "‖ paused" in seat.text, "space play" in seat.text) == (30, True, True)
        await seat.press("space")
        await seat.wait(9)
        assert (seat.now_s, "■ end" in seat.text) == (80, True)
        await seat.press("space")
        assert (seat.now_s, "▶ playing" in seat.text) == (0, True)

    seated(replaying(log, speed=20), does)


def test_the_arrows_step_and_seek(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("shift+right", "shift+right")
        assert (seat.now_s, seat.app.player.playing) == (30, True)
        await seat.press("left", "left", "right")
        assert (seat.now_s, seat.app.player.playing) == (29, False)
        await seat.press("shift+left")
        assert seat.now_s == 19
        await seat.press("pagedown")
        assert (seat.now_s, " AUTONOMOUS " in seat.lines[0]) == (79, True)
        await seat.press("home", "left")
        assert (seat.now_s, " GUIDED " in seat.lines[0]) == (0, True)
        await seat.press("end")
        assert seat.now_s == 80

    seated(replaying(log), does)


def test_the_brackets_go_to_the_events_about_now(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("]")
        assert (seat.now_s, "blackout begins" in seat.text) == (20, True)
        await seat.press("]", "]")
        assert (seat.now_s, seat.app.player.playing) == (80, False)
        await seat.press("]")
        assert (seat.now_s, "no event after this" in seat.text) == (80, True)
        await seat.press("[", "[", "[")
        assert (seat.now_s, "blackout" in seat.text) == (0, False)
        await seat.press("[")
        assert "no event before this" in seat.text

    seated(replaying(log), does)


def test_plus_and_minus_set_the_speed_and_r_turns_time_round(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("+", "=")
        await seat.wait(1)
        assert (seat.now_s, "▶ playing ×5" in seat.text) == (15, True)
        await seat.press("-", "r")
        assert "◀ reverse ×2" in seat.text
        await seat.wait(1)
        assert seat.now_s == 13
        seat.app.player.set_speed(SPEEDS[0])
        await seat.press("-")
        assert "×0.1" in seat.text
        seat.app.player.set_speed(math.inf)
        await seat.press("+", "-")
        assert "×1000" in seat.text
        await seat.press("end")
        await seat.wait(0.03)
        assert (seat.now_s, "AUTONOMOUS" in seat.text, "blackout" in seat.text) == (50, True, True)
        await seat.wait(0.03)
        assert (seat.now_s, "AUTONOMOUS" in seat.text) == (20, False)
        assert seat.app._picture.visited == {"at:D": 0}

    seated(replaying(log), does)


def test_l_marks_a_loop_from_either_end_and_ends_it(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("l")
        assert ("loop from 10.0 s" in seat.text, "l loop to here" in seat.text) == (True, True)
        await seat.press("l")
        assert "the loop needs another end" in seat.text
        await seat.press("shift+left", "l")
        assert ("loop 0.0 s to 10.0 s" in seat.text, "l no loop" in seat.text) == (True, True)
        await seat.wait(20)
        await seat.wait(0)
        assert seat.now_s == 0
        await seat.press("l")
        await seat.wait(11)
        assert (seat.now_s, "loop 0" in seat.text) == (11, False)

    seated(replaying(log), does)


def test_g_asks_for_a_time_and_says_what_it_expects(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("g")
        assert "go to which second, 0 to 80?" in seat.text
        await seat.press(*"45.5", "enter")
        assert (seat.now_s, "space pause" in seat.text) == (45.5, True)
        await seat.press("g", *"81", "enter")
        assert (seat.now_s, "expected 0 to 80 s, found '81'" in seat.text) == (45.5, True)
        await seat.press("g", *"q", "enter")
        assert "expected 0 to 80 s, found 'q'" in seat.text
        await seat.press("g", "escape", "space")
        assert (seat.now_s, seat.app.player.playing) == (45.5, False)

    seated(replaying(log), does)


def test_q_leaves(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        await seat.press("q")
        assert not seat.app.is_running

    seated(replaying(log), does)


@pytest.mark.parametrize(("width", "height"), [(60, 24), (80, 24), (120, 40)])
def test_at_usual_sizes_all_keys_are_shown_and_nothing_is_cut(
    log: LogFile, width: int, height: int
) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        for words in ("space pause", "←→ 1 s", "⇧←→ 10 s", "[ ] event", "+ - speed", "r reverse",
                      "l loop from here", "g go to", "q leave"):  # fmt: skip
            assert words in seat.text
        panels = {line.split()[1] for line in seat.lines if line.startswith("╭")}
        assert {"yard", "commands,", "events"} <= panels
        assert [line[-1] for line in seat.lines if line[0] == "│"].count("│") >= 9

    seated(replaying(log), does, (width, height))


def test_a_terminal_that_is_too_small_tells_the_time_and_is_no_trap(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        assert ("10.0 s guided" in seat.text, "40 columns by 11 rows" in seat.text) == (True, True)
        for size in ((1, 1), (39, 50), (200, 3), (40, 11), (12, 8)):
            await seat.resize(*size)
            await seat.press("right", "g", "escape")
        await seat.resize(80, 24)
        await seat.wait(0)
        assert (seat.now_s, "╭─ yard" in seat.text) == (15, True)

    seated(replaying(log), does, (30, 8))


def test_a_log_that_is_still_written_is_followed(run: Any, path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.write(run.start().records)
        recorder.flush()
        log = LogFile(path)

        def look() -> str:
            log.refresh()
            return "whole" if log.complete else "still being written"

        async def does(seat: Seat[ReplayApp]) -> None:
            await seat.wait(100)
            assert (seat.now_s, "■ so far" in seat.text) == (0, True)
            assert "still being written" in seat.text
            recorder.write(run.stand(30, "at:A").records[-1:])
            recorder.flush()
            await seat.wait(2)
            assert (seat.now_s, "at:A" in seat.text) == (20, False)
            await seat.wait(2)
            assert (seat.now_s, "at       at:A" in seat.text) == (30, True)
            recorder.close()
            await seat.wait(1)
            assert ("■ end" in seat.text, "whole" in seat.text) == (True, True)

        seated(replaying(log, speed=10, refresh=look), does)


def test_as_the_ground_knew_it_nothing_else_is_shown(run: Any, path: Path) -> None:
    run.start("at:C").stand(50, "at:A").hear(5, "at:C", since_s=4)
    log = LogFile(run.log(path)).as_ground()

    async def does(seat: Seat[ReplayApp]) -> None:
        assert "as the ground knew it" in seat.lines[0]
        assert "╭─ events" in seat.text
        await seat.press("end")
        assert (seat.now_s, "heard at at:C" in seat.text, "at:A" in seat.text) == (50, True, False)

    seated(replaying(log), does)


def test_a_log_that_is_gone_ends_it_with_the_reason(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        log.path.unlink()
        await seat.press("end")
        assert str(log.path) in str(seat.app.failure)
        assert not seat.app.is_running

    seated(replaying(log), does)


def test_without_colours_nothing_is_coloured(log: LogFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")

    async def does(seat: Seat[ReplayApp]) -> None:
        assert seat.colours == {"default"}

    seated(replaying(log), does)


def test_the_colours_are_those_of_the_terminal(log: LogFile) -> None:
    async def does(seat: Seat[ReplayApp]) -> None:
        assert len(seat.colours) > 5
        dim = {"bright_black", "color(8)"}
        assert seat.colours - dim <= {"default", "blue", "green", "yellow", "magenta", "cyan"}

    seated(replaying(log), does)


def test_no_color_is_kept_for_what_comes_after(
    log: LogFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    app = ReplayApp(log)
    monkeypatch.setattr(app, "run", lambda **_: None)

    app.show()

    assert app.no_color
    assert Console(force_terminal=True).no_color
