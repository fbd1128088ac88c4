"""`farside link check` as a person or a pipeline sees it."""

import json
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


def test_an_invalid_profile_is_refused(tmp_path: Path) -> None:
    profile = tmp_path / "mine.toml"
    profile.write_text("[up]\nlos = 0.5\n", encoding="utf-8")
    result = link_check(str(profile))
    assert result.exit_code == 2
    assert "los" in result.output
