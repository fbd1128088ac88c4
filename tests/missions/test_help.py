"""What `--help` says, and what is answered to a slip of the fingers."""

import re
from collections.abc import Callable

import pytest

COMMANDS = [
    (),
    ("run",),
    ("check",),
    ("console",),
    ("info",),
    ("replay",),
    ("export",),
    ("recover",),
    ("report",),
    ("story",),
    ("why",),
    ("verify",),
    ("rerun",),
    ("diff",),
    ("layout",),
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
    assert set(farside()[1].split()) == {"recover", "replay", "report", "rerun"}
