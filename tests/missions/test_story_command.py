"""`farside story` and `farside why` on the command line."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from farside.missions import Rehearsal

Farside = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The first half minute of `blackout`, in which the operator drives."""
    folder = tmp_path_factory.mktemp("runs")
    return str(Path(Rehearsal("blackout", folder, {"duration_s": 30.0}).run().result.log))


def test_the_story_of_a_command_into_a_pipe(farside: Farside, log: str) -> None:
    status, out, err = farside("story", log, "command:1")
    assert (status, err) == (0, "")
    title, first, *_ = out.splitlines()
    assert title.startswith("command 1: drive N - done at 6.2 s")
    assert re.split(r"  +", first.strip()) == ["1.32 s", "ground", "the operator orders: drive N"]
    assert "\x1b" not in out


def test_the_story_as_the_ground_had_it_for_programs(farside: Farside, log: str) -> None:
    status, out, _ = farside("story", log, "command:1", "--as", "ground", "--json")
    told = json.loads(out)
    assert (status, told["subject"]) == (0, "command:1")
    assert {line["side"] for line in told["lines"]} == {"ground"}


def test_a_thing_that_does_not_exist_is_refused_with_those_that_do(
    farside: Farside, log: str
) -> None:
    status, out, err = farside("story", log, "command:999")
    assert (status, out) == (2, "")
    assert "there is no command 999: the ground gave commands 1 to" in err


def test_without_a_log_the_newest_is_taken(farside: Farside, log: str) -> None:
    runs = Path("logs/runs")
    runs.mkdir(parents=True)
    (runs / "run.mcap").write_bytes(Path(log).read_bytes())
    for arguments in (("story", "command:1"), ("why", "mode"), ("why",)):
        status, out, err = farside(*arguments)
        assert (status, out != "") == (0, True)
        assert "reading the newest" in err


def test_why_the_rover_acts(farside: Farside, log: str) -> None:
    status, out, err = farside("why", log, "--at", "4")
    assert (status, err) == (0, "")
    assert "  N begins, guided, by command 1, at 3.1 s" in out.splitlines()
    assert "re-lived" not in out, "the recorded decision is enough"


def test_why_the_rover_does_nothing_is_asked_of_the_model_of_that_moment(
    farside: Farside, log: str
) -> None:
    """No record tells what the model held then: the run is lived again up to the moment."""
    status, out, _ = farside("why", log, "action", "--at", "8")
    lines = out.splitlines()
    assert status == 0
    place = lines.index("the model on board at that moment, re-lived")
    assert lines[place + 1] == "  no goal on the Goal List"
    assert lines[place + 2] == "  3 Signs, 2 hypotheses, mean C_m 0.50"


def test_as_the_ground_nothing_is_lived_again(farside: Farside, log: str) -> None:
    status, out, _ = farside("why", log, "--at", "8", "--as", "ground", "--json")
    headings = [section["heading"] for section in json.loads(out)["sections"]]
    assert (status, headings) == (0, ["what the ground thought then"])


def test_as_the_ground_no_time_tells_when_the_run_ends(farside: Farside, log: str) -> None:
    """Any time is answered alike: it does not know that nothing comes after it."""
    status, out, err = farside("why", log, "--at", "31", "--as", "ground")
    assert (status, err) == (0, "")
    assert out.splitlines()[0] == "at 31.0 s"
    status, _, err = farside("why", log, "--at", "inf", "--as", "ground")
    assert (status, "expected a time, found inf s" in err) == (2, True)


def test_what_is_missing_from_a_damaged_log_is_said(
    farside: Farside, log: str, tmp_path: Path
) -> None:
    """Of a thing that is not found, too: it may be in what is missing."""
    whole = Path(log).read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) // 2])
    for arguments in (("story", str(cut), "command:999"), ("why", str(cut), "mode")):
        assert f"{cut}: " in farside(*arguments)[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["modee"], "expected action, mode, failsafe, silence, found"),
        (["--at", "31"], "expected a time within the run"),
        (["--at", "nan"], "--at"),
        (["--as", "rover"], "--as"),
    ],
)
def test_what_why_refuses(farside: Farside, log: str, arguments: list[str], message: str) -> None:
    status, out, err = farside("why", log, *arguments)
    assert (status, out) == (2, "")
    assert message in err
