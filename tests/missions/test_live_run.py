"""A run watched live in Foxglove: its play bar paces the run, and changes nothing of it."""

import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from foxglove_app import FoxgloveApp

from farside.logs import LogFile, Recorder
from farside.logs.live.server import offered
from farside.missions import load_mission, run_mission
from farside.missions.commands.live.address import Address
from farside.missions.commands.live.serving import LiveRun, serve_log
from farside.missions.conductor import WallClock
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun, _Unwatched
from farside.node import to_ns

DURATION_S = 40
SHORT = [f"duration_s={DURATION_S}", "expect=[]"]


class _Script:
    """Wall time that passes as told, while a viewer acts between two ticks."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.acts: Iterator[None] = iter(())

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        assert self.now_s < 60, "the run is held for good"
        next(self.acts, None)

    @property
    def clock(self) -> WallClock:
        return WallClock(lambda: self.now_s, self.sleep)


def _run(out: Path) -> FinishedRun:
    return run_mission(load_mission("blackout", SHORT), in_process=True, out=out)


def test_whatever_a_viewer_does_with_the_play_bar_the_log_is_the_same(tmp_path: Path) -> None:
    script, interrupts = _Script(), Interrupts()
    told: list[tuple[str, int]] = []

    with (
        LiveRun(
            _Unwatched(),
            interrupts,
            Address(port=0),
            name="blackout",
            end_ns=to_ns(DURATION_S),
            speed=10.0,
            clock=script.clock,
        ) as live,
        FoxgloveApp(live.server.port) as app,
    ):

        def acts() -> Iterator[None]:
            app.until(lambda: "/truth/pose" in app.channels)
            app.subscribe("/truth/pose")
            for _ in range(20):
                yield
            for play, speed, seek_s, ticks in (
                (False, 1.0, None, 5),  # hold
                (True, 30.0, 1, 5),  # look back
                (False, 1.0, 30, 5),  # hurry ahead, and hold there
                (True, 30.0, None, 0),  # and on to the end
            ):
                seek_ns = None if seek_s is None else to_ns(seek_s)
                state = app.ask(play=play, speed=speed, seek_ns=seek_ns)
                told.append((state.status, round(state.time_ns / 1e9)))
                for _ in range(ticks):
                    yield

        script.acts = acts()
        finished = run_mission(
            load_mission("blackout", SHORT),
            in_process=True,
            out=tmp_path,
            watcher=live,
            interrupts=interrupts,
        )

        def afterwards() -> Iterator[None]:
            seen = len(app.messages)
            app.ask(play=True, speed=30.0, seek_ns=to_ns(5))
            for _ in range(9):
                yield
            app.until(lambda: any(pose.time_ns > to_ns(6) for pose in app.messages[seen:]))
            interrupts._hear(signal.SIGINT, None)

        script.acts = afterwards()
        live.serve()

    assert told == [("paused", 6), ("playing", 1), ("buffering", 30), ("playing", 30)]
    assert finished.digest == _run(tmp_path).digest


def test_replay_live_serves_what_the_ground_knew_until_ctrl_c(tmp_path: Path) -> None:
    log = _run(tmp_path).log
    command = [sys.executable, "-m", "farside", "replay", str(log), "--live", "--as", "ground"]
    with subprocess.Popen(  # noqa: S603
        [*command, "--port", "0", "--start", "20"], stderr=subprocess.PIPE, text=True
    ) as replay:
        try:
            where = re.match(r"Live at ws://127.0.0.1:(\d+),", replay.stderr.readline())
            with FoxgloveApp(int(where[1])) as app:
                app.until(lambda: len(app.channels) == len(offered(as_ground=True)))
                app.subscribe("/ground/telemetry", "/ground/map")
                app.until(lambda: any(message.time_ns > to_ns(25) for message in app.messages))
            assert {message.topic for message in app.messages} == {
                "/ground/telemetry",
                "/ground/map",
            }
            replay.send_signal(signal.SIGINT)
            assert replay.wait(60) == 0
        finally:
            replay.kill()


@pytest.mark.parametrize("start", ["nan", "inf", "1e6"])
@pytest.mark.parametrize("to", [[], ["--live"], ["--zenoh", "tcp/127.0.0.1:1"]])
def test_a_start_outside_of_the_run_is_refused(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path, start: str, to: list[str]
) -> None:
    with Recorder(tmp_path / "run.mcap"):
        pass
    status, _, errors = farside("replay", "run.mcap", "--start", start, *to)
    assert status == 2
    assert "--start" in errors


def test_a_log_of_any_name_can_be_served(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a\udcff.mcap") as recorder:
        pass

    class Ended(BaseException):
        """The clock stands still."""

    def sleep(_seconds: float) -> None:
        raise Ended

    with pytest.raises(Ended):
        serve_log(LogFile(recorder.path), Address(port=0), speed=1.0, clock=WallClock(sleep=sleep))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--port", "1"], "expected it with --live"),
        (["--listen", "localhost"], "expected it with --live"),
        (["--live", "--pace", "max"], "expected a number with --live"),
        (["--live", "--listen", "a\udcff"], "cannot listen on a"),
        (["--live", "--listen", "no.such.host.invalid"], "cannot listen on no.such.host.invalid"),
    ],
)
def test_an_address_or_a_pace_that_cannot_be_served_is_refused(
    farside: Callable[..., tuple[int, str, str]], arguments: list[str], message: str
) -> None:
    status, _, errors = farside("run", "blackout", "--in-process", *arguments)
    assert status in {2, 3}
    assert message in errors
