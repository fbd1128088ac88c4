"""`farside link check` as a person or a pipeline sees it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from farside.link.channel.node import Channel
from farside.link.check import CheckReport, check_link
from farside.link.profile.config import LinkConfig, OneWay
from farside.missions.commands import link_check as link_check_cli
from farside.missions.commands.main import app


def link_check(*arguments: str) -> Result:
    return CliRunner().invoke(
        app, ["link", "check", *arguments], env={"COLUMNS": "140"}, catch_exceptions=True
    )


def rows(output: str) -> list[list[str]]:
    return [
        [cell.strip() for cell in line.strip("│┃").split("│")]
        for line in output.splitlines()
        if line.startswith("│")
    ]


def test_a_preset_is_proven_in_a_table_for_each_direction() -> None:
    result = link_check("moon", "--frames", "2000")
    assert result.exit_code == 0
    assert "Up, from the ground" in result.output
    assert "Down, from the rover" in result.output
    up = {row[0]: row[1:] for row in rows(result.output.partition("Down")[0])}
    assert up["delay"][:2] == ["1.282 s", "1.282 s"]
    assert up["rate"][:2] == ["4,000 bit/s", "4,000 bit/s"]
    assert up["loss"][0] == "0.1 %"
    assert {cells[-1] for cells in up.values()} <= {"inside", "not measured"}
    assert "nothing outside" in result.output


def test_one_json_object_says_the_same(tmp_path: Path) -> None:
    profile = tmp_path / "mine.toml"
    profile.write_text("[up]\ndelay_s = 1.0\nloss = 0.5\n[down]\ndelay_s = 2.0\n", encoding="utf-8")
    result = link_check(str(profile), "--frames", "1000", "--seed", "5", "--json")
    assert result.exit_code == 0
    report = json.loads(result.output)
    assert report["seed"] == 5
    loss = report["measurements"][0]
    assert (loss["direction"], loss["impairment"], loss["asked"]) == ("up", "loss", 0.5)
    assert loss["low"] < loss["measured"] < loss["high"]
    assert loss["verdict"] == "inside"


def test_a_value_outside_is_exit_status_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def of_another(config: LinkConfig, frames: int, seed: int, on_progress: object) -> CheckReport:
        asked = LinkConfig(up=OneWay(loss=0.2))
        given = LinkConfig(up=OneWay(loss=0.3))
        return check_link(asked, lambda _config, rngs: Channel(given, rngs), frames, seed)

    monkeypatch.setattr(link_check_cli, "check_link", of_another)
    result = link_check("perfect", "--frames", "2000")
    assert result.exit_code == 1
    assert "outside" in result.output


def test_what_is_not_measured_has_its_reason_below_the_table(tmp_path: Path) -> None:
    profile = tmp_path / "mine.toml"
    text = "[up]\ndelay_s = 1.0\nrate_bit_s = 800\n[down]\ndelay_s = 1.0\n"
    text += "[[changes]]\nat_s = 10.0\nrate_bit_s = 2400\n"
    profile.write_text(text, encoding="utf-8")
    result = link_check(str(profile), "--frames", "100")
    assert result.exit_code == 0
    reason = "a full queue takes 42.8 s to be sent, and no window is longer than 10 s"
    assert f"not measured: queue: {reason}\n" in result.output
    told = json.loads(link_check(str(profile), "--frames", "100", "--json").output)
    assert [one["why"] for one in told["measurements"] if one["impairment"] == "queue"] == [
        reason,
        "",
        "",
    ]


FAILING = """
import sys
from farside.__main__ import main
from farside.missions.commands import link_check
link_check.check_link = None
sys.argv = ["farside", "link", "check", "perfect"]
main()
"""


def test_a_check_that_fails_is_exit_status_three() -> None:
    """Never 1, which says that a value is outside."""
    done = subprocess.run(  # noqa: S603 - Farside alone
        [sys.executable, "-c", FAILING], capture_output=True, text=True, check=False
    )
    assert done.returncode == 3
    assert "farside: a fault of Farside itself, not of its input: TypeError" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_an_invalid_profile_is_refused(tmp_path: Path) -> None:
    profile = tmp_path / "mine.toml"
    profile.write_text("[up]\nlos = 0.5\n", encoding="utf-8")
    result = link_check(str(profile))
    assert result.exit_code == 2
    assert "los" in result.output
