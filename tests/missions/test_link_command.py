"""What `farside link` refuses before it connects to anybody."""

import pytest
from typer.testing import CliRunner

from farside.missions.commands.main import app

SIDES = ["--rover-side", "tcp/127.0.0.1:1", "--ground-side", "tcp/127.0.0.1:1", "--up", "cmd"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--duration", "inf"], 'expected a number of seconds > 0 and <= 1e+09, found "inf"'),
        (["--duration", "nan"], 'expected a number of seconds > 0 and <= 1e+09, found "nan"'),
        (["--duration", "1e300"], 'expected a number of seconds > 0 and <= 1e+09, found "1e300"'),
        (["--duration", "soon"], 'expected a number of seconds > 0 and <= 1e+09, found "soon"'),
        (
            ["--preset", "moon", "--set", "down.loss=2"],
            (
                "--set: moon: down.loss: expected a number >= 0 and <= 1, found 2 "
                "(with --set down.loss=2)"
            ),
        ),
        (
            ["--preset", "moon", "--set", "down.rate_trace.file=no.trace"],
            "--set: moon: down.rate_trace.file: expected a file, found: ",
        ),
        (
            ["--set", "ephemeris.body=marz", "--set", "ephemeris.epoch=2026-01-01"],
            'found "marz"; did you mean mars?',
        ),
        (["--set", "preset=moom"], "--set: perfect: preset: expected the name of a preset ("),
        (
            ["--set", "down.loss.mean=1"],
            "--set: expected a table or an array around mean, found 0.5",
        ),
        (["--set", "x" * 100_000 + "=1"], "x…: expected one of the keys up, down, "),
        (["--profile", "p" * 100_000], "expected a file, found: "),
        (["--ground-side", "g" * 100_000], "expected a Zenoh locator such as tcp/localhost:7447, "),
        (["--up", "/" + "u" * 100_000], "expected a Zenoh key expression, found: "),
    ],
)
def test_a_link_that_cannot_be_is_refused_in_words(options: list[str], words: str) -> None:
    if "down.loss.mean=1" in options:
        options = ["--set", "down.loss=0.5", *options]
    result = CliRunner().invoke(app, ["link", *SIDES, *options], env={"COLUMNS": "140"})
    assert result.exit_code == 2
    assert words in result.output
    assert len(result.output) < 3000
