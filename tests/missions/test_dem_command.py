"""`farside dem learn`, as a person at a terminal meets it."""

import io
import json
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from farside.missions.commands import main as cli

CORRIDOR = [("a", "E"), ("b", "E"), ("c", "E"), ("d", "W"), ("c", "W"), ("b", "W"), ("a", None)]


@pytest.fixture
def farside(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Callable[..., tuple[int, str, str]]:
    """Runs `farside dem ...` in an empty folder: exit status, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["farside", "dem", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, *capsys.readouterr()

    return run


def lines(cycles: Sequence[tuple[str, str | None]]) -> str:
    """A stream of cycles, each given as a place and the action performed there."""
    return "".join(
        json.dumps({"tokens": [f"at:{place}"], "action": action}) + "\n" for place, action in cycles
    )


@pytest.fixture
def stream(tmp_path: Path) -> str:
    """The name of a file in which a rover drives along a corridor of four places and back."""
    (tmp_path / "corridor.jsonl").write_text(lines(CORRIDOR))
    return "corridor.jsonl"


def test_a_drive_teaches_signs_hypotheses_and_the_way_to_each_goal(
    farside: Callable[..., tuple[int, str, str]], stream: str
) -> None:
    status, out, err = farside(
        "learn", stream, "--goal", "at:d", "--goal", "at:a", "--action-cost", "E=2.66", "--json"
    )
    learned = json.loads(out)
    assert (status, err) == (0, "")
    assert list(learned) == ["signs", "hypotheses", "policies"]
    assert learned["signs"] == [["at:a"], ["at:b"], ["at:c"], ["at:d"]]
    assert (
        learned["hypotheses"][0].items()
        >= {
            "context": ["at:a"],
            "action": "E",
            "outcome": ["at:b"],
            "delay": 1,
            "cm": 0.5,
            "predictions": 0,
            "successes": 0,
        }.items()
    )
    east, west = learned["policies"]
    assert (east["goal"], west["goal"]) == (["at:d"], ["at:a"])
    assert [(row["sign"], row["action"], row["depth"]) for row in east["values"]] == [
        (["at:d"], None, 0),
        (["at:c"], "E", 1),
        (["at:b"], "E", 2),
        (["at:a"], "E", 3),
    ]
    assert [row["value"] for row in east["values"]] == pytest.approx(
        [steps * 2.66 / 0.5 for steps in range(4)]
    )
    # An action whose cost is not stated costs 1.
    assert [row["value"] for row in west["values"]] == [0, 2, 4, 6]


def test_predictions_that_come_true_or_fail_move_the_corroboration(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "drive.jsonl").write_text(
        lines([("a", "E"), ("b", "W"), ("a", "E"), ("b", "W"), ("a", "E"), ("c", None)])
    )
    _, out, _ = farside("learn", "drive.jsonl", "--json", "--alpha", "0.6", "--beta", "0.4")
    first = json.loads(out)["hypotheses"][0]
    assert (first["context"], first["action"], first["outcome"]) == (["at:a"], "E", ["at:b"])
    assert (first["predictions"], first["successes"]) == (2, 1)
    assert first["cm"] == pytest.approx((0.5 + 0.6 * 0.5) * (1.0 - 0.4))


def test_a_goal_of_several_tokens_is_a_sign_from_the_first_cycle_on(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "turns.jsonl").write_text(
        '{"tokens": ["at:a", "heading:N"], "action": "turn"}\n'
        '{"tokens": ["at:a", "heading:E"], "action": null}\n'
    )
    _, out, _ = farside("learn", "turns.jsonl", "--goal", "heading:E  at:a", "--json")
    (policy,) = json.loads(out)["policies"]
    assert policy["goal"] == ["at:a", "heading:E"]
    assert {"sign": ["heading:N"], "value": 2, "action": "turn", "depth": 1} in policy["values"]


def test_a_goal_that_was_never_sensed_has_no_values(
    farside: Callable[..., tuple[int, str, str]], stream: str
) -> None:
    _, out, _ = farside("learn", stream, "--goal", "at:moon", "--json")
    assert json.loads(out)["policies"] == [{"goal": ["at:moon"], "values": []}]


def test_reach_gives_hypotheses_with_longer_delays(
    farside: Callable[..., tuple[int, str, str]], stream: str
) -> None:
    _, out, _ = farside("learn", stream, "--reach", "2", "--json")
    assert {hypothesis["delay"] for hypothesis in json.loads(out)["hypotheses"]} == {1, 2}


def test_a_new_hypothesis_starts_with_the_initial_cm(
    farside: Callable[..., tuple[int, str, str]], stream: str
) -> None:
    _, out, _ = farside("learn", stream, "--initial-cm", "0.25", "--json")
    assert {hypothesis["cm"] for hypothesis in json.loads(out)["hypotheses"]} == {0.25}


def test_the_seed_alone_decides_which_opportunities_are_taken(
    farside: Callable[..., tuple[int, str, str]], stream: str
) -> None:
    def learn(seed: str) -> str:
        arguments = ("--learning-probability", "0.5", "--reach", "3", "--seed", seed, "--json")
        return farside("learn", stream, *arguments)[1]

    assert learn("1") == learn("1")
    assert len({learn(str(seed)) for seed in range(8)}) > 1


def test_ineffective_hypotheses_are_removed_unless_removal_is_off(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    drive = [("a", "E"), ("b", "W"), *([("a", "E"), ("c", "W")] * 40)]
    (tmp_path / "drive.jsonl").write_text(lines(drive))

    def ends(*options: str) -> list[list[str]]:
        _, out, _ = farside("learn", "drive.jsonl", "--json", *options)
        return [hypothesis["outcome"] for hypothesis in json.loads(out)["hypotheses"]]

    assert ["at:b"] not in ends()
    assert ["at:b"] in ends("--no-removal")


def test_conjunctions_are_made_unless_differentiation_is_off(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    """The outcome of E depends on place and light together; neither predicts it alone."""
    rng = np.random.default_rng(1)
    cycles = []
    for place, light in zip(rng.integers(2, size=600), rng.integers(2, size=600), strict=True):
        end = "bc"[place ^ light]
        cycles.append(f'{{"tokens": ["at:{"ad"[place]}", "light:{light}"], "action": "E"}}\n')
        cycles.append(f'{{"tokens": ["at:{end}", "light:{light}"], "action": "W"}}\n')
    (tmp_path / "lit.jsonl").write_text("".join(cycles))

    def longest(*options: str) -> int:
        _, out, _ = farside("learn", "lit.jsonl", "--json", *options)
        return max(len(sign) for sign in json.loads(out)["signs"])

    assert longest() > 1
    assert longest("--no-situations") > 1
    assert longest("--no-situations", "--no-differentiation") == 1


def test_a_stream_may_come_from_standard_input(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    piped = io.TextIOWrapper(io.BytesIO(lines(CORRIDOR).encode()))
    monkeypatch.setattr(sys, "stdin", piped)
    status, out, _ = farside("learn", "-", "--json")
    assert status == 0
    assert len(json.loads(out)["signs"]) == 4


def test_blank_lines_are_skipped_but_counted(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "drive.jsonl").write_text("\n" + lines(CORRIDOR) + "\n \n[]")
    _, _, err = farside("learn", "drive.jsonl")
    assert "line 11:" in err


def test_tables_show_the_strongest_hypotheses_first(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    drive = [("a", "E"), ("b", "W")] * 4 + [("a", "N"), ("a", "E")]
    (tmp_path / "drive.jsonl").write_text(lines(drive))
    status, out, _ = farside("learn", "drive.jsonl", "--goal", "at:b")
    assert status == 0
    assert out.index("Signs") < out.index("Hypotheses") < out.index("Policy towards at:b")
    rows = [line.split() for line in out.splitlines()]
    hypotheses = [row for row in rows if len(row) == 7 and row[0].startswith("at:")]
    assert [row[:5] for row in hypotheses] == [
        ["at:a", "E", "at:b", "1", "0.875"],
        ["at:b", "W", "at:a", "1", "0.875"],
        ["at:a", "N", "at:a", "1", "0.500"],
    ]
    assert ["at:a", "1.14", "E", "1"] in rows


def test_tables_show_thirty_rows_and_say_how_many_more_there_are(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    drive = [(str(place), "E") for place in range(45)]
    (tmp_path / "drive.jsonl").write_text(lines(drive))
    _, out, _ = farside("learn", "drive.jsonl")
    assert "Signs  45" in out
    assert "Hypotheses  44" in out
    assert "and 14 more" in out


def test_a_line_without_an_end_is_refused(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, err = farside("learn", "/dev/zero")
    assert (status, out) == (2, "")
    assert err == (
        "farside: /dev/zero: line 1: expected at most 1048576 bytes in a line, found a longer one\n"
    )


def test_tokens_that_would_steer_a_terminal_are_shown_escaped(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "steering.jsonl"
    path.write_text('{"tokens": ["a\\u001b[2J"], "action": "N"}\n')
    _, out, _ = farside("learn", "steering.jsonl")
    assert "a\\x1b[2J" in out
    assert "\x1b" not in out


def test_tokens_that_look_like_markup_are_shown_as_they_are(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "drive.jsonl").write_text('{"tokens": ["[red]hot[/red]"], "action": "N"}\n')
    _, out, _ = farside("learn", "drive.jsonl")
    assert "[red]hot[/red]" in out


CYCLE = 'expected a cycle such as {"tokens": ["at:0,0"], "action": "N"}, with null for no action'


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ('{"tokens": ["at:a"], "action"', 'found {"tokens": ["at:a"], "action" ('),
        ('{"tokens": ["at:a"]}', "missing required field `action`"),
        ('{"action": "N"}', "missing required field `tokens`"),
        ('{"tokens": "at:a", "action": "N"}', "`$.tokens`"),
        ('{"tokens": ["at:a", 3], "action": "N"}', "`$.tokens[1]`"),
        ('{"tokens": ["at:a"], "action": 3}', "`$.action`"),
        ('{"tokens": ["at:a"], "action": "N", "goal": "B"}', "unknown field `goal`"),
        ("7", "found 7 ("),
        (b'{"tokens": ["\xff"], "action": "N"}', r"\xff"),
        ("[" * 100_000, "found [[["),
    ],
)
def test_an_invalid_line_is_reported_by_number_and_nothing_is_printed(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path, line: str | bytes, found: str
) -> None:
    line = line if isinstance(line, bytes) else line.encode()
    (tmp_path / "drive.jsonl").write_bytes(lines(CORRIDOR).encode() + line)
    status, out, err = farside("learn", "drive.jsonl", "--json")
    assert (status, out) == (2, "")
    assert err.startswith(f"farside: drive.jsonl: line 8: {CYCLE}, found ")
    assert found in err
    assert len(err) < 400


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (None, "nowhere.jsonl: expected a file of cycles, found: No such file or directory"),
        ("", "expected an action in at least one cycle, found none"),
        (lines([("a", None)]), "expected an action in at least one cycle, found none"),
    ],
)
def test_a_file_without_cycles_is_refused(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path, content: str | None, found: str
) -> None:
    name = "nowhere.jsonl" if content is None else "drive.jsonl"
    if content is not None:
        (tmp_path / name).write_text(content)
    status, out, err = farside("learn", name)
    assert (status, out) == (2, "")
    assert found in err


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        ("--alpha", "2", "alpha: expected a number >= 0 and <= 1, found 2"),
        ("--beta", "nan", "beta: expected a number >= 0 and <= 1, found nan"),
        ("--reach", "0", "reach: expected a whole number >= 1 and <= 1000, found 0"),
        ("--action-cost", "N", "expected ACTION=COST"),
        ("--action-cost", "N=0", "expected ACTION=COST"),
        ("--action-cost", "N=inf", "expected ACTION=COST"),
        ("--action-cost", "=1", "expected ACTION=COST"),
        ("--goal", " ", "expected Tokens separated by spaces"),
    ],
)
def test_an_option_out_of_range_is_refused(
    farside: Callable[..., tuple[int, str, str]], stream: str, option: str, value: str, named: str
) -> None:
    status, out, err = farside("learn", stream, option, value)
    assert (status, out) == (2, "")
    unboxed = " ".join(err.replace("│", " ").split())
    assert named in unboxed
    assert "Traceback" not in err


def test_an_action_may_have_an_equals_sign_in_its_name(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    (tmp_path / "drive.jsonl").write_text(lines([("a", "v=1"), ("b", None)]))
    _, out, _ = farside(
        "learn", "drive.jsonl", "--action-cost", "v=1=5", "--goal", "at:b", "--json"
    )
    assert math.isclose(json.loads(out)["policies"][0]["values"][1]["value"], 10)


def test_help_teaches_by_example(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("learn", "--help")
    assert status == 0
    assert "farside dem learn drive.jsonl" in out
    assert "separated by spaces" in " ".join(out.replace("│", " ").split())
