"""The command line as users at a terminal see it."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from farside.logs import LogFile
from farside.missions import load_mission
from farside.missions.commands import main as cli
from farside.missions.commands.display.progress import ProgressDisplay
from farside.missions.format import mission_schema
from farside.missions.loading import shipped_missions
from farside.node import Role

YARD = 'world.map="#####\\n#A.B#\\n#####"'


@pytest.fixture
def farside(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Iterator[Callable[..., tuple[int, str, str]]]:
    """Run `farside ...` in an empty folder: exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    handler = signal.getsignal(signal.SIGTERM)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["farside", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, *capsys.readouterr()

    yield run
    signal.signal(signal.SIGTERM, handler)


def test_run_prints_a_summary_and_leaves_a_log(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    status, out, err = farside("run", "blackout", "--in-process")
    assert status == 0
    assert "blackout: success" in out
    assert "logs/runs/blackout-seed1-1.mcap" in out
    assert err == ""
    log = LogFile(tmp_path / "logs/runs/blackout-seed1-1.mcap")
    assert log.complete


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


def test_check_sums_up_a_valid_mission(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("check", "blackout")
    assert status == 0
    assert out == "blackout: good. blackout: 1200 s, 74 places, 6 expectations\n"


def test_replay_into_a_pipe_prints_one_line_per_event(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    _, out, _ = farside("run", "blackout", "--in-process", "--json")
    status, lines, _ = farside("replay", json.loads(out)["log"], "--start", "620")
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
    assert out == f"blackout  1200 s  {about}\n"


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
    more = ("--in-process", "--set", "duration_s=2", "--set", "expect=[]")
    assert farside(command, "bom.toml", *(more if command == "run" else ()))[0] == 0


COMMANDS = [
    (),
    ("run",),
    ("check",),
    ("replay",),
    ("recover",),
    ("missions",),
    ("schema",),
    ("link",),
    ("link", "check"),
    ("link", "light-time"),
    ("dem",),
    ("dem", "learn"),
    ("dem", "figure1"),
]


def test_these_are_all_commands(farside: Callable[..., tuple[int, str, str]]) -> None:
    for group in ((), ("link",), ("dem",)):
        _, out, _ = farside(*group, "--help")
        listed = re.findall(
            r"^  ([a-z][a-z0-9-]+)  ", out.partition("\nCommands:")[2], re.MULTILINE
        )
        assert {(*group, name) for name in listed} == {
            command for command in COMMANDS if command[:-1] == group and command
        }


@pytest.mark.parametrize("group", ["link", "dem"])
def test_a_group_is_listed_in_its_own_words(
    farside: Callable[..., tuple[int, str, str]], group: str
) -> None:
    listed = re.search(rf"^  {group} +(.+)$", farside("--help")[1], re.MULTILINE)
    assert farside(group, "--help")[1].splitlines()[2] == f"  {listed.group(1)}"


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_help_has_examples_flags_and_whole_lines(
    farside: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
    command: tuple[str, ...],
) -> None:
    """At 80 columns, by `-h` as by `--help`: no line is longer, cut or about a type."""
    monkeypatch.setenv("COLUMNS", "80")
    status, out, _ = farside(*command, "-h")
    assert status == 0
    assert (status, out) == farside(*command, "--help")[:2]
    assert re.search(rf"\n\n  {' '.join(('farside', *command))}\b", out)
    assert max(map(len, out.splitlines())) <= 80
    usage, _, words = out.partition("\n")
    assert usage.startswith("Usage: farside")
    assert not re.search(r"\.\.\.$|<bool>|<int|<float", words, re.MULTILINE)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [("chek", "check"), ("lnk", "link"), ("schem", "schema")],
)
def test_an_unknown_command_is_answered_with_the_near_one(
    farside: Callable[..., tuple[int, str, str]], typed: str, meant: str
) -> None:
    status, out, err = farside(typed)
    assert (status, out) == (2, "")
    assert f"No such command '{typed}'. Did you mean '{meant}'" in err


def test_an_unknown_option_is_answered_with_the_near_one(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, _, err = farside("run", "blackout", "--in-proces")
    assert status == 2
    assert "--in-process" in err


def test_completion_can_be_installed(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "--install-completion" in farside("--help")[1]
    monkeypatch.setenv("_FARSIDE_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "farside re")
    monkeypatch.setenv("COMP_CWORD", "1")
    assert set(farside()[1].split()) == {"recover", "replay"}


def test_the_digest_can_be_copied_whole_from_80_columns(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    short = ("--in-process", "--set", "duration_s=2", "--set", "expect=[]")
    digest = json.loads(farside("run", "blackout", "--json", *short)[1])["digest"]
    for forced in ({}, {"FORCE_COLOR": "1"}):
        for name, value in forced.items():
            monkeypatch.setenv(name, value)
        assert f"digest  {digest}" in farside("run", "blackout", *short)[1].splitlines()


def test_no_color_is_honoured(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    short = ("run", "blackout", "--in-process", "--set", "duration_s=2", "--set", "expect=[]")
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
