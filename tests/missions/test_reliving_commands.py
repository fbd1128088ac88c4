"""`farside verify`, `farside rerun` and `farside diff`, as they are typed."""

import json
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from short_life import SHORT, damaged, forged

from farside.logs import LogFile
from farside.missions import FinishedRun, load_mission, run_mission
from farside.topics import ROVER_ESTIMATE, Estimate

Farside = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """Up to a blackout and into it."""
    loaded = load_mission("blackout", {**SHORT, "duration_s": 55.0, "expect": []})
    return run_mission(loaded, in_process=True, out=tmp_path_factory.mktemp("flown"))


def test_a_run_comes_out_again(farside: Farside, flown: FinishedRun) -> None:
    status, out, err = farside("verify", str(flown.log))

    assert (status, err) == (0, "")
    messages = sum(1 for _ in LogFile(flown.log).records(pictures=True))
    assert out == (
        f"{flown.log}: equal\n{messages} messages came out again, 55 s\ndigest  {flown.digest}\n"
    )


def test_a_forged_log_does_not(farside: Farside, flown: FinishedRun, tmp_path: Path) -> None:
    records = list(LogFile(flown.log).records())
    number = next(
        n
        for n, record in enumerate(records)
        if record.topic == ROVER_ESTIMATE.name and record.log_time_ns > 5e9
    )
    forgery = msgspec.json.encode(Estimate(0.0, 0.0, 0.0))
    records[number] = msgspec.structs.replace(records[number], payload=forgery)
    log = forged(flown.log, tmp_path / "forged\x1b.mcap", records)
    before = list(LogFile(log).records(pictures=True)).index(records[number])

    status, out, _ = farside("verify", str(log))
    told = json.loads(farside("verify", str(log), "--json")[1])

    assert status == 1
    assert "\x1b" not in out
    first, second, third, *_ = out.splitlines()
    assert (first, second) == (
        f"{tmp_path}/forged\\x1b.mcap: differs",
        f"{before} messages came out again",
    )
    t_s = records[number].log_time_ns / 1e9
    assert third == f"the first that differs, at {t_s:g} s in /rover/estimate:"
    assert "  x_m: 0.0 | " in out
    assert (told["equal"], told["records"], told["parting"]["topic"]) == (
        False,
        before,
        "/rover/estimate",
    )


def test_what_is_damaged_of_a_log_is_told(
    farside: Farside, flown: FinishedRun, tmp_path: Path
) -> None:
    log = damaged(flown.log, tmp_path / "damaged.mcap")

    status, out, err = farside("verify", str(log))

    assert (status, out.splitlines()[0]) == (1, f"{log}: differs")
    assert err.count("messages from") == 1


def test_what_is_no_log_cannot_be_verified(farside: Farside, tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_text("no")
    status, out, err = farside("verify", "no.mcap")
    assert (status, out) == (2, "")
    assert err.startswith("farside: no.mcap")


def test_another_course_and_where_it_parts(farside: Farside, flown: FinishedRun) -> None:
    """Without the blackout, from the middle of it on; the new log lands in the current folder."""
    change = ("--from", "47", "--set", "link.blackouts=[]")
    status, out, _ = farside("rerun", str(flown.log), *change, "--json")
    assert status == 0
    new = json.loads(out)["log"]
    assert new == "logs/runs/blackout-seed1-1.mcap"
    assert farside("verify")[0] == 0  # the newest

    status, out, _ = farside("diff", str(flown.log), new)
    told = json.loads(farside("diff", str(flown.log), new, "--json")[1])

    assert status == 1
    assert "  link.blackouts, from 47 s on\n    A  [{" in out
    assert "the first that differs, at 47 s in /link/outage:" in out
    assert "nothing more of this" in out
    before = [r for r in LogFile(flown.log).records() if r.log_time_ns < 47e9]
    assert told["records"] >= len(before)
    assert told["missions"] == [
        {
            "key": "link.blackouts",
            "first": [{"start_s": 42.0, "end_s": 67.0, "direction": "both", "reason": "blackout"}],
            "second": [],
            "from_s": 47.0,
        }
    ]
    assert told["threads"][0]["name"] == "outages of the link"


def test_a_run_differs_in_nothing_from_itself(farside: Farside, flown: FinishedRun) -> None:
    status, out, _ = farside("diff", str(flown.log), str(flown.log))
    assert status == 0
    assert out.splitlines()[-1].startswith("equal: ")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from", "5", "--set", "link.mtu_byte=512"), "link.mtu_byte: expected no change during"),
        (("--from", "500"), "expected a moment of the run, 0 to 55 s, found 500 s"),
        (("--set", "link.up.los=1"), "link.up.los: expected one of the keys"),
        (("--set", "loss"), "expected KEY=VALUE"),
    ],
)
def test_no_other_course_by_what_cannot_be(
    farside: Farside, flown: FinishedRun, arguments: tuple[str, ...], words: str
) -> None:
    status, out, err = farside("rerun", str(flown.log), *arguments)

    assert (status, out) == (2, "")
    assert words in err
    assert not Path("logs").exists()
