"""The command line, as a person at a terminal meets it."""

import json
import signal
import sys

import pytest

from farside.logs import LogFile
from farside.missions.commands import main as cli

YARD = 'world.map="#####\\n#A.B#\\n#####"'


@pytest.fixture
def farside(monkeypatch, capsys, tmp_path):
    """Runs `farside ...` in an empty folder: exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    handler = signal.getsignal(signal.SIGTERM)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["farside", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, *capsys.readouterr()

    yield run
    signal.signal(signal.SIGTERM, handler)


def test_run_prints_a_summary_and_leaves_a_log(farside, tmp_path):
    status, out, err = farside("run", "blackout", "--in-process")
    assert status == 0
    assert "blackout: success" in out
    assert "logs/runs/blackout-seed1-1.mcap" in out
    assert err == ""
    log = LogFile(tmp_path / "logs/runs/blackout-seed1-1.mcap")
    assert log.complete


def test_run_json_prints_one_object(farside):
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


def test_an_unmet_expectation_is_status_1(farside):
    status, out, _ = farside(
        "run", "blackout", "--in-process", "--set", "link.blackouts=[]", "--set", "duration_s=60"
    )
    assert status == 1
    assert "blackout: failure" in out
    assert "never reached as a goal" in out


def test_logs_are_never_overwritten(farside, tmp_path):
    for _ in range(2):
        farside("run", "blackout", "--in-process", "--set", "duration_s=5", "--out", "here")
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == [
        "blackout-seed1-1.mcap",
        "blackout-seed1-2.mcap",
    ]


def test_the_mission_and_the_result_travel_in_the_log(farside, tmp_path):
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
def test_bad_input_is_status_2_one_message_and_nothing_written(farside, tmp_path, arguments, named):
    status, out, err = farside(*arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("farside: ")
    assert "Traceback" not in err
    for word in named:
        assert word in err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_for_logs_that_is_a_file_is_bad_input(farside, tmp_path):
    (tmp_path / "here").write_text("a letter")
    status, out, err = farside("run", "blackout", "--in-process", "--out", "here")
    assert (status, out) == (2, "")
    assert err == "farside: here: expected a folder for logs, found: File exists\n"


@pytest.mark.parametrize("pace", ["0", "-1", "soon", "nan", "inf"])
def test_a_pace_that_is_none_is_refused(farside, tmp_path, pace):
    status, _, err = farside("run", "blackout", f"--pace={pace}")
    assert status == 2
    assert "above 0" in err
    assert list(tmp_path.iterdir()) == []


def test_no_name_on_the_command_line_can_steer_the_terminal(farside):
    for arguments in (["check", "\x1b[2J.toml"], ["replay", "\x1b[2J.mcap"]):
        status, _, err = farside(*arguments)
        assert status == 2
        assert "\\x1b[2J." in err
        assert "\x1b" not in err


def test_a_folder_for_logs_is_not_taken_for_markup(farside):
    status, out, _ = farside(
        "run", "blackout", "--in-process", "--set=duration_s=5", "--set=expect=[]", "--out", "[/b]"
    )
    assert status == 0
    assert "log     [/b]/blackout-seed1-1.mcap" in out


def test_check_says_what_is_good(farside):
    status, out, _ = farside("check", "blackout")
    assert status == 0
    assert out == "blackout: good. blackout: 1200 s, 74 places, 6 expectations\n"


STRANDED = (
    "--set=rover.battery.capacity_j=2000",
    "--set=duration_s=600",
    '--set=expect=[{what="charge", at_least=0.2}]',
)


def test_a_rover_that_runs_flat_is_in_the_summary_the_story_and_the_verdict(farside):
    status, out, _ = farside("run", "blackout", "--in-process", *STRANDED)
    assert status == 1
    assert "rover: least charge 0% at" in out
    assert "battery flat since" in out
    assert "charge at least 0.2, battery never flat" in out
    assert "operator: at step 1 of 7, waiting since" in out

    _, lines, _ = farside("replay", "logs/runs/blackout-seed1-1.mcap")
    assert "rover   battery flat: the rover cannot move" in lines
    assert ": battery flat: the rover cannot move" in lines.partition("ground  learns of")[2]


def test_the_result_says_since_when_and_what_the_operator_waited_for(farside):
    _, out, _ = farside("run", "blackout", "--in-process", "--json", *STRANDED)
    result = json.loads(out)
    assert result["rover"]["least_charge"] == 0
    assert result["rover"]["flat_since_s"] == result["rover"]["least_charge_s"]
    assert result["rover"]["stuck_since_s"] is None
    assert (result["operator"]["step"], result["operator"]["of"]) == (1, 7)
    assert result["operator"]["waiting_for"].startswith("the rover to be at ")


def test_check_warns_of_a_script_that_can_never_go_on(farside):
    status, out, err = farside(
        "check", "blackout", "--set", "link.blackouts=[]", "--set", 'ground.script.1.mode="guided"'
    )
    assert status == 0
    assert "good" in out
    assert "farside: warning: blackout: ground.script.2.do: waits for goal A to be reached" in err


def test_replay_into_a_pipe_prints_a_line_an_event(farside):
    _, out, _ = farside("run", "blackout", "--in-process", "--json")
    status, lines, _ = farside("replay", json.loads(out)["log"], "--start", "620")
    assert status == 0
    assert "rover   mode autonomous: link lost" in lines


def test_a_start_beyond_the_end_is_bad_input(farside):
    _, out, _ = farside("run", "blackout", "--in-process", "--json", "--set", "duration_s=5")
    status, _, err = farside("replay", json.loads(out)["log"], "--start", "99")
    assert status == 2
    assert "99" in err
    assert "Traceback" not in err


def test_help_teaches_by_example(farside):
    status, out, _ = farside("run", "--help")
    assert status == 0
    assert "farside run blackout" in out
    assert "Exit status" in out
