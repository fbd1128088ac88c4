"""The command line as users at a terminal see it."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from farside.logs import LogFile
from farside.logs.result import RunResult
from farside.missions import FinishedRun, load_mission
from farside.missions.commands.display import summary
from farside.missions.commands.display.progress import ProgressDisplay
from farside.missions.commands.display.summary import show_summary
from farside.missions.format import mission_schema
from farside.missions.loading import shipped_missions
from farside.node import Role

SHORT = ("--in-process", "--set", "duration_s=2", "--set", "expect=[]")
YARD = 'world.map="#####\\n#A.B#\\n#####"'


def test_run_prints_a_summary_and_leaves_a_log(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    status, out, err = farside("run", "blackout", *SHORT)
    assert status == 0
    assert "blackout: success" in out
    assert "logs/runs/blackout-seed1-1.mcap" in out
    assert err == ""
    log = LogFile(tmp_path / "logs/runs/blackout-seed1-1.mcap")
    assert log.complete


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_comes_with_the_summary_does_not_cut_it(
    farside: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
    number: signal.Signals,
) -> None:
    def interrupted(result: RunResult, console: Console) -> None:
        os.kill(os.getpid(), number)
        show_summary(result, console)

    monkeypatch.setattr(summary, "show_summary", interrupted)

    status, out, _ = farside("run", "blackout", *SHORT)

    assert (status, "digest" in out) == (0, True)


def test_run_json_prints_one_object(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("run", "blackout", "--in-process", "--json", "--seed", "3")
    result = json.loads(out)
    assert status == 0
    assert (result["mission"], result["seed"]) == ("blackout", 3)
    assert result["outcome"] == "success"
    assert [mode["mode"] for mode in result["modes"]] == [
        "guided",
        "shared",
        "autonomous",
        "guided",
    ]
    assert {"uplink", "downlink"} == set(result["link"])
    assert result["dem"]["hypotheses"] > 50
    assert result["sim_seconds"] == 1200
    assert result["speedup"] == pytest.approx(result["sim_seconds"] / result["wall_seconds"])


def test_an_unmet_expectation_is_status_1(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside(
        "run", "blackout", "--in-process", "--set", "link.blackouts=[]", "--set", "duration_s=60"
    )
    assert status == 1
    assert "blackout: failure" in out
    assert "never reached as a goal" in out


def test_logs_are_never_overwritten(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    for _ in range(2):
        farside("run", "blackout", "--in-process", "--set", "duration_s=5", "--out", "here")
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == [
        "blackout-seed1-1.mcap",
        "blackout-seed1-2.mcap",
    ]


def test_the_log_holds_the_mission_and_the_result(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    _, out, _ = farside("run", "blackout", "--in-process", "--json", "--set", "duration_s=5")
    result = json.loads(out)
    log = LogFile(tmp_path / result["log"])
    assert b"# Stage 2, shared" in log.attachments["mission.toml"].data
    assert json.loads(log.attachments["mission.json"].data)["duration_s"] == 5
    assert json.loads(log.attachments["result.json"].data) == result
    assert log.metadata["farside.run"]["seed"] == "1"
    assert log.metadata["farside.result"]["digest"] == result["digest"]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["run", "nowhere.toml"], ["nowhere.toml"]),
        (["run", "blackot"], ["blackot", "blackout"]),
        (["run", "blackout", "--set", "link.up.los=0.5"], ["link.up.los", "loss"]),
        (["run", "blackout", "--set", "link.up.loss=2"], ["link.up.loss", "2"]),
        (["run", "blackout", "--set", "seed=many"], ["seed", "many"]),
        (["run", "blackout", "--set", 'rover.start="Z"'], ["rover.start", "Z"]),
        (
            ["run", "blackout", "--set", "link.blackouts=[{start_s=9, end_s=3}]"],
            ["link.blackouts", "9", "3"],
        ),
        (["check", "blackout", "--set", "duration_s=-1"], ["duration_s", "-1"]),
        (["replay", "nowhere.mcap"], ["nowhere.mcap"]),
    ],
)
def test_bad_input_is_status_2_with_one_message_and_no_files(
    farside: Callable[..., tuple[int, str, str]],
    tmp_path: Path,
    arguments: Sequence[str],
    named: Sequence[str],
) -> None:
    status, out, err = farside(*arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("farside: ")
    assert "Traceback" not in err
    for word in named:
        assert word in err
    assert list(tmp_path.iterdir()) == []


def test_a_log_folder_that_is_a_file_is_bad_input(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "here").write_text("a letter")
    status, out, err = farside("run", "blackout", "--in-process", "--out", "here")
    assert (status, out) == (2, "")
    assert err == "farside: here: expected a folder for logs, found: File exists\n"


@pytest.mark.parametrize("pace", ["0", "-1", "soon", "nan", "inf"])
def test_an_invalid_pace_is_refused(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path, pace: str
) -> None:
    status, _, err = farside("run", "blackout", f"--pace={pace}")
    assert status == 2
    assert "above 0" in err
    assert list(tmp_path.iterdir()) == []


def test_no_name_on_the_command_line_can_steer_the_terminal(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    for arguments in (["check", "\x1b[2J.toml"], ["replay", "\x1b[2J.mcap"]):
        status, _, err = farside(*arguments)
        assert status == 2
        assert "\\x1b[2J." in err
        assert "\x1b" not in err


def test_a_log_whose_name_would_steer_the_terminal_is_recovered_all_the_same(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    farside("run", "blackout", "--in-process", "--set=duration_s=5", "--out", "here")
    (tmp_path / "here/blackout-seed1-1.mcap").rename(tmp_path / "a\x1b[2J.mcap")

    status, out, err = farside("recover", "a\x1b[2J.mcap")
    assert status == 0
    assert "\x1b" not in out + err
    assert "\\x1b[2J" in out


def test_a_folder_for_logs_is_not_taken_for_markup(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, out, _ = farside(
        "run", "blackout", "--in-process", "--set=duration_s=5", "--set=expect=[]", "--out", "[/b]"
    )
    assert status == 0
    assert "log     [/b]/blackout-seed1-1.mcap" in out


def test_check_sums_up_a_valid_mission(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("check", "blackout")
    assert status == 0
    assert out == "blackout: good. blackout: 1200 s, 74 places, 6 expectations\n"


STRANDED = (
    "--set=rover.battery.capacity_j=2000",
    "--set=duration_s=140",
    '--set=expect=[{what="charge", at_least=0.2}]',
)


def test_a_rover_that_runs_flat_is_in_the_summary_the_story_and_the_verdict(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, out, _ = farside("run", "blackout", "--in-process", *STRANDED)
    assert status == 1
    assert "rover: least charge 0% at" in out
    assert "battery flat since" in out
    assert "charge at least 0.2, battery never flat" in out
    assert "operator: at step 1 of 7, waiting since" in out

    _, lines, _ = farside("replay", "logs/runs/blackout-seed1-1.mcap")
    assert "rover   battery flat: the rover cannot move" in lines
    assert ": battery flat: the rover cannot move" in lines.partition("ground  learns of")[2]


def test_the_result_says_since_when_and_what_the_operator_waited_for(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    _, out, _ = farside("run", "blackout", "--in-process", "--json", *STRANDED)
    result = json.loads(out)
    assert result["rover"]["least_charge"] == 0
    assert result["rover"]["flat_since_s"] == result["rover"]["least_charge_s"]
    assert result["rover"]["stuck_since_s"] is None
    assert (result["operator"]["step"], result["operator"]["of"]) == (1, 7)
    assert result["operator"]["waiting_for"].startswith("the rover to be at ")


def test_check_warns_of_a_script_that_can_never_go_on(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, out, err = farside(
        "check", "blackout", "--set", "link.blackouts=[]", "--set", 'ground.script.1.mode="guided"'
    )
    assert status == 0
    assert "good" in out
    assert "farside: warning: blackout: ground.script.2.do: waits for goal A to be reached" in err


def test_replay_into_a_pipe_prints_one_line_per_event(
    farside: Callable[..., tuple[int, str, str]], blackout: FinishedRun
) -> None:
    status, lines, _ = farside("replay", str(blackout.log), "--start", "620")
    assert status == 0
    assert "rover   mode autonomous: link lost" in lines


def test_a_start_after_the_end_is_bad_input(farside: Callable[..., tuple[int, str, str]]) -> None:
    _, out, _ = farside("run", "blackout", "--in-process", "--json", "--set", "duration_s=5")
    status, _, err = farside("replay", json.loads(out)["log"], "--start", "99")
    assert status == 2
    assert "99" in err
    assert "Traceback" not in err


def test_help_shows_examples(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("run", "--help")
    assert status == 0
    assert "farside run blackout" in out
    assert "Exit status" in out


def test_a_wait_is_told_without_a_terminal_too() -> None:
    text = StringIO()
    display = ProgressDisplay(load_mission("blackout").mission, Console(file=text))
    with display:
        display.wait([Role.ROVER, Role.GROUND], 20.04)
    assert text.getvalue() == "waiting for rover, ground, 20 s\n"


def test_missions_lists_what_ships_with_its_length_and_purpose(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, out, _ = farside("missions")
    assert status == 0
    about = "The operator drives, then consents, then is cut off; the rover goes on alone."
    lines = out.splitlines()
    assert lines[0] == f"blackout     1200 s  {about}"
    assert [line.split()[0] for line in lines] == [
        "blackout",
        "mars-relay",
        "shadow",
        "teach",
        "tether",
    ]
    assert len({line.index(" s  ") for line in lines}) == 1, "lengths stand in a column"


def test_schema_prints_the_schema(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("schema")
    assert status == 0
    assert json.loads(out) == mission_schema()


def test_a_mission_without_ground_runs_with_nobody_to_command(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "alone.toml").write_text(
        'name="alone"\nduration_s=5\nworld.map="#####\\n#A.B#\\n#####"\n'
        'rover.start="A"\nlink.preset="moon"\n'
    )
    assert farside("run", "alone.toml", "--in-process")[0] == 0


@pytest.mark.parametrize("command", ["run", "check"])
def test_a_byte_order_mark_is_skipped(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path, command: str
) -> None:
    mission = shipped_missions()["blackout"].read_bytes()
    (tmp_path / "bom.toml").write_bytes(b"\xef\xbb\xbf" + mission)
    assert farside(command, "bom.toml", *(SHORT if command == "run" else ()))[0] == 0


def test_the_digest_can_be_copied_whole_from_80_columns(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    digest = json.loads(farside("run", "blackout", "--json", *SHORT)[1])["digest"]
    for forced in ({}, {"FORCE_COLOR": "1"}):
        for name, value in forced.items():
            monkeypatch.setenv(name, value)
        assert f"digest  {digest}" in farside("run", "blackout", *SHORT)[1].splitlines()


def test_no_color_is_honoured(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    short = ("run", "blackout", *SHORT)
    coloured = re.compile(r"\x1b\[[0-9;]*3[0-7]m")
    assert coloured.search(farside(*short)[1])
    monkeypatch.setenv("NO_COLOR", "1")
    assert not coloured.search(farside(*short)[1])


HEAVY = ("numpy", "scipy", "pymunk", "zenoh", "cryptography", "mcap", "rich", "astropy")


@pytest.mark.processes
@pytest.mark.parametrize("arguments", ["check blackout", "--help", "missions", "schema", "run -h"])
def test_what_only_reads_a_mission_imports_nothing_heavy(arguments: str) -> None:
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-X", "importtime", "-m", "farside", *arguments.split()],
        capture_output=True,
        text=True,
        check=True,
    )
    packages = {line.rpartition("|")[2].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert "typer" in packages
    assert not packages & set(HEAVY)
